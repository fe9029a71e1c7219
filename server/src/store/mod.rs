//! What outlives the process: teams and their tokens, sessions, runs, hands, and who decided what.
//!
//! One set of queries serves SQLite and Postgres (`$1` works in both; flags are 0 or 1 because SQLite has no
//! booleans).

/// How a struct is read from a row: each field from the column of its name, or of the name beside it; what follows `row`
/// is computed.
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
mod database;
mod dump;
mod error;
mod hands;
mod leaderboard;
mod location;
mod number;
mod runs;
mod sessions;
mod settings;
mod similar_runs;
mod teams;
mod tokens;
mod verdicts;

pub(crate) use announcements::Announcement;
pub(crate) use audit::{AuditEntry, NewAuditEntry};
pub(crate) use clocks::{ClockState, Paid, Taken};
pub(crate) use database::Store;
pub(crate) use dump::Table;
pub(crate) use error::StoreError;
pub(crate) use hands::{HandRow, NewHand};
pub(crate) use leaderboard::LeaderboardRow;
pub(crate) use leaderboard::TaskBest;
pub(crate) use location::Location;
pub(crate) use number::unix_ms;
pub(crate) use runs::{FinishedRun, NewRun, RunRecord};
pub(crate) use sessions::{NewSession, ResumableSession, SessionRow};
pub(crate) use teams::TeamRow;
pub(crate) use tokens::{NewToken, TokenRow};
pub(crate) use verdicts::{UnverifiedRun, Verdict};

#[cfg(test)]
mod tests;
