//! The folder of replays.

use super::keys::Keys;
use palmares_models::hand::Hand;
use palmares_net::auth::sha256_hex;
use palmares_replay::{
    Header, LoggedTick, PublicKey, RecordError, Recorder, Replay, ReplayFile, Signer, VerifyError,
};
use palmares_store::files::blocking::assert_may_block;
use palmares_store::files::objects::{Objects, replay_key, write_whole};
use palmares_store::files::private_files;
use palmares_store::files::stored_path::{REPLAYS, checked};
use palmares_tasks::observation::Wrench;
use palmares_tasks::{Outcome, Run};
use palmares_worlds::world::{RunObserver, Ticked};
use parking_lot::Mutex;
use std::collections::BTreeMap;
use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tokio::sync::{Notify, oneshot};

/// Content hash of a hand, and the hash of the ranges from which its numbers are drawn, if they are.
type HandKey = (String, Option<String>);

/// The replays of a server.
#[derive(Debug)]
pub(crate) struct Archive {
    data_dir: PathBuf,
    signer: Arc<Signer>,
    /// Keys that signed earlier.
    earlier_keys: Vec<PublicKey>,
    /// Archives of the hands that are not built in, by the hand.
    hand_files: Mutex<BTreeMap<HandKey, Arc<Vec<u8>>>>,
    /// Bytes of practice replays to keep.
    pub(super) practice_bytes: u64,
    /// Starts a round of verification.
    pub(super) wakeup: Notify,
    /// Starts an upload.
    pub(super) finished: Notify,
    /// The storage that servers share.
    objects: Option<Arc<Objects>>,
}

impl Archive {
    /// Opens the archive in a data directory; creates the folder if it is missing.
    ///
    /// # Errors
    /// The folder cannot be created.
    pub(crate) fn open(data_dir: &Path, keys: Keys, practice_bytes: u64) -> std::io::Result<Self> {
        private_files::make_folder(&data_dir.join(REPLAYS))?;
        Ok(Archive {
            signer: Arc::new(keys.signer),
            earlier_keys: keys.earlier,
            data_dir: data_dir.to_owned(),
            hand_files: Mutex::default(),
            practice_bytes,
            wakeup: Notify::new(),
            finished: Notify::new(),
            objects: None,
        })
    }

    /// The same archive with a storage that servers share.
    pub(crate) fn sharing(self, objects: Option<Arc<Objects>>) -> Self {
        Archive { objects, ..self }
    }

    /// Whether servers share the replays.
    pub(crate) fn is_shared(&self) -> bool {
        self.objects.is_some()
    }

    /// The storage that servers share.
    pub(super) fn objects(&self) -> Option<&Arc<Objects>> {
        self.objects.as_ref()
    }

    /// The bytes of a replay in the data directory or in the shared storage; then they are kept here. None if it is in neither. Bytes
    /// with another digest are returned only if there are no right ones.
    pub(crate) fn read(&self, stored: &str, sha256: &str) -> io::Result<Option<Vec<u8>>> {
        assert_may_block();
        let path = self.locate(stored)?;
        let here = match fs::read(&path) {
            Ok(bytes) => Some(bytes),
            Err(error) if error.kind() == ErrorKind::NotFound => None,
            Err(error) => return Err(error),
        };
        let right = |bytes: &Vec<u8>| sha256_hex(bytes) == sha256;
        let Some(objects) = self.objects.as_ref().filter(|_| !here.as_ref().is_some_and(right)) else {
            return Ok(here);
        };
        let Some(bytes) = objects.get(&replay_key(sha256))?.filter(right) else { return Ok(here) };
        if let Err(error) = write_whole(&path, &bytes) {
            tracing::warn!(%error, path = %path.display(), "a replay of the shared storage is not kept here");
        }
        Ok(Some(bytes))
    }

    /// The public key of the key that signs.
    pub(crate) fn key(&self) -> PublicKey {
        self.signer.public()
    }

    /// The public keys of keys that signed earlier.
    pub(crate) fn earlier_keys(&self) -> &[PublicKey] {
        &self.earlier_keys
    }

    /// Checks that a key of this competition signed a replay.
    pub(super) fn signed(&self, replay: &Replay) -> Result<(), VerifyError> {
        if self.earlier_keys.contains(&replay.key) { Ok(()) } else { replay.signed_by(Some(&self.key())) }
    }

    /// The folder of the replays.
    pub(super) fn folder(&self) -> PathBuf {
        self.data_dir.join(REPLAYS)
    }

    /// The path of a replay, from the path stored with its run.
    ///
    /// # Errors
    /// The stored path leads elsewhere.
    pub(crate) fn locate(&self, stored: &str) -> std::io::Result<PathBuf> {
        checked(REPLAYS, stored).map(|stored| self.data_dir.join(stored))
    }

    /// Adds the files of a hand that is not built in: its replays include them.
    pub(crate) fn add_hand(&self, hand: &Hand, files: Arc<Vec<u8>>) {
        let mut known = self.hand_files.lock();
        known.insert((hand.content_hash(), None), files.clone());
        known.insert((hand.content_hash(), Some(hand.uncertain_hash())), files);
    }

