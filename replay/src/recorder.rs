//! The part of a recording that runs on the thread of the world: it copies, and sends the copies to a thread that
//! writes.
//!
//! Another process can continue a recording: it builds the run anew at tick 0, creates a recorder, adds the ticks of the
//! earlier process from a log, and goes on. The file has the same chain; only poses before that are missing.

use crate::format::HASH_EVERY;
use crate::header::Header;
use crate::item::Item;
use crate::messages::{ActionMessage, PushMessage, StateHash};
use crate::poses::{PoseFrame, RATE};
use crate::signature::Signer;
use crate::signed_file::Written;
use crate::writer::{Plan, write};
use palmares_tasks::observation::Wrench;
use palmares_tasks::{Action, Event, Outcome, Run};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::{SystemTime, UNIX_EPOCH};
use thread_priority::{ThreadPriority, ThreadPriorityValue};

/// Largest number of queued batches.
const MAX_BATCHES: usize = 8;
/// While more items than this are queued, poses are left out; actions never are.
const MAX_ITEMS_FOR_POSES: usize = 4_000;

/// Reason why there is no replay.
#[derive(Clone, Debug, thiserror::Error)]
#[error("replay {}: {message}", path.display())]
pub struct RecordError {
    path: PathBuf,
    message: String,
}

impl RecordError {
    fn new(path: &Path, message: impl ToString) -> Self {
        RecordError { path: path.to_owned(), message: message.to_string() }
    }
}

/// A replay on the disk.
#[derive(Clone, Debug, PartialEq)]
pub struct ReplayFile {
    /// Path.
    pub path: PathBuf,
    /// SHA-256, 64 hexadecimal digits.
    pub sha256: String,
    /// Size.
    pub bytes: u64,
    /// The time of the run's end in it, ms since 1970 UTC.
    pub ended_unix_ms: u64,
}

/// A tick of the run's past, from a log.
#[derive(Clone, Debug, PartialEq)]
pub struct LoggedTick {
    /// The action as applied: clipped and complete.
    pub action: Action,
    /// Digest of the state after the tick.
    pub state: StateHash,
    /// Events of the referee in this tick.
    pub events: Vec<Event>,
    /// External wrenches that begin with this tick.
    pub pushes: Vec<PushMessage>,
}

/// Records a run.
#[derive(Debug)]
pub struct Recorder {
    path: PathBuf,
    items: Vec<Item>,
    pushes: Vec<PushMessage>,
    channel: Option<SyncSender<Vec<Item>>>,
    thread: Option<JoinHandle<std::io::Result<Written>>>,
    /// The last recorded tick.
    tick: u64,
    /// Number of the last pose frame.
    frames: u64,
    tick_s: f64,
}

impl Recorder {
    /// The path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Creates `<folder>/<run_id>.mcap`. `hand_files`: the archive of a hand that is not built in.
    ///
    /// # Errors
    /// The file cannot be created, or exists.
    pub fn create(
        folder: &Path,
        mut header: Header,
        run: &Run,
        signer: &Arc<Signer>,
        hand_files: Option<Arc<Vec<u8>>>,
    ) -> Result<Self, RecordError> {
        let path = folder.join(format!("{}.mcap", header.run_id));
        if run.task().is_varied() {
            let message = "a randomised run, or one with a part of the objects, cannot be recorded";
            return Err(RecordError::new(&path, message));
        }
        let failed = |error: std::io::Error| RecordError::new(&path, error);
        std::fs::create_dir_all(folder).map_err(failed)?;
        let file =
            std::fs::File::options().read(true).write(true).create_new(true).open(&path).map_err(failed)?;
        header.hand_attached = hand_files.is_some();
        let tick_s = header.tick_s;
        let plan = Plan::new(file, header, run, signer.clone(), hand_files);
        let (channel, inbox) = sync_channel(MAX_BATCHES);
        let thread = std::thread::Builder::new().name("replay".into()).spawn(move || {
            // Lower than that of ticks. When the writer falls behind, poses are left out; the world never waits.
            let below =
                ThreadPriorityValue::try_from(40).map_or(ThreadPriority::Min, ThreadPriority::Crossplatform);
            if let Err(error) = below.set_for_current() {
                tracing::debug!(?error, "thread priority not set");
            }
            write(plan, &inbox)
        });
        let thread = thread.map_err(failed)?;
        let mut recorder = Recorder {
            path,
            items: Vec::new(),
            pushes: Vec::new(),
            channel: Some(channel),
            thread: Some(thread),
            tick: 0,
            frames: 0,
            tick_s,
        };
        recorder.items.push(Item::Hash(run.tick(), StateHash::of(run)));
        recorder.items.push(Item::Poses(Box::new(pose_frame(run))));
        recorder.send();
        Ok(recorder)
    }

