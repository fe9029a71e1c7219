//! Threads that verify replays.

use super::sources::Source;
use super::verdict::Verdict;
use palmares_replay::{self as replay, PublicKey, VerifyError};
use palmares_tasks::Task;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::Sender;

/// Stack of a thread: that of a main thread.
const STACK: usize = 8 << 20;

/// An event of a verification.
pub(super) enum Event {
    /// The verdict on the source of this index.
    Judged(usize, Verdict),
    /// Ctrl-C.
    #[cfg_attr(
        not(feature = "server"),
        expect(dead_code, reason = "only the server's libraries catch Ctrl-C")
    )]
    Interrupted,
    /// Nothing more comes.
    Failed(anyhow::Error),
}

/// The requirements for all replays.
pub(super) struct Judge {
    pub(super) key: Option<PublicKey>,
    pub(super) tasks: Vec<Arc<Task>>,
}

impl Judge {
    /// Plays a replay again.
    fn judge(&self, source: &Source) -> Verdict {
        let bytes = match source.load() {
            Ok(bytes) => bytes,
            Err(error) => return Verdict::Unreadable { message: format!("{error:#}") },
        };
        let check = || -> Result<_, VerifyError> {
            let replay = replay::read(&bytes)?;
            replay.signed_by(self.key.as_ref())?;
            let verified = replay::verify(&replay, &self.tasks)?;
            Ok((replay, verified))
        };
        // One replay does not end the verification of the others.
        match catch_unwind(AssertUnwindSafe(check)) {
            Ok(result) => result.into(),
            Err(_) => Verdict::Unreadable { message: "the check of this replay panicked".into() },
        }
    }
}

/// Starts the threads. They end with the process: a replay in progress has no result after Ctrl-C.
pub(super) fn start(
    threads: usize,
    judge: Judge,
    sources: Arc<[Source]>,
    events: &Sender<Event>,
) -> std::io::Result<()> {
    let (judge, next) = (Arc::new(judge), Arc::new(AtomicUsize::new(0)));
    for _ in 0..threads.min(sources.len()) {
        let (judge, next, sources, events) = (judge.clone(), next.clone(), sources.clone(), events.clone());
        let work = move || {
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let Some(source) = sources.get(index) else { return };
                if events.send(Event::Judged(index, judge.judge(source))).is_err() {
                    return;
                }
            }
        };
        std::thread::Builder::new().name("verify".into()).stack_size(STACK).spawn(work)?;
    }
    Ok(())
}
