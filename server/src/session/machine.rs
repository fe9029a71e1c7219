//! Which requests a session accepts in which state: a pure state machine without sockets, worlds or a clock of its own.

use palmares_protocol::reply::{RunInfo, RunResult};
use palmares_protocol::{Code, Mode, Refusal};
use palmares_worlds::clock::{ClockState, SessionClock, Spent};
use std::time::Duration;

/// The state of a session's run.
#[derive(Debug, Default)]
enum RunState {
    /// No run.
    #[default]
    Idle,
    /// A run is being played.
    Playing(Playing),
    /// The server has closed the run: its result waits for `stop`.
    Closed(Box<RunResult>),
}

/// A run being played.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Playing {
    /// Its id.
    pub(crate) run_id: String,
    /// Its task.
    pub(crate) task: String,
    /// Hash of the task's content.
    pub(crate) task_hash: String,
    /// Its hand.
    pub(crate) hand: String,
    /// SHA-256 of the hand's archive, if the team uploaded it.
    pub(crate) hand_sha256: Option<String>,
    /// The number behind its seed, in practice.
    pub(crate) seed: Option<u64>,
    /// Number of the run among the team's runs of this task, in an official session.
    pub(crate) k: Option<u64>,
    /// Length of a tick, s.
    pub(crate) tick_s: f64,
    /// Lockstep or realtime.
    pub(crate) mode: Mode,
    /// The current tick.
    pub(crate) tick: u64,
}

impl Playing {
    /// The run as it is sent to the client.
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
    run: RunState,
    /// The clock when the open run began, before the cost of its reset.
    clock_before_run: ClockState,
    /// Cost of a reset, s.
    reset_cost_s: f64,
}

impl Machine {
    /// A session without a run.
    pub(crate) fn new(limit_s: Option<f64>) -> Self {
        Self::with(SessionClock::new(limit_s))
    }

    /// A session of an earlier process, as it was saved. A run that was open then does not count.
    pub(crate) fn restored(limit_s: Option<f64>, state: &ClockState, paused: bool, now: Duration) -> Self {
        Self::with(SessionClock::restored(limit_s, state, paused, now))
    }

    /// A session of another host with its open run, as at the run's last stored tick. The clock stops.
    pub(crate) fn continued(
        limit_s: Option<f64>,
        before_run: ClockState,
        in_run: &ClockState,
        run: Playing,
        now: Duration,
    ) -> Self {
        let machine = Self::with(SessionClock::restored(limit_s, in_run, true, now));
        Machine { run: RunState::Playing(run), clock_before_run: before_run, ..machine }
    }

    fn with(clock: SessionClock) -> Self {
        Machine { clock, run: RunState::Idle, clock_before_run: ClockState::default(), reset_cost_s: 0.0 }
    }

    /// Sets the cost of a reset, s.
    pub(crate) fn with_reset_cost(self, reset_cost_s: f64) -> Self {
        Machine { reset_cost_s, ..self }
    }

    /// The clock from which a later process continues: while a run is open, the clock before that run.
    pub(crate) fn saved(&self, now: Duration) -> ClockState {
        self.before_run().unwrap_or_else(|| self.clock.state(now))
    }

    /// The clock before the open run, without the cost of its reset.
    pub(crate) fn before_run(&self) -> Option<ClockState> {
        self.playing().map(|_| self.clock_before_run)
    }

    /// An organizer stops the clock.
    pub(crate) fn pause(&mut self, now: Duration) {
        self.clock.pause(now);
    }

    /// An organizer continues the clock.
    pub(crate) fn resume(&mut self, now: Duration) {
        self.clock.resume(now);
    }

    /// An organizer stops or continues the clocks of all sessions.
    pub(crate) fn set_competition_paused(&mut self, paused: bool, now: Duration) {
        self.clock.set_competition_paused(paused, now);
    }

    /// Starts the clock before the first run.
    pub(crate) fn start(&mut self, now: Duration) {
        self.clock.start(now);
    }

    /// Stops the clock until this moment: the session waits for a place. The present moment lets it run.
    pub(crate) fn hold(&mut self, until: Duration, now: Duration) {
        self.clock.hold(until, now);
    }

