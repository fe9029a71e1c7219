//! Observers of a world's ticks: the recorder, the spectators' hub.

use palmares_replay::StateHash;
use palmares_tasks::observation::Wrench;
use palmares_tasks::{Fault, Outcome, Run};
use std::cell::OnceCell;
use std::time::Duration;

/// A run after a tick.
pub struct Ticked<'a> {
    /// The run.
    pub run: &'a Run,
    state: OnceCell<StateHash>,
}

impl<'a> Ticked<'a> {
    /// A run that has just made a tick.
    pub fn of(run: &'a Run) -> Self {
        Ticked { run, state: OnceCell::new() }
    }

    /// Digest of its state, computed for the first observer that needs it: 1.5 µs.
    pub fn state(&self) -> StateHash {
        *self.state.get_or_init(|| StateHash::of(self.run))
    }
}

/// Sees every tick of a world. It must not block: the world waits for it.
pub trait RunObserver: Send {
    /// The run is at tick 0, or at the tick at which another host continues it.
    fn opened(&mut self, run: &Run);
    /// Before a tick of a realtime run, with its delay.
    fn began(&mut self, late: Duration) {
        let _ = late;
    }
    /// After each tick.
    fn ticked(&mut self, tick: &Ticked<'_>);
    /// After the reply to a lockstep controller; the next step may come much later.
    fn rested(&mut self, run: &Run) {
        let _ = run;
    }
    /// Before the tick in which a push begins.
    fn pushed(&mut self, link: &str, wrench: Wrench, duration_s: f64) {
        let _ = (link, wrench, duration_s);
    }
    /// After the world has failed.
    fn failed(&mut self, fault: Fault) {
        let _ = fault;
    }
    /// After the run was scored. Not called when the world has failed.
    fn finished(&mut self, run: &Run, outcome: &Outcome);
}
