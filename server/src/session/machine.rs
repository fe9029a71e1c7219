//! What a session may do when: a pure state machine. No sockets, no clocks of its own, no world.

use crate::clock::{ClockState, SessionClock, Spent};
use palmares_protocol::reply::{RunInfo, RunResult};
use palmares_protocol::{Code, Mode, Refusal};
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
    /// What the task is: its content's hash.
    pub(crate) task_hash: String,
    /// Its hand.
    pub(crate) hand: String,
    /// SHA-256 of the hand's archive, when the team sent it in.
    pub(crate) hand_sha256: Option<String>,
    /// The number behind its seed, in practice.
    pub(crate) seed: Option<u64>,
    /// The number of the run among the team's in this task, in an official session.
    pub(crate) k: Option<u64>,
    /// Length of a tick, s.
    pub(crate) tick_s: f64,
    /// How time passes.
    pub(crate) mode: Mode,
    /// The current tick.
    pub(crate) tick: u64,
}

impl Playing {
    /// As told to the client.
    pub(crate) fn info(&self) -> RunInfo {
        RunInfo {
            run_id: self.run_id.clone(),
            task: self.task.clone(),
            hand: self.hand.clone(),
            mode: self.mode,
            tick: self.tick,
            open: true,
        }
    }
}

/// The state of a session after its greeting.
#[derive(Debug)]
pub(crate) struct Machine {
    clock: SessionClock,
    phase: Phase,
    /// How the clock stood when the open run began, before what its reset cost.
    from: ClockState,
    /// What a reset takes from the session, s.
    reset_cost_s: f64,
}

impl Machine {
    /// A session without a run.
    pub(crate) fn new(limit_s: Option<f64>) -> Self {
        Self::with(SessionClock::new(limit_s))
    }

    /// A session that an earlier process left, as it was saved. A run that was open then never happened.
    pub(crate) fn restored(limit_s: Option<f64>, state: &ClockState, paused: bool, now: Duration) -> Self {
        Self::with(SessionClock::restored(limit_s, state, paused, now))
    }

    fn with(clock: SessionClock) -> Self {
        Machine { clock, phase: Phase::Idle, from: ClockState::default(), reset_cost_s: 0.0 }
    }

    /// The same, where each reset takes so much from the session, s.
    pub(crate) fn with_reset_cost(self, reset_cost_s: f64) -> Self {
        Machine { reset_cost_s, ..self }
    }

    /// What a later process goes on from: while a run is open, the clock as it stood before the run.
    pub(crate) fn saved(&self, now: Duration) -> ClockState {
        if self.playing().is_some() { self.from } else { self.clock.state(now) }
    }

    /// An organizer stops the clock.
    pub(crate) fn pause(&mut self, now: Duration) {
        self.clock.pause(now);
    }

    /// An organizer lets it go on.
    pub(crate) fn resume(&mut self, now: Duration) {
        self.clock.resume(now);
    }

    /// An organizer gives the session more time.
    pub(crate) fn grant(&mut self, seconds: f64, now: Duration) {
        self.clock.grant(seconds, now);
    }

    /// The session's clock.
    pub(crate) fn clock(&self) -> &SessionClock {
        &self.clock
    }

    /// The warning that is due, if any.
    pub(crate) fn warning(&mut self, now: Duration) -> Option<u32> {
        self.clock.warning(now)
    }

