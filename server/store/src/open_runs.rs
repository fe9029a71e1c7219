//! The open runs of all hosts, for viewers.

use super::database::Store;
use super::error::StoreError;
use sqlx::AssertSqlSafe;

/// An open run.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenRun {
    /// The run.
    pub run_id: String,
    /// Its session.
    pub session_id: String,
    /// Its team.
    pub team: String,
    /// Task.
    pub task: String,
    /// Hand.
    pub hand: String,
    /// `sensors` or `truth`.
    pub sensing: String,
    /// Whether it counts in a competition.
    pub official: bool,
    /// Time of its start, ms since 1970.
    pub started_at: i64,
    /// The host that has it; None while it has none.
    pub host: Option<String>,
    /// The address at which other hosts reach its host.
    pub url: Option<String>,
}

from_row!(OpenRun {
    run_id, session_id, team, task, hand, sensing, started_at, host: "host_id", url: "internal_url";
    row => official: row.try_get::<String, _>("session_mode")? == "official"
});

impl Store {
    /// The open runs of all hosts.
    pub async fn open_runs(&self) -> Result<Vec<OpenRun>, StoreError> {
        let sql = format!(
            "SELECT runs.run_id, runs.session_id, runs.team, runs.task, runs.hand, runs.sensing, runs.started_at, \
             sessions.mode AS session_mode, hosts.host_id, hosts.internal_url \
             FROM runs JOIN sessions ON sessions.session_id = runs.session_id \
             LEFT JOIN hosts ON hosts.host_id = sessions.owner AND hosts.incarnation = sessions.owner_incarnation \
             AND hosts.lease_until >= {} WHERE runs.status = 'open' ORDER BY runs.run_id",
            self.dialect.now_ms()
        );
        Ok(sqlx::query_as(AssertSqlSafe(sql)).fetch_all(&self.pool()).await?)
    }

    /// Whether a run is open at any host.
    pub async fn is_run_open(&self, run_id: &str) -> Result<bool, StoreError> {
        let query = sqlx::query_scalar("SELECT COUNT(*) FROM runs WHERE run_id = $1 AND status = 'open'");
        let open: i64 = query.bind(run_id.to_owned()).fetch_one(&self.pool()).await?;
        Ok(open > 0)
    }

    /// Whether a session has opened a run, at any host.
    pub async fn has_opened_a_run(&self, session_id: &str) -> Result<bool, StoreError> {
        let query = sqlx::query_scalar("SELECT COUNT(*) FROM runs WHERE session_id = $1");
        let runs: i64 = query.bind(session_id.to_owned()).fetch_one(&self.pool()).await?;
        Ok(runs > 0)
    }
}
