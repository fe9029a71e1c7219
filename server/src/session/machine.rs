//! What a session may do when: a pure state machine. No sockets, no clocks of its own, no world.

use super::clock::SessionClock;
use crate::protocol::reply::{RunInfo, RunResult};
use crate::protocol::{Code, Refusal};
use std::time::Duration;

/// Where a greeted session stands.
#[derive(Debug, Default)]
enum Phase {
    /// No run.
    #[default]
    Idle,
    /// A run is being played.
    Playing(Playing),
    /// The server closed the run: its result waits for `stop`.
    Closed(Box<RunResult>),
}

/// A run being played.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Playing {
    /// Identifies it.
    pub(crate) run_id: String,
    /// Its task.
    pub(crate) task: String,
    /// Its hand.
    pub(crate) hand: String,
    /// Length of a tick, s.
    pub(crate) tick_s: f64,
    /// The current tick.
    pub(crate) tick: u64,
}

/// The state of a session after its greeting.
#[derive(Debug)]
pub(crate) struct Machine {
    clock: SessionClock,
    phase: Phase,
}

impl Machine {
    /// A session without a run.
    pub(crate) fn new(limit_s: Option<f64>) -> Self {
        Machine { clock: SessionClock::new(limit_s), phase: Phase::Idle }
    }

    /// The session's clock.
    pub(crate) fn clock(&self) -> &SessionClock {
        &self.clock
    }

    /// The warning that is due, if any.
    pub(crate) fn warning(&mut self, now: Duration) -> Option<u32> {
        self.clock.warning(now)
    }

    /// The run being played.
    pub(crate) fn playing(&self) -> Option<&Playing> {
        match &self.phase {
            Phase::Playing(playing) => Some(playing),
            _ => None,
        }
    }

    /// The run as told to the client.
    pub(crate) fn run_info(&self) -> Option<RunInfo> {
        match &self.phase {
            Phase::Idle => None,
            Phase::Playing(run) => Some(RunInfo {
                run_id: run.run_id.clone(),
                task: run.task.clone(),
                hand: run.hand.clone(),
                tick: run.tick,
                open: true,
            }),
            Phase::Closed(result) => Some(RunInfo {
                run_id: result.run_id.clone(),
                task: result.task.clone(),
                hand: result.hand.clone(),
                tick: result.ticks,
                open: false,
            }),
        }
    }

    /// Whether a run may be opened now.
    pub(crate) fn may_reset(&self, now: Duration) -> Result<(), Refusal> {
        if let Phase::Playing(run) = &self.phase {
            let message = format!("run {} is open; stop it first", run.run_id);
            return Err(Refusal::new(Code::WrongState, message));
        }
        if self.clock.is_over(now) {
            return Err(Refusal::new(Code::SessionOver, "the session's time is spent"));
        }
        Ok(())
    }

    /// A run was opened: the clock starts with the first.
    pub(crate) fn opened(&mut self, run: Playing, now: Duration) {
        self.clock.start(now);
        self.phase = Phase::Playing(run);
    }

    /// How many ticks a step may take now: `repeat`, or what is left of the session.
    pub(crate) fn may_step(&self, now: Duration, tick: u64, repeat: u32, most: u32) -> Result<u32, Refusal> {
        let run = match &self.phase {
            Phase::Idle => return Err(Refusal::new(Code::WrongState, "no run is open; send reset first")),
            Phase::Closed(result) => {
                let (code, why) = if self.clock.is_over(now) {
                    (Code::SessionOver, "the session's time is spent")
                } else {
                    (Code::WrongState, "it is over")
                };
                let message = format!("run {} was closed: {why}; stop fetches its result", result.run_id);
                return Err(Refusal::new(code, message));
            }
            Phase::Playing(run) => run,
        };
        if tick != run.tick {
            let message = format!("tick {tick} is not the current tick {}", run.tick);
            return Err(Refusal::new(Code::StaleTick, message));
        }
        if !(1..=most).contains(&repeat) {
            let message = format!("repeat: expected a whole number from 1 to {most}, not {repeat}");
            return Err(Refusal::new(Code::BadRequest, message));
        }
        let left = self.clock.ticks_left(now, run.tick_s);
        if left == 0 {
            return Err(Refusal::new(Code::SessionOver, "the session's time is spent"));
        }
        Ok(u32::try_from(left).unwrap_or(u32::MAX).min(repeat))
    }