    /// When something is due if nothing is asked until then: a warning, the end. A run that the end has overtaken
    /// is due at once: whoever looks only now must not miss it.
    pub(crate) fn next_change(&self, now: Duration) -> Option<Duration> {
        let overdue = self.playing().is_some() && self.clock.is_over(now);
        if overdue { Some(Duration::ZERO) } else { self.clock.next_change(now) }
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
            Phase::Playing(run) => Some(run.info()),
            Phase::Closed(result) => Some(RunInfo {
                run_id: result.run_id.clone(),
                task: result.task.clone(),
                hand: result.hand.clone(),
                mode: result.mode,
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
        self.in_time(now)?;
        if let Some(left_s) = self.clock.left_s(now)
            && left_s <= self.reset_cost_s
        {
            let message =
                format!("a reset costs {} s of the session, and {left_s:.1} s are left", self.reset_cost_s);
            return Err(Refusal::new(Code::SessionOver, message));
        }
        self.not_paused()
    }

    fn in_time(&self, now: Duration) -> Result<(), Refusal> {
        if self.clock.is_over(now) {
            return Err(Refusal::new(Code::SessionOver, "the session's time is spent"));
        }
        Ok(())
    }

    fn not_paused(&self) -> Result<(), Refusal> {
        if self.clock.is_paused() {
            let message = "an organizer has paused the session; its clock stands still until it goes on";
            return Err(Refusal::new(Code::WrongState, message).retry_after(1.0));
        }
        Ok(())
    }

    /// A run was opened: the clock starts with the first, and each costs what a reset costs.
    pub(crate) fn opened(&mut self, run: Playing, now: Duration) {
        self.clock.start(now);
        self.from = self.clock.state(now);
        self.clock.charge(self.reset_cost_s, now);
        self.phase = Phase::Playing(run);
    }

    /// The open run, if it is of this kind and the session's time is not spent.
    fn playing_in(&self, mode: Mode, now: Duration) -> Result<&Playing, Refusal> {
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
        if run.mode != mode {
            let message = match run.mode {
                Mode::Lockstep => "this run waits for `step`; `act` is for runs in mode `realtime`",
                Mode::Realtime => "this run follows the clock; send `act`; `step` is for mode `lockstep`",
            };
            return Err(Refusal::new(Code::WrongState, message));
        }
        Ok(run)
    }

    /// Whether a realtime run takes actions now. In a pause it does: they are for the time after.
    pub(crate) fn may_act(&self, now: Duration) -> Result<(), Refusal> {
        self.playing_in(Mode::Realtime, now)?;
        self.in_time(now)
    }

    /// Whether there is a run to push in.
    pub(crate) fn may_perturb(&self, now: Duration) -> Result<(), Refusal> {
        let mode = self.playing().map_or(Mode::Lockstep, |run| run.mode);
        self.playing_in(mode, now)?;
        self.in_time(now)
    }

    /// How many ticks a step may take now: `repeat`, or what is left of the session.
    pub(crate) fn may_step(&self, now: Duration, tick: u64, repeat: u32, most: u32) -> Result<u32, Refusal> {
        let run = self.playing_in(Mode::Lockstep, now)?;
        if tick != run.tick {
            let message = format!("tick {tick} is not the current tick {}", run.tick);
            return Err(Refusal::new(Code::StaleTick, message));
        }
        if !(1..=most).contains(&repeat) {
            let message = format!("repeat: expected a whole number from 1 to {most}, not {repeat}");
            return Err(Refusal::new(Code::BadRequest, message));
        }
        self.in_time(now)?;
        self.not_paused()?;
        let left = self.clock.ticks_left(now, run.tick_s);
        Ok(u32::try_from(left).unwrap_or(u32::MAX).min(repeat))
    }

    /// The world has advanced to `tick`.
    pub(crate) fn stepped(&mut self, tick: u64, now: Duration) {
        if let Phase::Playing(run) = &mut self.phase {
            let ticks = tick.saturating_sub(run.tick);
            run.tick = tick;
            self.clock.simulate(ticks as f64 * run.tick_s, now);
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

    /// What the open run has taken from the session's clock.
    pub(crate) fn taken(&self, now: Duration) -> Spent {
        self.clock.spent(now).since(self.from.spent)
    }

    /// The clock as it is if the open run ends now. `refund`: its time is given back.
    pub(crate) fn after(&self, now: Duration, refund: bool) -> ClockState {
        let mut clock = self.clock.clone();
        if refund {
            clock.refund(self.taken(now), now);
        }
        clock.state(now)
    }

    /// The open run has ended. `refund`: its time is given back.
    pub(crate) fn ended(&mut self, now: Duration, refund: bool) {
        let Phase::Playing(_) = std::mem::take(&mut self.phase) else { return };
        if refund {
            self.clock.refund(self.taken(now), now);
        }
    }

    /// Gives back what passed since the clock stood like this: the server could not do what was asked.
    pub(crate) fn forgive(&mut self, since: Spent, now: Duration) {
        let lost = self.clock.spent(now).since(since);
        self.clock.refund(lost, now);
    }

    /// Gives back what a run has taken that ended before and is void now. That it happens once is the caller's care.
    pub(crate) fn give_back(&mut self, taken: Spent, now: Duration) {
        let before_s = self.clock.refunded_s();
        self.clock.refund(taken, now);
        // The open run began that much earlier.
        self.from.spent = self.from.spent.since(taken);
        self.from.refunded_s += self.clock.refunded_s() - before_s;
    }

    /// The server closed the run that has ended; its result waits for `stop`.
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
mod tests;
