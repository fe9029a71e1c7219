//! A void run that counts again: the organizer's command that undoes `run void`.

use super::audit::NewAuditEntry;
use super::clocks::{ClockRow, RunCost, write_clock};
use super::database::Store;
use super::error::StoreError;
use super::host::Held;

/// Run and session, as far as they decide.
struct VoidRun {
    status: String,
    session_status: String,
    k: Option<i64>,
    ticks: Option<i64>,
    score: Option<f64>,
    replay_sha256: Option<String>,
    /// Not given back yet.
    taken_wall_s: Option<f64>,
    refunded_wall_s: Option<f64>,
    refunded_simulated_s: Option<f64>,
    limit_s: Option<f64>,
    clock_started: i64,
    clock_wall_s: f64,
    clock_simulated_s: f64,
    refunded_s: f64,
}

from_row!(VoidRun {
    status,
    session_status,
    k,
    ticks,
    score,
    replay_sha256,
    taken_wall_s,
    refunded_wall_s,
    refunded_simulated_s,
    limit_s,
    clock_started,
    clock_wall_s,
    clock_simulated_s,
    refunded_s
});

impl VoidRun {
    /// The status from which it counts again.
    ///
    /// # Errors
    /// Reason why it cannot.
    fn status_again(&self) -> Result<&'static str, String> {
        if self.status != "voided" {
            return Err(format!("the run is {}, not void", self.status));
        }
        if self.session_status == "voided" {
            return Err("its whole session is void".into());
        }
        match (self.k, self.ticks) {
            (_, None) => Err("it never ended".into()),
            (None, _) => Ok("practice"),
            (Some(_), Some(0)) => Ok("aborted"),
            (Some(_), Some(_)) if self.replay_sha256.is_none() || self.score.is_none() => {
                Err("it has no replay, and only runs with a replay count".into())
            }
            (Some(_), Some(_)) => Ok("provisional"),
        }
    }

    /// The time that is to be taken again; none if it was not given back yet.
    fn cost(&self, run_id: &str) -> Result<Option<RunCost>, String> {
        match (self.taken_wall_s, self.refunded_wall_s, self.refunded_simulated_s) {
            (Some(_), ..) => Ok(None),
            (None, Some(wall_s), Some(simulated_s)) => {
                Ok(Some(RunCost { run_id: run_id.to_owned(), wall_s, simulated_s }))
            }
            _ => {
                Err("it was voided by an earlier version, which did not keep the time that it gave back"
                    .into())
            }
        }
    }

    fn clock(&self) -> ClockRow {
        ClockRow {
            started: self.clock_started != 0,
            wall_s: self.clock_wall_s,
            simulated_s: self.clock_simulated_s,
            refunded_s: self.refunded_s,
            run_from_s: None,
        }
    }
}

impl Store {
    /// Makes a void run count again, and takes its time from the session's clock. `take` computes the clock from the session's length,
    /// its stored clock and the run's cost. The owner of an open session gives `held`. The inner error says why nothing was done.
    pub async fn unvoid_run(
        &self,
        held: Option<&Held>,
        run_id: &str,
        entry: &NewAuditEntry<'_>,
        take: impl FnOnce(Option<f64>, ClockRow, &RunCost) -> Result<ClockRow, String> + Send,
    ) -> Result<Result<(), String>, StoreError> {
        let mut recorded = self.recorded(entry).await?;
        let transaction = &mut recorded.transaction;
        let session_id: Option<String> = sqlx::query_scalar("SELECT session_id FROM runs WHERE run_id = $1")
            .bind(run_id)
            .fetch_optional(&mut **transaction)
            .await?;
        let Some(session_id) = session_id else { return Ok(Err("there is no such run".into())) };
        // Locks the session's row, also against another owner.
        let locked =
            sqlx::query("UPDATE sessions SET epoch = epoch WHERE session_id = $1 AND ($2 = 0 OR epoch = $2)")
                .bind(session_id.clone())
                .bind(held.map_or(0, |held| held.epoch))
                .execute(&mut **transaction)
                .await?;
        if locked.rows_affected() != 1 {
            return Err(StoreError::Stale { session_id });
        }
        let run: VoidRun = sqlx::query_as(
            "SELECT runs.status, sessions.status AS session_status, k, ticks, score, replay_sha256, taken_wall_s, \
             refunded_wall_s, refunded_simulated_s, limit_s, clock_started, clock_wall_s, clock_simulated_s, refunded_s \
             FROM runs JOIN sessions ON sessions.session_id = runs.session_id WHERE run_id = $1",
        )
        .bind(run_id)
        .fetch_one(&mut **transaction)
        .await?;
        let (status, cost) = match run.status_again().and_then(|status| Ok((status, run.cost(run_id)?))) {
            Ok(fits) => fits,
            Err(why) => return Ok(Err(why)),
        };
        if let Some(cost) = &cost {
            match take(run.limit_s, run.clock(), cost) {
                Ok(clock) => write_clock(transaction, &session_id, &clock).await?,
                Err(why) => return Ok(Err(why)),
            }
        }
        sqlx::query(
            "UPDATE runs SET status = $1, note = $2, taken_wall_s = COALESCE(taken_wall_s, refunded_wall_s), \
             taken_simulated_s = COALESCE(taken_simulated_s, refunded_simulated_s), refunded_wall_s = NULL, \
             refunded_simulated_s = NULL, verify_since = NULL, verify_owner = NULL, verify_until = NULL, verify_tries = 0, \
             verify_problem = NULL WHERE run_id = $3",
        )
        .bind(status)
        .bind(entry.reason)
        .bind(run_id)
        .execute(&mut **transaction)
        .await?;
        recorded.commit().await?;
        Ok(Ok(()))
    }
}
