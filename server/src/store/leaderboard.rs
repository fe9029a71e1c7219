//! The ranking: by the sum of the best scores of each task; of equal sums the earlier is first.

use super::database::Store;
use super::error::StoreError;
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;

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

/// A row of the query: the best run of a team in a task.
type Best = (String, String, f64, String, String, i64, i64, i64);

impl Store {
    /// All teams with a finished run that counts, best first. Rejected and voided runs do not count, practice runs
    /// only in practice.
    pub(crate) async fn leaderboard(&self, official: bool) -> Result<Vec<LeaderboardRow>, StoreError> {
        let best: Vec<Best> = sqlx::query_as(
            "SELECT team, task, score, run_id, status, ended_at, runs, \
                 (SELECT COUNT(*) FROM runs AS seeing WHERE seeing.team = ranked.team AND sensing = 'truth' \
                  AND (seeing.k IS NOT NULL) = ($1 = 1)) AS seeing FROM ( \
               SELECT team, task, score, run_id, status, ended_at, \
                      COUNT(*) OVER (PARTITION BY team) AS runs, \
                      ROW_NUMBER() OVER (PARTITION BY team, task ORDER BY score DESC, ended_at, run_id) AS place \
               FROM runs WHERE score IS NOT NULL AND (status = 'practice' AND $1 = 0 OR \
                 status IN ('provisional', 'verified') AND $1 = 1) \
             ) AS ranked WHERE place = 1",
        )
        .bind(i64::from(official))
        .fetch_all(&self.pool())
        .await?;
        let mut teams: BTreeMap<String, LeaderboardRow> = BTreeMap::new();
        for (team, task, score, run_id, status, ended_unix_ms, runs, seeing) in best {
            let row = teams.entry(team.clone()).or_insert_with(|| LeaderboardRow {
                rank: 0,
                team,
                total: 0.0,
                runs,
                reached_unix_ms: i64::MIN,
                sensors_only: seeing == 0,
                sensors_rank: None,
                tasks: BTreeMap::new(),
            });
            row.tasks.insert(task, TaskBest { score, run_id, status, ended_unix_ms });
        }
        Ok(rank(teams.into_values().collect()))
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