    /// An organizer gives the session more time, or takes some of it back.
    pub(crate) fn grant(&mut self, seconds: f64, now: Duration) {
        self.clock.grant(seconds, now);
    }

    /// The session becomes shorter.
    pub(crate) fn shorten(&mut self, limit_s: f64, now: Duration) {
        self.clock.shorten(limit_s, now);
    }

    /// The session's clock.
    pub(crate) fn clock(&self) -> &SessionClock {
        &self.clock
    }

    /// The warning that is due, if any.
    pub(crate) fn warning(&mut self, now: Duration) -> Option<u32> {
        self.clock.warning(now)
    }

    /// Time until the next warning or the end, if no request comes until then. Zero while a run is open after the end.
    pub(crate) fn next_change(&self, now: Duration) -> Option<Duration> {
        let overdue = self.playing().is_some() && self.clock.is_over(now);
        if overdue { Some(Duration::ZERO) } else { self.clock.next_change(now) }
    }

    /// The run being played.
    pub(crate) fn playing(&self) -> Option<&Playing> {
        match &self.run {
            RunState::Playing(playing) => Some(playing),
            _ => None,
        }
    }

    /// The run as it is sent to the client.
    pub(crate) fn run_info(&self) -> Option<RunInfo> {
        match &self.run {
            RunState::Idle => None,
            RunState::Playing(run) => Some(run.info()),
            RunState::Closed(result) => Some(RunInfo {
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
        if let RunState::Playing(run) = &self.run {
            let message = format!("run {} is open; stop it first", run.run_id);
            return Err(Refusal::new(Code::WrongState, message));
        }
        self.in_time(now)?;
        if let Some(left_s) = self.clock.left_s(now)
            && left_s <= self.reset_cost_s
        {
            let message = format!("a reset needs more than {} s; {left_s:.1} s are left", self.reset_cost_s);
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
            let message = if self.clock.is_competition_paused() {
                "the organizers have paused the competition; all clocks are stopped"
            } else {
                "an organizer has paused the session; its clock is stopped"
            };
            return Err(Refusal::new(Code::WrongState, message).retry_after(1.0));
        }
        Ok(())
    }

    /// A run was opened: the first one starts the clock, and each costs a reset.
    pub(crate) fn opened(&mut self, run: Playing, now: Duration) {
        self.clock.start(now);
        self.clock_before_run = self.clock.state(now);
        self.clock.charge(self.reset_cost_s, now);
        self.run = RunState::Playing(run);
    }

    /// The open run, if it has this pacing.
    fn playing_in(&self, mode: Mode, now: Duration) -> Result<&Playing, Refusal> {
        let run = match &self.run {
            RunState::Idle => return Err(Refusal::new(Code::WrongState, "no run is open; send reset first")),
            RunState::Closed(result) => {
                let (code, why) = if self.clock.is_over(now) {
                    (Code::SessionOver, "the session's time is spent")
                } else {
                    (Code::WrongState, "it is over")
                };
                let message = format!("run {} was closed: {why}; stop returns its result", result.run_id);
                return Err(Refusal::new(code, message));
            }
            RunState::Playing(run) => run,
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

    /// Whether a realtime run accepts actions now. In a pause it does, for the time afterwards.
    pub(crate) fn may_act(&self, now: Duration) -> Result<(), Refusal> {
        self.playing_in(Mode::Realtime, now)?;
        self.in_time(now)
    }

    /// Whether a run is open in which the hand can be pushed.
    pub(crate) fn may_perturb(&self, now: Duration) -> Result<(), Refusal> {
        let mode = self.playing().map_or(Mode::Lockstep, |run| run.mode);
        self.playing_in(mode, now)?;
        self.in_time(now)
    }

    /// Number of ticks that a step may take now: `repeat`, or the rest of the session.
    pub(crate) fn may_step(&self, now: Duration, tick: u64, repeat: u32, max: u32) -> Result<u32, Refusal> {
        let run = self.playing_in(Mode::Lockstep, now)?;
        if tick != run.tick {
            let message = format!("tick {tick} is not the current tick {}", run.tick);
            return Err(Refusal::new(Code::StaleTick, message));
        }
        if !(1..=max).contains(&repeat) {
            let message = format!("repeat: expected a whole number from 1 to {max}, not {repeat}");
            return Err(Refusal::new(Code::BadRequest, message));
        }
        self.in_time(now)?;
        self.not_paused()?;
        let left = self.clock.ticks_left(now, run.tick_s);
        Ok(u32::try_from(left).unwrap_or(u32::MAX).min(repeat))
    }

    /// The world has advanced to `tick`.
    pub(crate) fn stepped(&mut self, tick: u64, now: Duration) {
        if let RunState::Playing(run) = &mut self.run {
            let ticks = tick.saturating_sub(run.tick);
            run.tick = tick;
            self.clock.simulate(ticks as f64 * run.tick_s, now);
        }
    }

    /// Refunds time for which the open run stood until its ticks were stored.
    pub(crate) fn stood(&mut self, time: Duration, now: Duration) {
        if !time.is_zero() {
            self.clock.refund(Spent { wall_s: time.as_secs_f64(), simulated_s: 0.0 }, now);
        }
    }

    /// The run that a `stop` ends.
    pub(crate) fn stop(&mut self) -> Result<Stopping, Refusal> {
        match std::mem::take(&mut self.run) {
            RunState::Idle => Err(Refusal::new(Code::WrongState, "no run is open; send reset first")),
            RunState::Closed(result) => Ok(Stopping::Waiting(result)),
            playing @ RunState::Playing(_) => {
                self.run = playing;
                Ok(Stopping::Open)
            }
        }
    }

    /// Time that the open run has spent.
    pub(crate) fn run_cost(&self, now: Duration) -> Spent {
        self.clock.spent(now).since(self.clock_before_run.spent)
    }

    /// The clock after the end of the open run now; with `refund` the run's time is given back.
    pub(crate) fn after(&self, now: Duration, refund: bool) -> ClockState {
        let mut clock = self.clock.clone();
        if refund {
            clock.refund(self.run_cost(now), now);
        }
        clock.state(now)
    }

    /// The open run has ended; with `refund` its time is given back.
    pub(crate) fn ended(&mut self, now: Duration, refund: bool) {
        let RunState::Playing(_) = std::mem::take(&mut self.run) else { return };
        if refund {
            self.clock.refund(self.run_cost(now), now);
        }
    }

    /// Refunds the time since `since`: the server could not carry out a request.
    pub(crate) fn refund_since(&mut self, since: Spent, now: Duration) {
        let lost = self.clock.spent(now).since(since);
        self.clock.refund(lost, now);
    }

    /// Refunds the cost of an ended run that is void now. The caller makes sure that it happens once.
    pub(crate) fn refund_run(&mut self, cost: Spent, now: Duration) {
        let before_s = self.clock.refunded_s();
        self.clock.refund(cost, now);
        // The open run now began that much earlier.
        self.clock_before_run.spent = self.clock_before_run.spent.since(cost);
        self.clock_before_run.refunded_s += self.clock.refunded_s() - before_s;
    }

    /// Takes the cost of a run again that was refunded and counts now.
    ///
    /// # Errors
    /// So much time is not left: the missing time, s. Nothing changes.
    pub(crate) fn take_again(&mut self, cost: Spent, now: Duration) -> Result<(), f64> {
        let before_s = self.clock.refunded_s();
        self.clock.take_again(cost, now)?;
        // The open run now began that much later.
        let began = &mut self.clock_before_run;
        began.spent.wall_s += cost.wall_s;
        began.spent.simulated_s += cost.simulated_s;
        began.refunded_s += self.clock.refunded_s() - before_s;
        Ok(())
    }

    /// The server has closed the run; its result waits for `stop`.
    pub(crate) fn closed(&mut self, result: RunResult) {
        self.run = RunState::Closed(Box::new(result));
    }
}

/// The run that a `stop` ends.
#[derive(Debug)]
pub(crate) enum Stopping {
    /// An open run, to be finished.
    Open,
    /// The result of a run that the server has closed.
    Waiting(Box<RunResult>),
}

#[cfg(test)]
mod tests;