    /// Starts a round of verification, and an upload: a run has ended, or is to be verified again.
    pub(crate) fn wake(&self) {
        self.wakeup.notify_one();
        self.finished.notify_one();
    }

    /// Prepares the recording of a run: the observer that records, and the recording that gives the file.
    pub(crate) fn record(&self, header: Header) -> (RecordingObserver, Recording) {
        let (done, file) = oneshot::channel();
        let (folder, signer) = (self.folder(), self.signer.clone());
        let known = self.hand_files.lock();
        let hand_files = known.get(&(header.hand_hash.clone(), header.hand_drawn.clone())).cloned();
        let unopened = Some(Unopened { folder, header, signer, hand_files });
        (
            RecordingObserver { unopened, recorder: None, done: Some(done), ended_unix_ms: None },
            Recording(file),
        )
    }

    /// As [`Archive::record`], for a run that ended at this time, ms since 1970 UTC. An earlier file of the run is replaced.
    pub(crate) fn record_again(&self, header: Header, ended_unix_ms: u64) -> (RecordingObserver, Recording) {
        let (mut observer, recording) = self.record(header);
        observer.ended_unix_ms = Some(ended_unix_ms);
        (observer, recording)
    }
}

/// The observer that records a run.
pub(crate) struct RecordingObserver {
    /// The inputs of the recorder, until the world is built.
    unopened: Option<Unopened>,
    recorder: Option<Recorder>,
    done: Option<oneshot::Sender<Result<Option<ReplayFile>, RecordError>>>,
    /// When the run ended, if that is not now.
    ended_unix_ms: Option<u64>,
}

struct Unopened {
    folder: PathBuf,
    header: Header,
    signer: Arc<Signer>,
    hand_files: Option<Arc<Vec<u8>>>,
}

impl RecordingObserver {
    /// Begins the recording of a run that another process has played for some ticks: `run` is at tick 0, `past` has those ticks.
    /// An unfinished file of the run is replaced.
    pub(crate) fn continued(&mut self, run: &Run, past: impl Iterator<Item = LoggedTick>) {
        self.replaces();
        self.opened(run);
        if let Some(recorder) = &mut self.recorder {
            past.for_each(|tick| recorder.past(tick));
        }
    }

    /// Deletes an earlier file of the run.
    fn replaces(&self) {
        if let Some(Unopened { folder, header, .. }) = &self.unopened {
            // If it is there and cannot be deleted, the next one cannot be created, which is reported.
            let _ = std::fs::remove_file(folder.join(format!("{}.mcap", header.run_id)));
        }
    }
}

impl RunObserver for RecordingObserver {
    fn opened(&mut self, run: &Run) {
        if self.ended_unix_ms.is_some() {
            self.replaces();
        }
        let Some(Unopened { folder, header, signer, hand_files }) = self.unopened.take() else { return };
        match Recorder::create(&folder, header, run, &signer, hand_files) {
            Ok(recorder) => {
                private_files::restrict(recorder.path(), private_files::FILE_MODE);
                self.recorder = Some(recorder);
            }
            Err(error) => drop(self.done.take().map(|done| done.send(Err(error)))),
        }
    }

    fn pushed(&mut self, link: &str, wrench: Wrench, duration_s: f64) {
        if let Some(recorder) = &mut self.recorder {
            recorder.push(link, wrench, duration_s);
        }
    }

    fn ticked(&mut self, tick: &Ticked<'_>) {
        if let Some(recorder) = &mut self.recorder {
            recorder.tick_with(tick.run, tick.state());
        }
    }

    fn finished(&mut self, run: &Run, outcome: &Outcome) {
        if let (Some(recorder), Some(done)) = (self.recorder.take(), self.done.take()) {
            // A run without a tick has no replay.
            let file = match outcome.ticks {
                0 => recorder.discard().map(|()| None),
                _ => match self.ended_unix_ms {
                    Some(ended) => recorder.finish_at(run, outcome, ended).map(Some),
                    None => recorder.finish(run, outcome).map(Some),
                },
            };
            // An error means that the session no longer waits.
            let _ = done.send(file);
        }
    }
}

/// A recording in progress, which gives the file at the run's end.
#[derive(Debug)]
pub(crate) struct Recording(oneshot::Receiver<Result<Option<ReplayFile>, RecordError>>);

impl Recording {
    /// The file, after the run was scored; None for a run without a tick.
    ///
    /// # Errors
    /// Reason why there is no file.
    pub(crate) async fn file(self) -> Result<Option<ReplayFile>, String> {
        match self.0.await {
            Ok(Ok(file)) => Ok(file),
            Ok(Err(error)) => Err(error.to_string()),
            Err(_) => Err("the recording was dropped".into()),
        }
    }
}

/// The path that is stored with the run, relative to the data directory.
pub(crate) fn stored_path(file: &ReplayFile) -> String {
    let name = file.path.file_name().unwrap_or_default().to_string_lossy();
    format!("{REPLAYS}/{name}")
}
