//! Where a server keeps its replays, and who signs them.

use crate::world::Witness;
use palmares_models::hand::Hand;
use palmares_replay::{Header, KeyError, PublicKey, RecordError, Recorder, ReplayFile, Signer};
use palmares_tasks::observation::Wrench;
use palmares_tasks::{Outcome, Run};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use tokio::sync::{Notify, oneshot};

/// Folder of the replays in the data directory.
const FOLDER: &str = "replays";

/// The replays of a server.
#[derive(Debug)]
pub(crate) struct Archive {
    data_dir: PathBuf,
    signer: Arc<Signer>,
    /// Archives of the hands that do not come with the program, by the hand's content hash.
    hand_files: Mutex<BTreeMap<String, Arc<Vec<u8>>>>,
    /// Bytes of practice replays that are kept.
    pub(super) practice_bytes: u64,
    /// A run has ended, or somebody wants one looked at again.
    pub(super) news: Notify,
}

impl Archive {
    /// The archive in a data directory; directory and key are made when they are missing.
    ///
    /// # Errors
    /// When the key cannot be read or made.
    pub(crate) fn open(data_dir: &Path, key: &Path, practice_bytes: u64) -> Result<Self, KeyError> {
        let folder = data_dir.join(FOLDER);
        let failed = |source| KeyError::File { path: folder.clone(), source };
        std::fs::create_dir_all(&folder).map_err(failed)?;
        Ok(Archive {
            signer: Arc::new(Signer::open(key)?),
            data_dir: data_dir.to_owned(),
            hand_files: Mutex::default(),
            practice_bytes,
            news: Notify::new(),
        })
    }

    /// What everybody may know of the key.
    pub(crate) fn key(&self) -> PublicKey {
        self.signer.public()
    }

    /// Where replays lie.
    pub(super) fn folder(&self) -> PathBuf {
        self.data_dir.join(FOLDER)
    }

    /// Where a path stored with a run lies.
    pub(crate) fn locate(&self, stored: &str) -> PathBuf {
        self.data_dir.join(stored)
    }

    /// Makes the files of a hand known that does not come with the program: they go into its replays.
    pub(crate) fn add_hand(&self, hand: &Hand, files: Arc<Vec<u8>>) {
        let mut known = self.hand_files.lock().unwrap_or_else(PoisonError::into_inner);
        known.insert(hand.content_hash(), files);
    }

    /// Somebody should look at the runs that wait for their verification.
    pub(crate) fn wake(&self) {
        self.news.notify_one();
    }

    /// Prepares to record a run: a witness that begins when the run is there, and the way to its file.
    pub(crate) fn record(&self, header: Header) -> (Scribe, Recording) {
        let (done, file) = oneshot::channel();
        let (folder, signer) = (self.folder(), self.signer.clone());
        let known = self.hand_files.lock().unwrap_or_else(PoisonError::into_inner);
        let hand_files = known.get(&header.hand_hash).cloned();
        let unopened = Some(Unopened { folder, header, signer, hand_files });
        (Scribe { unopened, recorder: None, done: Some(done) }, Recording(file))
    }
}

/// The witness that records.
pub(crate) struct Scribe {
    /// What it begins with when the run is there.
    unopened: Option<Unopened>,
    recorder: Option<Recorder>,
    done: Option<oneshot::Sender<Result<Option<ReplayFile>, RecordError>>>,
}

struct Unopened {
    folder: PathBuf,
    header: Header,
    signer: Arc<Signer>,
    hand_files: Option<Arc<Vec<u8>>>,
}

impl Witness for Scribe {
    fn opened(&mut self, run: &Run) {
        let Some(Unopened { folder, header, signer, hand_files }) = self.unopened.take() else { return };
        match Recorder::create(&folder, header, run, &signer, hand_files) {
            Ok(recorder) => self.recorder = Some(recorder),
            Err(error) => drop(self.done.take().map(|done| done.send(Err(error)))),
        }
    }

    fn pushed(&mut self, link: &str, wrench: Wrench, duration_s: f64) {
        if let Some(recorder) = &mut self.recorder {
            recorder.push(link, wrench, duration_s);
        }
    }

    fn ticked(&mut self, run: &Run) {
        if let Some(recorder) = &mut self.recorder {
            recorder.tick(run);
        }
    }

    fn finished(&mut self, run: &Run, outcome: &Outcome) {
        if let (Some(recorder), Some(done)) = (self.recorder.take(), self.done.take()) {
            // A run without a tick has nothing to play again.
            let file = match outcome.ticks {
                0 => recorder.discard().map(|()| None),
                _ => recorder.finish(run, outcome).map(Some),
            };
            // Nobody may be waiting any more.
            let _ = done.send(file);
        }
    }
}

/// The way to the file of a run that is being recorded.
#[derive(Debug)]
pub(crate) struct Recording(oneshot::Receiver<Result<Option<ReplayFile>, RecordError>>);

impl Recording {
    /// The file, once the run has been counted; none of a run without a tick.
    ///
    /// # Errors
    /// In words, why there is none.
    pub(crate) async fn file(self) -> Result<Option<ReplayFile>, String> {
        match self.0.await {
            Ok(Ok(file)) => Ok(file),
            Ok(Err(error)) => Err(error.to_string()),
            Err(_) => Err("the recording was dropped".into()),
        }
    }
}

/// A replay as it is stored with the run: inside the data directory.
pub(crate) fn stored_path(file: &ReplayFile) -> String {
    let name = file.path.file_name().unwrap_or_default().to_string_lossy();
    format!("{FOLDER}/{name}")
}
