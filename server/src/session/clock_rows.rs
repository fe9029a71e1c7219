//! Clocks as rows of the database.

use crate::clock::{ClockState, Spent};
use crate::store::ClockRow;

/// A clock as stored; with `in_run` it is the one before the open run.
pub(super) fn saved_row(state: ClockState, in_run: bool) -> ClockRow {
    ClockRow { run_from_s: in_run.then(|| state.spent.counts_s()), ..state.row() }
}

impl ClockState {
    /// As stored.
    pub(super) fn row(self) -> ClockRow {
        ClockRow {
            started: self.started,
            wall_s: self.spent.wall_s,
            simulated_s: self.spent.simulated_s,
            refunded_s: self.refunded_s,
            run_from_s: None,
        }
    }

    /// From its row.
    pub(super) fn of(row: &ClockRow) -> Self {
        let spent = Spent { wall_s: row.wall_s, simulated_s: row.simulated_s };
        ClockState { started: row.started, spent, refunded_s: row.refunded_s }
    }
}
