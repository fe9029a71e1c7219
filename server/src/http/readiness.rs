//! Whether the server can do its work: it proves that it can write in its database and in its data directory.

use palmares_store::Store;
use palmares_store::files::blocking::blocking;
use palmares_store::files::private_files;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;
use tokio::sync::Mutex;
use tokio::time::{Instant, timeout};

/// A proof holds for this time: many readers of `/readyz` cost one write a second.
const HOLDS: Duration = Duration::from_secs(1);
/// Longest wait for the database.
const PATIENCE: Duration = Duration::from_secs(3);
/// Bytes that are written in the data directory: more than a block, less than a second of a replay.
const PROOF_BYTES: usize = 64 << 10;

/// A proof, or the reason why there is none.
type Proof = Result<(), String>;

/// Proves that the server can write.
#[derive(Debug)]
pub(crate) struct Readiness {
    store: Store,
    data_dir: PathBuf,
    /// Held during a proof: others wait for its result.
    last: Mutex<Option<(Instant, Proof)>>,
}

impl Readiness {
    /// Nothing is proved yet.
    pub(crate) fn new(store: Store, data_dir: &Path) -> Self {
        Readiness { store, data_dir: data_dir.to_owned(), last: Mutex::default() }
    }

    /// The data directory.
    pub(crate) fn data_dir(&self) -> &Path {
        &self.data_dir
    }

    /// Writes, unless that was tried a moment ago.
    ///
    /// # Errors
    /// Reason why the server cannot write.
    pub(crate) async fn prove(&self) -> Proof {
        let mut last = self.last.lock().await;
        if let Some((at, proof)) = &*last
            && at.elapsed() < HOLDS
        {
            return proof.clone();
        }
        let proof = self.write().await;
        match (&*last, &proof) {
            (Some((_, Err(_))), Ok(())) => tracing::warn!("the server can write again"),
            (None | Some((_, Ok(()))), Err(why)) => tracing::error!(why, "the server is not ready"),
            _ => {}
        }
        *last = Some((Instant::now(), proof.clone()));
        proof
    }

    async fn write(&self) -> Proof {
        match timeout(PATIENCE, self.store.prove_writing()).await {
            Ok(Ok(())) => {}
            Ok(Err(error)) => return Err(format!("the database takes no writes: {error}")),
            Err(_) => return Err("the database does not answer".into()),
        }
        let path = self.data_dir.join("readyz.draft");
        let written = blocking(move || write_and_delete(&path)).await.and_then(|written| written);
        written.map_err(|error| format!("the data directory takes no files: {error}"))
    }
}

fn write_and_delete(path: &Path) -> io::Result<()> {
    let written = private_files::create(path).and_then(|mut file| file.write_all(&[0x5a; PROOF_BYTES]));
    // Also after a failure: it may have taken the last bytes.
    let deleted = std::fs::remove_file(path);
    written.and(deleted)
}
