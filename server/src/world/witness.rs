//! Whoever wants to see every tick of a world: a recorder, spectators.

use palmares_tasks::observation::Wrench;
use palmares_tasks::{Fault, Outcome, Run};
use std::time::Duration;

/// Sees every tick of a world. It must not wait for anything: the world waits for it.
pub(crate) trait Witness: Send {
    /// The run is there, at tick 0.
    fn opened(&mut self, run: &Run);
    /// Before a tick of a realtime run, which begins so late.
    fn began(&mut self, late: Duration) {
        let _ = late;
    }
    /// After each tick.
    fn ticked(&mut self, run: &Run);
    /// The controller has been answered: the world may stand still from here on.
    fn rested(&mut self, run: &Run) {
        let _ = run;
    }
    /// Before the tick in which a push begins.
    fn pushed(&mut self, link: &str, wrench: Wrench, duration_s: f64) {
        let _ = (link, wrench, duration_s);
    }
    /// When the world has failed.
    fn failed(&mut self, fault: Fault) {
        let _ = fault;
    }
    /// When the run has been counted. Not called when the world failed.
    fn finished(&mut self, run: &Run, outcome: &Outcome);
}
