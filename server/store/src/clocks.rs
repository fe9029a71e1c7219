//! The clocks of sessions, and refunds.

use super::database::Store;
use super::error::StoreError;
use super::host::Held;
use super::transaction::Transaction;
use sqlx::{Any, AnyConnection};

/// A session's clock, as stored.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClockRow {
    /// Whether the first reset has happened.
    pub started: bool,
    /// Wall-clock time, without pauses, s.
    pub wall_s: f64,
    /// Simulated time, s.
    pub simulated_s: f64,
    /// Time given back for faults of the server, s.
    pub refunded_s: f64,
    /// Time spent when the open run began, s; None without a run.
    pub run_from_s: Option<f64>,
}

/// Time that a run has spent.
#[derive(Clone, Debug, PartialEq)]
pub struct RunCost {
    /// The run.
    pub run_id: String,
    /// Wall-clock time, s.
    pub wall_s: f64,
    /// Simulated time, s.
    pub simulated_s: f64,
}

from_row!(RunCost { run_id, wall_s: "taken_wall_s", simulated_s: "taken_simulated_s" });

/// A clock after its refunds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RefundedClock {
    /// The clock.
    pub clock: ClockRow,
    /// Whether the session was at its end and has time again.
    pub revived: bool,
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
    clock: &ClockRow,
) -> Result<(), StoreError> {
    let query = sqlx::query(
        "UPDATE sessions SET clock_started = $1, clock_wall_s = $2, clock_simulated_s = $3, refunded_s = $4, \
         run_from_s = $5, run_wall_s = NULL, run_refunded_s = NULL WHERE session_id = $6",
    )
    .bind(i64::from(clock.started))
    .bind(clock.wall_s)
    .bind(clock.simulated_s)
    .bind(clock.refunded_s);
    bind_double(query, clock.run_from_s).bind(session_id.to_owned()).execute(connection).await?;
    Ok(())
}

/// Costs of a session's void runs that are not refunded yet.
const PENDING_REFUNDS: &str = "SELECT run_id, taken_wall_s, taken_simulated_s FROM runs \
     WHERE session_id = $1 AND status = 'voided' AND taken_wall_s IS NOT NULL ORDER BY run_id";

/// Notes that the cost of a run was given back.
async fn give_cost_back(transaction: &mut Transaction, run_id: &str) -> Result<(), StoreError> {
    sqlx::query(
        "UPDATE runs SET refunded_wall_s = taken_wall_s, refunded_simulated_s = taken_simulated_s, taken_wall_s = NULL, \
         taken_simulated_s = NULL WHERE run_id = $1 AND taken_wall_s IS NOT NULL",
    )
        .bind(run_id)
        .execute(&mut **transaction)
        .await?;
    Ok(())
}

/// A session's clock for [`Store::save_clocks`].
#[derive(Clone, Debug)]
pub struct SavedClock {
    /// The session.
    pub session_id: String,
    /// The epoch of its owner.
    pub epoch: i64,
    /// Its clock.
    pub clock: ClockRow,
    /// Wall-clock time and time given back within the open run, s.
    pub in_run: Option<(f64, f64)>,
}

/// Number of clocks in one statement: each has nine parameters, and SQLite takes 32,766.
const CLOCKS_A_STATEMENT: usize = 200;

/// Two clocks are equal up to rounding, s.
pub(super) const ROUNDING_S: f64 = 1e-6;

