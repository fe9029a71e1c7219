//! The database: teams, tokens, sessions, runs, hands, audit; and the files beside it.
//!
//! One set of queries serves SQLite and Postgres: `$1` works in both; flags are 0 or 1, since SQLite has no booleans.
//!
//! A statement that writes and returns rows is read to its end, with `fetch_all`, unless a transaction contains it: SQLite commits it at
//! the end only, and the driver hides a failure there from `fetch_one`.

/// Implements reading a struct from a row: each field from the column of its name, or of the name after the colon. Fields after `row`
/// are computed.
macro_rules! from_row {
    ($name:ident { $($field:ident $(: $column:literal)?),* $(; $row:ident => $($other:ident: $value:expr),*)? }) => {
        impl sqlx::FromRow<'_, sqlx::any::AnyRow> for $name {
            fn from_row(row: &sqlx::any::AnyRow) -> Result<Self, sqlx::Error> {
                use sqlx::Row;
                $(let $row = row;)?
                Ok($name { $($field: row.try_get(from_row!(@column $field $($column)?))?,)* $($($other: $value,)*)? })
            }
        }
    };
    (@column $field:ident) => { stringify!($field) };
    (@column $field:ident $column:literal) => { $column };
}

mod announcements;
mod audit;
mod clocks;
mod competition;
mod database;
mod dump;
mod error;
pub mod files;
mod hands;
mod host;
mod hosts;
mod leaderboard;
mod listed_runs;
mod lists;
mod location;
pub mod names;
mod number;
mod open_runs;
mod run_actions;
mod runs;
mod schedule;
mod sessions;
mod settings;
mod similar_runs;
mod teams;
mod tokens;
mod transaction;
mod unvoid;
mod verification;
mod writing;

pub use announcements::Announcement;
pub use audit::{AuditEntry, NewAuditEntry};
pub use clocks::{ClockRow, RefundedClock, RunCost, SavedClock};
pub use competition::{CompetitionChange, CompetitionPhase, CompetitionState};
pub use database::Store;
pub use dump::Table;
pub use error::StoreError;
pub use hands::{HandRow, NewHand};
pub use host::{ALONE, FIRST_EPOCH, Held, Host, HostRow, LEASE, OwnedSession, Renewal};
pub use leaderboard::TaskBest;
pub use leaderboard::{LeaderboardRow, ReadTeams};
pub use listed_runs::runs_in;
pub use lists::ListFilter;
pub use location::Location;
pub use number::unix_ms;
pub use open_runs::OpenRun;
pub use run_actions::{OwnedRun, SentSnapshot, SentTicks, ShippedRun, ShippingConnection, StoredTicks};
pub use runs::{FinishedRunRow, InterruptedRun, NewRun, RunRecord};
pub use schedule::{PlayingClock, Slot};
pub use sessions::{NewSession, ResumableSession, SessionRow};
pub use similar_runs::{RunInScene, SimilarPair};
pub use teams::TeamRow;
pub use tokens::{NewToken, TokenRow};
pub use verification::{
    CLAIM, Claim, LostRun, MAX_TRIES, RecordedReplay, UnstoredReplay, VerificationStatus,
};

#[cfg(test)]
mod tests;