    /// Records a push that begins with the next tick.
    pub fn push(&mut self, link: &str, wrench: Wrench, duration_s: f64) {
        self.pushes.push(PushMessage { link: link.into(), wrench, duration_s });
    }

    /// Records the next tick of a run that another process has begun. Waits for the disk when the writer falls behind.
    pub fn past(&mut self, LoggedTick { action, state, events, pushes }: LoggedTick) {
        self.add(ActionMessage { tick: self.tick, action, state: Some(state), pushes }, &events);
        if self.tick.is_multiple_of(HASH_EVERY) {
            self.items.push(Item::Hash(self.tick, state));
            let items = std::mem::take(&mut self.items);
            if self.channel.as_ref().is_some_and(|channel| channel.send(items).is_err()) {
                // The writer has failed; `finish` returns its error.
                self.channel = None;
            }
        }
    }

    /// Records the tick that `run` has just made.
    pub fn tick(&mut self, run: &Run) {
        self.tick_with(run, StateHash::of(run));
    }

    /// As [`Recorder::tick`], with the digest of the run's state.
    pub fn tick_with(&mut self, run: &Run, state: StateHash) {
        let tick = run.tick();
        let pushes = std::mem::take(&mut self.pushes);
        let message =
            ActionMessage { tick: tick - 1, action: run.applied().clone(), state: Some(state), pushes };
        self.add(message, run.events());
        let frames = (tick as f64 * self.tick_s * RATE) as u64;
        if frames > self.frames && self.items.len() < MAX_ITEMS_FOR_POSES {
            self.frames = frames;
            self.items.push(Item::Poses(Box::new(pose_frame(run))));
        }
        if tick.is_multiple_of(HASH_EVERY) {
            self.items.push(Item::Hash(tick, state));
            self.send();
        }
    }

    fn add(&mut self, message: ActionMessage, events: &[Event]) {
        self.tick = message.tick + 1;
        self.items.push(Item::Action(message));
        self.items.extend(events.iter().cloned().map(Item::Event));
    }

    /// Sends the collected items, unless the queue is full: then they stay until the next call. The world never waits
    /// for the disk.
    fn send(&mut self) {
        let Some(channel) = &self.channel else { return };
        match channel.try_send(std::mem::take(&mut self.items)) {
            Ok(()) => self.items.reserve(2 * HASH_EVERY as usize),
            Err(TrySendError::Full(items)) => self.items = items,
            // The writer has failed; `finish` returns its error.
            Err(TrySendError::Disconnected(_)) => self.channel = None,
        }
    }

    /// Deletes the file.
    ///
    /// # Errors
    /// The file could not be deleted.
    pub fn discard(mut self) -> Result<(), RecordError> {
        // The writer ends when the channel closes.
        self.channel = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        std::fs::remove_file(&self.path).map_err(|error| RecordError::new(&self.path, error))
    }

    /// Ends the recording, signs it and waits until it is on disk.
    ///
    /// # Errors
    /// The file could not be written completely.
    pub fn finish(self, run: &Run, outcome: &Outcome) -> Result<ReplayFile, RecordError> {
        let ended = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        self.finish_at(run, outcome, u64::try_from(ended.as_millis()).unwrap_or(u64::MAX))
    }

    /// As [`Recorder::finish`], for a run that ended earlier, at this time in ms since 1970 UTC.
    ///
    /// # Errors
    /// The file could not be written completely.
    pub fn finish_at(
        mut self,
        run: &Run,
        outcome: &Outcome,
        ended_unix_ms: u64,
    ) -> Result<ReplayFile, RecordError> {
        let mut items = std::mem::take(&mut self.items);
        items.push(Item::Poses(Box::new(pose_frame(run))));
        items.push(Item::Outcome(Box::new(outcome.clone()), ended_unix_ms));
        if let Some(channel) = self.channel.take() {
            // If the writer has failed, `join` below returns its error.
            let _ = channel.send(items);
        }
        let failed = |error: &dyn ToString| RecordError::new(&self.path, error.to_string());
        let Some(thread) = self.thread.take() else { return Err(failed(&"ended twice")) };
        let written = thread.join().map_err(|_| failed(&"its thread panicked"))?;
        let Written { sha256, bytes } = written.map_err(|error| {
            // It would take the space that a full disk lacks.
            let _ = std::fs::remove_file(&self.path);
            failed(&error)
        })?;
        Ok(ReplayFile { path: self.path.clone(), sha256, bytes, ended_unix_ms })
    }
}

/// The present poses and sample of a run.
pub(crate) fn pose_frame(run: &Run) -> PoseFrame {
    let (model, state) = (run.world().model(), run.world().state());
    let objects = (0..state.objects.len()).map(|k| state.object_pose(model, k)).collect();
    PoseFrame {
        tick: run.tick(),
        base: state.base,
        q: state.q.clone(),
        objects,
        score: run.score(),
        sample: run.sample(),
    }
}
