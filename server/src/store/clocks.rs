//! The clocks of sessions, and what is given back of them.

use super::database::Store;
use super::error::StoreError;
use sqlx::{Any, AnyConnection, Transaction};

/// A session's clock, as it is saved.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ClockState {
    /// Whether the first reset has been.
    pub(crate) started: bool,
    /// Wall-clock time it ran, pauses left out, s.
    pub(crate) wall_s: f64,
    /// Simulated time, s.
    pub(crate) simulated_s: f64,
    /// Time given back for faults of the server, s.
    pub(crate) refunded_s: f64,
    /// Time spent when the open run began, s; none without a run.
    pub(crate) run_from_s: Option<f64>,
}

/// What a run has taken from its session's clock.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Taken {
    /// Which run.
    pub(crate) run_id: String,
    /// Wall-clock time, s.
    pub(crate) wall_s: f64,
    /// Simulated time, s.
    pub(crate) simulated_s: f64,
}

from_row!(Taken { run_id, wall_s: "taken_wall_s", simulated_s: "taken_simulated_s" });

/// A clock that was paid what it was owed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Paid {
    /// As it stands now.
    pub(crate) clock: ClockState,
    /// Its session was at its end and has time again.
    pub(crate) revived: bool,
}

type Query = sqlx::query::Query<'static, Any, sqlx::any::AnyArguments>;

/// Binds a number that may be missing. Through `Any`, a missing f64 would declare the parameter to be four bytes
/// wide, and Postgres would refuse the next number in the same prepared statement; a missing f32 declares eight.
pub(super) fn bind_double(query: Query, number: Option<f64>) -> Query {
    match number {
        Some(number) => query.bind(number),
        None => query.bind(None::<f32>),
    }
}

/// Writes a session's clock.
pub(super) async fn write_clock(
    connection: &mut AnyConnection,
    session_id: &str,
    clock: &ClockState,
) -> Result<(), StoreError> {
    let query = sqlx::query(
        "UPDATE sessions SET clock_started = $1, clock_wall_s = $2, clock_simulated_s = $3, refunded_s = $4, \
         run_from_s = $5 WHERE session_id = $6",
    )
    .bind(i64::from(clock.started))
    .bind(clock.wall_s)
    .bind(clock.simulated_s)
    .bind(clock.refunded_s);
    bind_double(query, clock.run_from_s).bind(session_id.to_owned()).execute(connection).await?;
    Ok(())
}

/// What void runs of a session have taken and was not given back.
const OWED: &str = "SELECT run_id, taken_wall_s, taken_simulated_s FROM runs \
     WHERE session_id = $1 AND status = 'voided' AND taken_wall_s IS NOT NULL ORDER BY run_id";

/// Notes that a run's time was given back.
async fn settle(transaction: &mut Transaction<'static, Any>, run_id: &str) -> Result<(), StoreError> {
    sqlx::query("UPDATE runs SET taken_wall_s = NULL, taken_simulated_s = NULL WHERE run_id = $1")
        .bind(run_id)
        .execute(&mut **transaction)
        .await?;
    Ok(())
}

impl Store {
    /// Saves the clock of a session that somebody holds: what a crash leaves of it. The time of the runs in `paid` was
    /// given back to it.
    pub(crate) async fn save_clock(
        &self,
        session_id: &str,
        clock: &ClockState,
        paid: &[String],
    ) -> Result<(), StoreError> {
        let mut transaction = self.write().await?;
        write_clock(&mut transaction, session_id, clock).await?;
        for run_id in paid {
            settle(&mut transaction, run_id).await?;
        }
        Ok(transaction.commit().await?)
    }

    /// What void runs of a session have taken and was not given back.
    pub(crate) async fn owed(&self, session_id: &str) -> Result<Vec<Taken>, StoreError> {
        Ok(sqlx::query_as(OWED).bind(session_id).fetch_all(&self.pool).await?)
    }

    /// The sessions that something is owed to.
    pub(crate) async fn creditors(&self) -> Result<Vec<String>, StoreError> {
        let query = sqlx::query_scalar(
            "SELECT DISTINCT session_id FROM runs WHERE status = 'voided' AND taken_wall_s IS NOT NULL \
             ORDER BY session_id",
        );
        Ok(query.fetch_all(&self.pool).await?)
    }

    /// Gives back what is owed to a session that nobody holds. `pay` takes its length and clock; when it says that the
    /// session has time again, and `reopen`, an official session is open again, unless its team has another open one.
    pub(crate) async fn give_back(
        &self,
        session_id: &str,
        reopen: bool,
        pay: impl FnOnce(Option<f64>, ClockState, &[Taken]) -> Paid + Send,
    ) -> Result<(), StoreError> {
        type Clock = (Option<f64>, i64, f64, f64, f64);
        let mut transaction = self.write().await?;
        // Whoever else does the same waits here; in SQLite at the transaction's begin.
        sqlx::query("UPDATE sessions SET clock_started = clock_started WHERE session_id = $1")
            .bind(session_id)
            .execute(&mut *transaction)
            .await?;
        let owed: Vec<Taken> = sqlx::query_as(OWED).bind(session_id).fetch_all(&mut *transaction).await?;
        if owed.is_empty() {
            return Ok(());
        }
        let (limit_s, started, wall_s, simulated_s, refunded_s): Clock = sqlx::query_as(
            "SELECT limit_s, clock_started, clock_wall_s, clock_simulated_s, refunded_s FROM sessions \
             WHERE session_id = $1",
        )
        .bind(session_id)
        .fetch_one(&mut *transaction)
        .await?;
        let clock = ClockState { started: started != 0, wall_s, simulated_s, refunded_s, run_from_s: None };
        let Paid { clock, revived } = pay(limit_s, clock, &owed);
        write_clock(&mut transaction, session_id, &clock).await?;
        for taken in &owed {
            settle(&mut transaction, &taken.run_id).await?;
        }
        if revived && reopen {
            sqlx::query(
                "UPDATE sessions SET status = 'open', ended_at = NULL WHERE session_id = $1 AND status = 'ended' \
                 AND mode = 'official' AND NOT EXISTS (SELECT 1 FROM sessions AS others WHERE others.team = \
                 sessions.team AND others.mode = 'official' AND others.status = 'open')",
            )
            .bind(session_id)
            .execute(&mut *transaction)
            .await?;
        }
        Ok(transaction.commit().await?)
    }
}
