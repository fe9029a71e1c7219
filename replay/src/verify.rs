//! Simulates a replay again.

use crate::format::HASH_EVERY;
use crate::hands::hand;
use crate::header::Header;
use crate::messages::StateHash;
use crate::reader::{RecordedTick, Replay};
use crate::verify_error::VerifyError;
use palmares_tasks::identity;
use palmares_tasks::{Event, Outcome, Run, Task};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

/// The result of a successful verification: the simulation gave the recorded states and score.
#[derive(Clone, Debug, PartialEq)]
pub struct Verified {
    /// Ticks simulated.
    pub ticks: u64,
    /// States compared, the last one included.
    pub states: usize,
    /// Points.
    pub score: f64,
}

/// Simulates a replay from tick 0 and compares every state, event and count. `own`: tasks that are not built in.
pub fn verify(replay: &Replay, own: &[Arc<Task>]) -> Result<Verified, VerifyError> {
    verify_watched(replay, own, None)
}

/// As [`verify()`]; also calls `observe` with the run at tick 0 and after every tick, with the recorded sensor noise.
pub fn verify_watched(
    replay: &Replay,
    own: &[Arc<Task>],
    observe: Option<&mut dyn FnMut(&mut Run)>,
) -> Result<Verified, VerifyError> {
    // A hand of an untrusted file may make the simulation panic.
    catch_unwind(AssertUnwindSafe(|| simulate(replay, own, observe))).unwrap_or_else(|_| {
        Err(VerifyError::StateDiffers {
            tick: 0,
            last_equal: None,
            found: "a failure of the simulation".into(),
            recorded: "a run".into(),
        })
    })
}

fn simulate(
    replay: &Replay,
    own: &[Arc<Task>],
    observe: Option<&mut dyn FnMut(&mut Run)>,
) -> Result<Verified, VerifyError> {
    let header = &replay.header;
    let engine = identity::engine();
    if header.engine != engine {
        return Err(VerifyError::OtherEngine(format!(
            "recorded by engine {}, this is {engine}; use the program of version {} ({})",
            header.engine, header.server_version, header.build_hash
        )));
    }
    let task = task(header, own)?;
    if identity::physics_hash(&task) != header.physics_hash {
        return Err(VerifyError::OtherPhysics("the constants of the physics differ here".into()));
    }
    let longest = (task.time_limit_s / task.tick_s).ceil() as usize;
    if replay.actions.len() > longest {
        let ticks = replay.actions.len();
        return Err(VerifyError::ScoreDiffers(format!("it has {ticks} ticks; the task allows {longest}")));
    }
    let hand = header.hand_of_run(hand(header, replay.hand_files.as_deref())?)?;
    let run = Run::new(task, hand, header.seed);
    let run = run.map_err(|error| VerifyError::StateDiffers {
        tick: 0,
        last_equal: None,
        found: error.to_string(),
        recorded: "a scene".into(),
    })?;
    let run = if observe.is_some() { run.with_noise(header.noise) } else { run };
    Simulation { run, observe, last_equal: None, states: 0, hashes: replay.hashes.iter() }.play(replay)
}

/// The task of a replay, among `own` and the built-in tasks.
fn task(header: &Header, own: &[Arc<Task>]) -> Result<Arc<Task>, VerifyError> {
    let known = own.iter().cloned().chain(Task::builtin());
    let named: Vec<Arc<Task>> = known.filter(|task| task.name == header.task).collect();
    let same = |task: &&Arc<Task>| task.content_hash() == header.task_hash && task.tick_s == header.tick_s;
    match (named.iter().find(same), named.first()) {
        (Some(task), _) => Ok(task.clone()),
        (None, Some(other)) => Err(VerifyError::OtherTask(format!(
            "the task `{}` is another one here: its hash is {}, recorded was {}",
            header.task,
            other.content_hash(),
            header.task_hash
        ))),
        (None, None) => Err(VerifyError::OtherTask(format!(
            "neither the program nor a folder given with --task has a task `{}`",
            header.task
        ))),
    }
}

