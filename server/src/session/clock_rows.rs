//! Clocks as rows of the database.

use palmares_store::ClockRow;
use palmares_worlds::clock::{ClockState, Spent};

/// A clock as stored; with `in_run` it is the one before the open run.
pub(super) fn saved_row(state: ClockState, in_run: bool) -> ClockRow {
    ClockRow { run_from_s: in_run.then(|| state.spent.counts_s()), ..row(state) }
}

/// A clock as stored.
pub(super) fn row(state: ClockState) -> ClockRow {
    ClockRow {
        started: state.started,
        wall_s: state.spent.wall_s,
        simulated_s: state.spent.simulated_s,
        refunded_s: state.refunded_s,
        run_from_s: None,
    }
}

/// A clock from its row.
pub(super) fn state(row: &ClockRow) -> ClockState {
    let spent = Spent { wall_s: row.wall_s, simulated_s: row.simulated_s };
    ClockState { started: row.started, spent, refunded_s: row.refunded_s }
}
