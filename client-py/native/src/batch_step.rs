//! A step of a batch. An exception of a signal handler can interrupt it between two ticks; then it goes on later.

use crate::base::Base;
use crate::interrupt::{LOOK, ProgressReport, report_progress};
use crate::slot::Slot;
use crate::workers::Workers;
use palmares_tasks::{Action, Sensing};
use pyo3::prelude::*;
use std::time::Instant;

/// A step that has begun.
pub(crate) struct BatchStep {
    /// The actions of all worlds, one after the other, each of this length.
    pub(crate) actions: Vec<f64>,
    pub(crate) width: usize,
    pub(crate) ticks: u32,
    /// Ticks that are missing.
    pub(crate) left: u32,
    /// The worlds that move.
    pub(crate) mask: Vec<bool>,
}

/// The settings of the batch.
pub(crate) struct How {
    pub(crate) motors: usize,
    pub(crate) base: Base,
    pub(crate) sensing: Sensing,
    pub(crate) objects: usize,
}

impl BatchStep {
    pub(crate) fn misses_ticks(&self) -> bool {
        self.left > 0
    }

    /// A world does not move any more in this step.
    pub(crate) fn drop_world(&mut self, world: usize) {
        if let Some(moving) = self.mask.get_mut(world) {
            *moving = false;
        }
    }

    /// Makes the missing ticks. Calls `report` with the number of ticks done.
    pub(crate) fn go_on(
        &mut self,
        py: Python<'_>,
        slots: &mut [Slot],
        workers: &Workers,
        how: &How,
        report: &ProgressReport<'_>,
    ) -> PyResult<()> {
        let (count, &How { motors, base, sensing, objects }) = (slots.len(), how);
        let mut moving: Vec<(&mut Slot, Action)> = slots
            .iter_mut()
            .zip(self.actions.chunks(self.width))
            .zip(&self.mask)
            .filter(|(_, chosen)| **chosen)
            .map(|((slot, numbers), _)| (slot, action(numbers, motors, base)))
            .collect();
        // Small portions, so that Ctrl-C does not wait long.
        let portion = (500 * workers.count() / count).clamp(1, 10) as u32;
        let (mut left, mut interrupted) = (self.left, Ok(()));
        while left > 0 && interrupted.is_ok() {
            py.detach(|| {
                let begun = Instant::now();
                while left > 0 && begun.elapsed() < LOOK {
                    let some = left.min(portion);
                    left -= some;
                    workers.each(&mut moving, |(slot, action)| {
                        slot.advance(action, some, sensing);
                        if left == 0 {
                            slot.end(sensing, objects);
                        }
                    });
                }
            });
            interrupted =
                py.check_signals().and_then(|()| report_progress(report, u64::from(self.ticks - left)));
            if left > 0 && moving.iter().all(|(slot, _)| slot.is_over()) {
                left = 0;
                py.detach(|| workers.each(&mut moving, |(slot, _)| slot.end(sensing, objects)));
            }
        }
        if left > 0 {
            py.detach(|| workers.each(&mut moving, |(slot, _)| slot.look(sensing, objects)));
        }
        self.left = left;
        interrupted
    }
}

/// The action of a row: the base, σ of every motor and, in a longer row, the effort of every motor.
fn action(numbers: &[f64], motors: usize, base: Base) -> Action {
    let (sigma, effort) = numbers[base.len()..].split_at(motors);
    Action {
        base: Some(base.target(numbers)),
        hand: Some(sigma.to_vec()),
        effort: (!effort.is_empty()).then(|| effort.to_vec()),
    }
}
