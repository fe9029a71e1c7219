//! The database: teams, tokens, sessions, runs, hands, audit.
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
mod hands;
mod host;
mod hosts;
mod leaderboard;
mod listed_runs;
mod lists;
mod location;
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

pub(crate) use announcements::Announcement;
pub(crate) use audit::{AuditEntry, NewAuditEntry};
pub(crate) use clocks::{ClockRow, RefundedClock, RunCost, SavedClock};
pub(crate) use competition::{CompetitionChange, CompetitionPhase, CompetitionState};
pub(crate) use database::Store;
pub(crate) use dump::Table;
pub(crate) use error::StoreError;
pub(crate) use hands::{HandRow, NewHand};
pub(crate) use host::{ALONE, FIRST_EPOCH, Held, Host, HostRow, LEASE, OwnedSession, Renewal};
pub(crate) use leaderboard::TaskBest;
pub(crate) use leaderboard::{LeaderboardRow, ReadTeams};
pub use listed_runs::runs_in;
pub(crate) use lists::ListFilter;
pub(crate) use location::Location;
pub(crate) use number::unix_ms;
pub(crate) use open_runs::OpenRun;
pub(crate) use run_actions::{
    OwnedRun, SentSnapshot, SentTicks, ShippedRun, ShippingConnection, StoredTicks,
};
pub(crate) use runs::{FinishedRunRow, InterruptedRun, NewRun, RunRecord};
pub(crate) use schedule::{PlayingClock, Slot};
pub(crate) use sessions::{NewSession, ResumableSession, SessionRow};
pub(crate) use similar_runs::{RunInScene, SimilarPair};
pub(crate) use teams::TeamRow;
pub(crate) use tokens::{NewToken, TokenRow};
pub(crate) use verification::{
    CLAIM, Claim, LostRun, MAX_TRIES, RecordedReplay, UnstoredReplay, VerificationStatus,
};

#[cfg(test)]
pub(crate) mod tests;