struct Simulation<'a, 'l> {
    run: Run,
    observe: Option<&'l mut (dyn FnMut(&mut Run) + 'l)>,
    last_equal: Option<u64>,
    states: usize,
    hashes: std::slice::Iter<'a, (u64, StateHash)>,
}

impl Simulation<'_, '_> {
    fn play(mut self, replay: &Replay) -> Result<Verified, VerifyError> {
        self.compare(None)?;
        self.observe();
        let mut events: Vec<Event> = Vec::new();
        for RecordedTick { action, state, pushes } in &replay.actions {
            let tick = self.run.tick();
            let bad = |error: &dyn ToString| {
                VerifyError::ChainBroken(format!("the action of tick {tick}: {}", error.to_string()))
            };
            for push in pushes {
                self.run.push(&push.link, push.wrench, push.duration_s).map_err(|error| bad(&error))?;
            }
            self.run.step(action).map_err(|error| bad(&error))?;
            if self.run.applied() != action {
                let message = format!("the action of tick {tick} is not one that can have been applied");
                return Err(VerifyError::ChainBroken(message));
            }
            events.extend_from_slice(self.run.events());
            self.compare(*state)?;
            self.observe();
        }
        if events != replay.events {
            return Err(VerifyError::ScoreDiffers(difference(&events, &replay.events)));
        }
        let ticks = self.run.tick();
        let mut outcome = self.run.finish(replay.outcome.reason);
        if replay.outcome.fault.is_none() {
            // Earlier files have no fault.
            outcome.fault = None;
        }
        self.equal(&outcome.state_hash, &replay.outcome.state_hash)?;
        self.states += 1;
        if outcome != replay.outcome {
            return Err(VerifyError::ScoreDiffers(describe(&outcome, &replay.outcome)));
        }
        Ok(Verified { ticks, states: self.states, score: outcome.score })
    }

    fn observe(&mut self) {
        if let Some(observe) = &mut self.observe {
            observe(&mut self.run);
        }
    }

    /// Compares the present state with the recorded digests: `of_action`, that of the action, and that of the hash
    /// message, if any.
    fn compare(&mut self, of_action: Option<StateHash>) -> Result<(), VerifyError> {
        let tick = self.run.tick();
        let of_message = match self.hashes.as_slice().first() {
            Some((at, recorded)) if *at == tick => {
                self.hashes.next();
                Some(*recorded)
            }
            _ if tick.is_multiple_of(HASH_EVERY) => {
                return Err(VerifyError::ChainBroken(format!("there is no hash of tick {tick}")));
            }
            _ => None,
        };
        if of_action.is_none() && of_message.is_none() {
            return Ok(());
        }
        let found = StateHash::of(&self.run);
        for recorded in [of_action, of_message].into_iter().flatten() {
            if recorded != found {
                return self.equal(&found.to_string(), &recorded.to_string());
            }
        }
        self.last_equal = Some(tick);
        self.states += 1;
        Ok(())
    }

    /// Compares the present state with a recorded one.
    fn equal(&self, found: &str, recorded: &str) -> Result<(), VerifyError> {
        if found == recorded {
            return Ok(());
        }
        let (tick, last_equal) = (self.run.tick(), self.last_equal);
        Err(VerifyError::StateDiffers { tick, last_equal, found: found.into(), recorded: recorded.into() })
    }
}

fn difference(found: &[Event], recorded: &[Event]) -> String {
    let at = found.iter().zip(recorded).take_while(|(a, b)| a == b).count();
    let text =
        |event: Option<&Event>| event.map_or("none".into(), |e| format!("{} at tick {}", e.kind, e.tick));
    format!("event {at} is {}, recorded was {}", text(found.get(at)), text(recorded.get(at)))
}

fn describe(found: &Outcome, recorded: &Outcome) -> String {
    let text = |o: &Outcome| {
        format!(
            "score {}, {} in the goal, {} outside, {} ticks, {} events",
            o.score,
            o.in_goal,
            o.outside,
            o.ticks,
            o.events.len()
        )
    };
    format!("the run comes to {}; recorded was {}", text(found), text(recorded))
}
