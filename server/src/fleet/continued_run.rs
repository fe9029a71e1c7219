//! Builds a run of another host again, from its header, its ticks and its last snapshot; or plays the whole run again.

use super::shipped_tick::{DecodeError, ShippedTick, decode};
use crate::archive::RecordingObserver;
use palmares_models::hand::Hand;
use palmares_replay::{Header, LoggedTick, StateHash};
use palmares_store::{ShippedRun, StoredTicks};
use palmares_tasks::run::Snapshot;
use palmares_tasks::{Outcome, Reason, Run, SceneError, Task, identity};
use palmares_worlds::compute::admission::Admitted;
use palmares_worlds::compute::background::{Background, JobError, JobPriority};
use palmares_worlds::world::run::{OpenedWorld, World};
use palmares_worlds::world::{RunObserver, Ticked};
use std::sync::Arc;

/// The inputs of a run that another host has begun.
pub(crate) struct ContinuedRun {
    /// The header of its replay.
    pub(crate) header: Header,
    /// Its task.
    pub(crate) task: Arc<Task>,
    /// Its hand.
    pub(crate) hand: Arc<Hand>,
    /// Its ticks, and its last snapshot.
    pub(crate) shipped: ShippedRun,
}

/// Reason why a run cannot be continued: it is void.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ContinueError {
    /// The header is of something else.
    #[error("the run has another {0} than this server")]
    Other(&'static str),
    /// Stored ticks cannot be read.
    #[error("the ticks after tick {from}: {error}")]
    Unreadable {
        /// The tick before them.
        from: u64,
        /// The reason.
        error: DecodeError,
    },
    /// Stored ticks are missing.
    #[error("the ticks after tick {from} are missing; the next are those after tick {next}")]
    Missing {
        /// The last tick that is there.
        from: u64,
        /// The tick before the next that are there.
        next: i64,
    },
    /// The number of ticks in a row is wrong.
    #[error("the ticks after tick {from}: {found} instead of {expected}")]
    Count {
        /// The tick before them.
        from: u64,
        /// Their number.
        found: usize,
        /// The number that was stored with them.
        expected: i64,
    },
    /// The scene cannot be built.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A tick has another result here.
    #[error("tick {tick} has another {what} than on the earlier host")]
    Differs {
        /// The tick.
        tick: u64,
        /// `action`, `state` or `event`.
        what: &'static str,
    },
    /// The job failed.
    #[error(transparent)]
    Job(#[from] JobError),
}

impl ContinuedRun {
    /// Builds the world at its last stored tick, in the background. The recorder gets the whole past; it and `others` then see every
    /// tick.
    ///
    /// # Errors
    /// The run cannot be continued.
    pub(crate) async fn open(
        self,
        admitted: Admitted,
        background: &Background,
        recorder: Option<RecordingObserver>,
        mut others: Vec<Box<dyn RunObserver>>,
    ) -> Result<OpenedWorld, ContinueError> {
        let build = move || {
            let (sensing, mut recorder) = (self.header.sensing, recorder);
            let run = self.build(recorder.as_mut())?;
            if let Some(recorder) = recorder {
                others.push(Box::new(recorder));
            }
            Ok(World::of_run(run, sensing, others, admitted))
        };
        background.run(JobPriority::Awaited, build).await?
    }

    /// Builds the run at its last stored tick. It takes 0.1 to 0.4 ms for each tick after the snapshot.
    fn build(self, recorder: Option<&mut RecordingObserver>) -> Result<Run, ContinueError> {
        let ContinuedRun { header, task, hand, shipped } = self;
        check(&header, &task, &hand)?;
        let ticks = read(&shipped.ticks)?;
        let hand = header.hand_of_run(hand).map_err(|_| ContinueError::Other("ranges of the hand"))?;
        let mut run = Run::new(task, hand, header.seed)?.with_noise(header.noise);
        if let Some(recorder) = recorder {
            recorder.continued(&run, ticks.iter().cloned().map(LoggedTick::from));
        }
        skip_to_snapshot(&mut run, &ticks, shipped.snapshot.as_deref(), &header.run_id);
        play(&mut run, &ticks, |_| ())?;
        Ok(run)
    }

    /// Plays the whole run again for an observer, and ends it for this reason. The snapshot is not used.
    ///
    /// # Errors
    /// The run cannot be played again.
    pub(crate) fn play_again(
        self,
        observer: &mut impl RunObserver,
        reason: Reason,
    ) -> Result<Outcome, ContinueError> {
        let ContinuedRun { header, task, hand, shipped } = self;
        check(&header, &task, &hand)?;
        let ticks = read(&shipped.ticks)?;
        let hand = header.hand_of_run(hand).map_err(|_| ContinueError::Other("ranges of the hand"))?;
        let mut run = Run::new(task, hand, header.seed)?.with_noise(header.noise);
        observer.opened(&run);
        play(&mut run, &ticks, |run| observer.ticked(&Ticked::of(run)))?;
        let outcome = run.finish(reason);
        observer.finished(&run, &outcome);
        Ok(outcome)
    }
}

/// Plays the ticks after the present one, and compares each with the stored one.
fn play(run: &mut Run, ticks: &[ShippedTick], mut ticked: impl FnMut(&Run)) -> Result<(), ContinueError> {
    let from = usize::try_from(run.tick()).unwrap_or(usize::MAX);
    for (k, ShippedTick { action, state, events }) in ticks.iter().enumerate().skip(from) {
        let tick = k as u64 + 1;
        let differs = |what| ContinueError::Differs { tick, what };
        run.step(action).map_err(|_| differs("action"))?;
        if run.applied() != action {
            return Err(differs("action"));
        }
        if StateHash::of(run) != *state {
            return Err(differs("state"));
        }
        if run.events() != events.as_slice() {
            return Err(differs("event"));
        }
        ticked(run);
    }
    Ok(())
}

/// The header is of this engine, task and hand.
fn check(header: &Header, task: &Task, hand: &Hand) -> Result<(), ContinueError> {
    let parts = [
        ("engine", header.engine == identity::engine()),
        ("physics", header.physics_hash == identity::physics_hash(task)),
        ("task", header.task_hash == task.content_hash() && header.tick_s == task.tick_s),
        ("hand", header.hand_hash == hand.content_hash()),
    ];
    match parts.into_iter().find(|(_, same)| !same) {
        Some((what, _)) => Err(ContinueError::Other(what)),
        None => Ok(()),
    }
}

/// All ticks in order, from the first.
fn read(stored: &[StoredTicks]) -> Result<Vec<ShippedTick>, ContinueError> {
    let mut all = Vec::new();
    for StoredTicks { from_tick, ticks, body } in stored {
        let from = all.len() as u64;
        if u64::try_from(*from_tick) != Ok(from) {
            return Err(ContinueError::Missing { from, next: *from_tick });
        }
        let mut read = decode(body).map_err(|error| ContinueError::Unreadable { from, error })?;
        if i64::try_from(read.len()) != Ok(*ticks) {
            return Err(ContinueError::Count { from, found: read.len(), expected: *ticks });
        }
        all.append(&mut read);
    }
    Ok(all)
}

/// Restores the snapshot if it can be read and has the logged state of its tick. Otherwise the run stays at tick 0: the ticks are
/// the truth.
fn skip_to_snapshot(run: &mut Run, ticks: &[ShippedTick], snapshot: Option<&[u8]>, run_id: &str) {
    let Some(bytes) = snapshot else { return };
    let start = run.snapshot();
    let restored = Snapshot::from_bytes(bytes).map_err(|error| error.to_string()).and_then(|snapshot| {
        let logged = snapshot.tick().checked_sub(1).and_then(|k| ticks.get(usize::try_from(k).ok()?));
        let logged = logged.ok_or("it is of a tick that is not stored")?;
        run.restore(&snapshot).map_err(|error| error.to_string())?;
        if StateHash::of(run) != logged.state {
            return Err("its state is not the stored one".to_owned());
        }
        Ok(())
    });
    if let Err(error) = restored {
        tracing::warn!(
            error,
            run = run_id,
            "the snapshot is not used; the run is played again from its start"
        );
        // A snapshot of this run.
        let _ = run.restore(&start);
    }
}

#[cfg(test)]
mod tests;