impl Store {
    /// Saves the clocks of open sessions, in one statement for all. It skips sessions that have another owner. A session that has saved a later clock itself, with a result or a
    /// refund, keeps that one: the sum of time spent and time given back never falls, nor does the time given back.
    pub async fn save_clocks(&self, clocks: &[SavedClock]) -> Result<(), StoreError> {
        for clocks in clocks.chunks(CLOCKS_A_STATEMENT) {
            let row = |k: usize| {
                let places: Vec<String> = (9 * k + 1..=9 * k + 9).map(|place| format!("${place}")).collect();
                format!("({})", places.join(", "))
            };
            let rows: Vec<String> = (0..clocks.len()).map(row).collect();
            // Both databases name the columns of VALUES so.
            let sql = format!(
                "UPDATE sessions SET clock_started = saved.column2, clock_wall_s = saved.column3, \
                 clock_simulated_s = saved.column4, refunded_s = saved.column5, run_from_s = saved.column6, \
                 run_wall_s = saved.column8, run_refunded_s = saved.column9 \
                 FROM (VALUES {}) AS saved WHERE sessions.session_id = saved.column1 AND sessions.epoch = saved.column7 \
                 AND sessions.status = 'open' AND sessions.refunded_s <= saved.column5 + {ROUNDING_S} \
                 AND CASE WHEN clock_wall_s > clock_simulated_s THEN clock_wall_s ELSE clock_simulated_s END + refunded_s \
                 <= CASE WHEN saved.column3 > saved.column4 THEN saved.column3 ELSE saved.column4 END + saved.column5 \
                 + {ROUNDING_S}",
                rows.join(", ")
            );
            // The statement depends on the number of clocks: it is not kept.
            let mut query = sqlx::query(sqlx::AssertSqlSafe(sql)).persistent(false);
            for SavedClock { session_id, epoch, clock, in_run } in clocks {
                query = query
                    .bind(session_id.clone())
                    .bind(i64::from(clock.started))
                    .bind(clock.wall_s)
                    .bind(clock.simulated_s)
                    .bind(clock.refunded_s);
                query = bind_double(query, clock.run_from_s).bind(*epoch);
                let (wall_s, refunded_s) = in_run.unzip();
                query = bind_double(bind_double(query, wall_s), refunded_s);
            }
            query.execute(&self.pool()).await?;
        }
        Ok(())
    }

    /// Saves the clock of an open session. It includes the refunds of `refunded_runs`.
    pub async fn save_clock(
        &self,
        held: &Held,
        clock: &ClockRow,
        refunded_runs: &[String],
    ) -> Result<(), StoreError> {
        let mut transaction = self.fenced(held).await?;
        write_clock(&mut transaction, &held.session_id, clock).await?;
        for run_id in refunded_runs {
            give_cost_back(&mut transaction, run_id).await?;
        }
        Ok(transaction.commit().await?)
    }

    /// Costs of a session's void runs that are not refunded yet.
    pub async fn pending_refunds(&self, session_id: &str) -> Result<Vec<RunCost>, StoreError> {
        Ok(sqlx::query_as(PENDING_REFUNDS).bind(session_id).fetch_all(&self.pool()).await?)
    }

    /// The sessions with pending refunds.
    pub async fn sessions_with_pending_refunds(&self) -> Result<Vec<String>, StoreError> {
        let query = sqlx::query_scalar(
            "SELECT DISTINCT session_id FROM runs WHERE status = 'voided' AND taken_wall_s IS NOT NULL \
             ORDER BY session_id",
        );
        Ok(query.fetch_all(&self.pool()).await?)
    }

    /// Gives pending refunds to a session that is not open in this process. `refund` computes the clock from the session's length and
    /// clock. If the session has time again and `reopen` is set, an official session opens again, unless its team has another open
    /// one.
    pub async fn refund(
        &self,
        session_id: &str,
        reopen: bool,
        refund: impl FnOnce(Option<f64>, ClockRow, &[RunCost]) -> RefundedClock + Send,
    ) -> Result<(), StoreError> {
        type Clock = (Option<f64>, i64, f64, f64, f64);
        let mut transaction = self.write().await?;
        // Locks the row in Postgres; SQLite locks at the transaction's begin.
        sqlx::query("UPDATE sessions SET clock_started = clock_started WHERE session_id = $1")
            .bind(session_id)
            .execute(&mut *transaction)
            .await?;
        let pending: Vec<RunCost> =
            sqlx::query_as(PENDING_REFUNDS).bind(session_id).fetch_all(&mut *transaction).await?;
        if pending.is_empty() {
            return Ok(());
        }
        let (limit_s, started, wall_s, simulated_s, refunded_s): Clock = sqlx::query_as(
            "SELECT limit_s, clock_started, clock_wall_s, clock_simulated_s, refunded_s FROM sessions \
             WHERE session_id = $1",
        )
        .bind(session_id)
        .fetch_one(&mut *transaction)
        .await?;
        let clock = ClockRow { started: started != 0, wall_s, simulated_s, refunded_s, run_from_s: None };
        let RefundedClock { clock, revived } = refund(limit_s, clock, &pending);
        write_clock(&mut transaction, session_id, &clock).await?;
        for cost in &pending {
            give_cost_back(&mut transaction, &cost.run_id).await?;
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
