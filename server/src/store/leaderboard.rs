//! The ranking: by the sum of the best scores of each task; of equal sums the earlier is first.

use super::database::Store;
use super::error::StoreError;
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::{BTreeMap, HashMap};

/// A team's row in the ranking.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct LeaderboardRow {
    /// From 1.
    pub(crate) rank: usize,
    /// The team.
    pub(crate) team: String,
    /// Sum of the best scores.
    pub(crate) total: f64,
    /// Finished runs.
    pub(crate) runs: i64,
    /// When the total was reached: the end of the last run in it, ms since 1970 UTC.
    pub(crate) reached_unix_ms: i64,
    /// Whether no run of the team had the true state.
    pub(crate) sensors_only: bool,
    /// Its rank among the teams with `sensors_only`.
    pub(crate) sensors_rank: Option<usize>,
    /// Best run of each task.
    pub(crate) tasks: BTreeMap<String, TaskBest>,
}

/// A team's best run of a task.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct TaskBest {
    /// Points.
    pub(crate) score: f64,
    /// The earliest run with this score.
    pub(crate) run_id: String,
    /// `practice`, `provisional` or `verified`.
    pub(crate) status: String,
    /// End of the run, ms since 1970 UTC.
    pub(crate) ended_unix_ms: i64,
}

/// A row of the table `best`: a team's runs of a task. Without a run that counts, the best one is missing.
type Best = (String, String, i64, i64, Option<f64>, Option<String>, Option<String>, Option<i64>, i64);

impl Store {
    /// All teams with a finished run that counts, best first. Rejected and voided runs do not count, practice runs
    /// only in practice.
    pub(crate) async fn leaderboard(&self, official: bool) -> Result<Vec<LeaderboardRow>, StoreError> {
        Ok(self.revised_leaderboard(official).await?.1)
    }

    /// The ranking, and its revision.
    pub(crate) async fn revised_leaderboard(
        &self,
        official: bool,
    ) -> Result<(i64, Vec<LeaderboardRow>), StoreError> {
        let best: Vec<Best> = sqlx::query_as(
            "SELECT team, task, runs, truth, score, run_id, status, ended_at, revision FROM best \
             WHERE official = $1",
        )
        .bind(i64::from(official))
        .fetch_all(&self.pool())
        .await?;
        let mut teams: HashMap<String, LeaderboardRow> = HashMap::new();
        let mut revision = 0;
        for (team, task, runs, truth, score, run_id, status, ended_at, changes) in best {
            revision += changes;
            let row = teams.entry(team).or_insert_with_key(|team| LeaderboardRow {
                rank: 0,
                team: team.clone(),
                total: 0.0,
                runs: 0,
                reached_unix_ms: i64::MIN,
                sensors_only: true,
                sensors_rank: None,
                tasks: BTreeMap::new(),
            });
            row.runs += runs;
            row.sensors_only &= truth == 0;
            if let (Some(score), Some(run_id), Some(status), Some(ended_unix_ms)) =
                (score, run_id, status, ended_at)
            {
                row.tasks.insert(task, TaskBest { score, run_id, status, ended_unix_ms });
            }
        }
        Ok((revision, rank(teams.into_values().filter(|row| !row.tasks.is_empty()).collect())))
    }

    /// The revision of the ranking: it grows with every change, on whichever server.
    pub(crate) async fn leaderboard_revision(&self, official: bool) -> Result<i64, StoreError> {
        let query = sqlx::query_scalar(
            "SELECT CAST(COALESCE(SUM(revision), 0) AS BIGINT) FROM best WHERE official = $1",
        );
        Ok(query.bind(i64::from(official)).fetch_one(&self.pool()).await?)
    }
}

/// Adds the scores, sorts and numbers the rows. Scores are added in order of the task's name, so that the sum is deterministic.
fn rank(mut rows: Vec<LeaderboardRow>) -> Vec<LeaderboardRow> {
    for row in &mut rows {
        row.total = row.tasks.values().map(|best| best.score).sum();
        row.reached_unix_ms = row.tasks.values().map(|best| best.ended_unix_ms).max().unwrap_or_default();
    }
    rows.sort_by(|a, b| {
        b.total.total_cmp(&a.total).then(a.reached_unix_ms.cmp(&b.reached_unix_ms)).then(a.team.cmp(&b.team))
    });
    let mut without_truth = 0;
    for (i, row) in rows.iter_mut().enumerate() {
        row.rank = i + 1;
        if row.sensors_only {
            without_truth += 1;
            row.sensors_rank = Some(without_truth);
        }
    }
    rows
}
