//! Ranking: best score per task, their sum, ties to who reached it earlier.

use super::{Store, StoreError};
use serde::Serialize;
use std::collections::BTreeMap;

/// A team's place.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct LeaderboardRow {
    /// 1 for the first.
    pub(crate) rank: usize,
    /// The team.
    pub(crate) team: String,
    /// Sum of the best scores.
    pub(crate) total: f64,
    /// Finished runs.
    pub(crate) runs: i64,
    /// When the total was reached, ms since 1970 UTC.
    pub(crate) reached_unix_ms: i64,
    /// Best run of each task.
    pub(crate) tasks: BTreeMap<String, TaskBest>,
}

/// A team's best run of a task.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct TaskBest {
    /// Points.
    pub(crate) score: f64,
    /// The earliest run with this score.
    pub(crate) run_id: String,
    /// Its end, ms since 1970 UTC.
    pub(crate) ended_unix_ms: i64,
}

impl Store {
    /// All teams with a finished run that counts, best first.
    pub(crate) async fn leaderboard(&self) -> Result<Vec<LeaderboardRow>, StoreError> {
        let best: Vec<(String, String, f64, String, i64, i64)> = sqlx::query_as(
            "SELECT team, task, score, run_id, ended_at, runs FROM ( \
               SELECT team, task, score, run_id, ended_at, \
                      COUNT(*) OVER (PARTITION BY team) AS runs, \
                      ROW_NUMBER() OVER (PARTITION BY team, task ORDER BY score DESC, ended_at, run_id) AS place \
               FROM runs WHERE status IN ('practice', 'provisional', 'verified') AND score IS NOT NULL \
             ) AS ranked WHERE place = 1",
        )
        .fetch_all(&self.pool)
        .await?;
        let mut teams: BTreeMap<String, LeaderboardRow> = BTreeMap::new();
        for (team, task, score, run_id, ended_unix_ms, runs) in best {
            let row = teams.entry(team.clone()).or_insert_with(|| LeaderboardRow {
                rank: 0,
                team,
                total: 0.0,
                runs,
                reached_unix_ms: i64::MIN,
                tasks: BTreeMap::new(),
            });
            row.tasks.insert(task, TaskBest { score, run_id, ended_unix_ms });
        }
        Ok(rank(teams.into_values().collect()))
    }
}

/// Sums up, sorts and numbers. The sum is taken over the tasks in order of name: the same bits every time.
fn rank(mut rows: Vec<LeaderboardRow>) -> Vec<LeaderboardRow> {
    for row in &mut rows {
        row.total = row.tasks.values().map(|best| best.score).sum();
        row.reached_unix_ms = row.tasks.values().map(|best| best.ended_unix_ms).max().unwrap_or_default();
    }
    rows.sort_by(|a, b| {
        b.total.total_cmp(&a.total).then(a.reached_unix_ms.cmp(&b.reached_unix_ms)).then(a.team.cmp(&b.team))
    });
    for (i, row) in rows.iter_mut().enumerate() {
        row.rank = i + 1;
    }
    rows
}