    /// The world has advanced to `tick`.
    pub(crate) fn stepped(&mut self, tick: u64) {
        if let Phase::Playing(run) = &mut self.phase {
            self.clock.simulate(tick.saturating_sub(run.tick) as f64 * run.tick_s);
            run.tick = tick;
        }
    }

    /// What `stop` finds.
    pub(crate) fn stop(&mut self) -> Result<Stopping, Refusal> {
        match std::mem::take(&mut self.phase) {
            Phase::Idle => Err(Refusal::new(Code::WrongState, "no run is open; send reset first")),
            Phase::Closed(result) => Ok(Stopping::Waiting(result)),
            playing @ Phase::Playing(_) => {
                self.phase = playing;
                Ok(Stopping::Open)
            }
        }
    }

    /// The run's result was handed to the client.
    pub(crate) fn finished(&mut self) {
        self.phase = Phase::Idle;
    }

    /// The server closed the run; its result waits for `stop`.
    pub(crate) fn closed(&mut self, result: RunResult) {
        self.phase = Phase::Closed(Box::new(result));
    }
}

/// What `stop` finds.
#[derive(Debug)]
pub(crate) enum Stopping {
    /// A run to finish.
    Open,
    /// A result that waited.
    Waiting(Box<RunResult>),
}

#[cfg(test)]
mod tests {
    use super::*;
    use palmares_tasks::{Outcome, Reason};

    const START: Duration = Duration::from_secs(5);

    fn run() -> Playing {
        Playing { run_id: "r".into(), task: "balls".into(), hand: "h".into(), tick_s: 0.01, tick: 0 }
    }

    fn result() -> RunResult {
        let outcome = Outcome {
            score: 1.0,
            in_goal: 1,
            outside: 0,
            reason: Reason::SessionOver,
            ticks: 3,
            sim_time_s: 0.03,
            events: vec![],
            state_hash: "0".repeat(16),
        };
        RunResult::new("r", "balls", "h", "practice", outcome)
    }

    fn code<T: std::fmt::Debug>(result: Result<T, Refusal>) -> Code {
        result.expect_err("must be refused").code
    }

    #[test]
    fn the_order_is_kept() {
        let mut machine = Machine::new(None);
        assert_eq!(code(machine.may_step(START, 0, 1, 10)), Code::WrongState);
        assert_eq!(code(machine.stop()), Code::WrongState);
        machine.may_reset(START).expect("idle");
        machine.opened(run(), START);
        assert_eq!(code(machine.may_reset(START)), Code::WrongState);
        assert_eq!(machine.may_step(START, 0, 3, 10), Ok(3));
        machine.stepped(3);
        assert_eq!(code(machine.may_step(START, 0, 1, 10)), Code::StaleTick);
        assert_eq!(code(machine.may_step(START, 3, 0, 10)), Code::BadRequest);
        assert_eq!(code(machine.may_step(START, 3, 11, 10)), Code::BadRequest);
        assert_eq!(machine.may_step(START, 3, 10, 10), Ok(10));
        assert!(matches!(machine.stop(), Ok(Stopping::Open)));
        assert!(machine.playing().is_some(), "a stop that fails later must find the run again");
        machine.finished();
        machine.may_reset(START).expect("idle again");
    }

    #[test]
    fn a_run_closed_by_the_server_keeps_its_result() {
        let mut machine = Machine::new(None);
        machine.opened(run(), START);
        machine.closed(result());
        assert_eq!(code(machine.may_step(START, 0, 1, 10)), Code::WrongState);
        assert_eq!(machine.run_info().map(|info| info.open), Some(false));
        assert!(matches!(machine.stop(), Ok(Stopping::Waiting(result)) if result.score == 1.0));
        assert_eq!(code(machine.stop()), Code::WrongState);
    }

    #[test]
    fn no_tick_beyond_the_sessions_end() {
        let mut machine = Machine::new(Some(1.0));
        machine.opened(run(), START);
        machine.stepped(95);
        assert_eq!(machine.may_step(START, 95, 10, 10), Ok(5));
        machine.stepped(100);
        assert_eq!(code(machine.may_step(START, 100, 1, 10)), Code::SessionOver);
        machine.closed(result());
        assert_eq!(code(machine.may_step(START, 100, 1, 10)), Code::SessionOver);
        assert_eq!(code(machine.may_reset(START)), Code::SessionOver);
        assert!(machine.stop().is_ok());
    }
}
