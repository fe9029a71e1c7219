//! The ranking: by the sum of the best scores of each task; of equal sums the one that was stored earlier is first. The order of storing
//! decides, not the clock, which can be set back.

use super::database::Store;
use super::error::StoreError;
use schemars::JsonSchema;
use serde::Serialize;
use sqlx::AnyConnection;
use std::collections::{BTreeMap, HashMap};

/// A team's row in the ranking.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct LeaderboardRow {
    /// From 1.
    pub rank: usize,
    /// The team.
    pub team: String,
    /// Sum of the best scores.
    pub total: f64,
    /// Finished runs.
    pub runs: i64,
    /// When the total was reached: the end of the last run in it, ms since 1970 UTC.
    pub reached_unix_ms: i64,
    /// Number of that run among all ended runs.
    #[serde(skip)]
    pub reached_seq: i64,
    /// Whether no run of the team had the true state.
    pub sensors_only: bool,
    /// Its rank among the teams with `sensors_only`.
    pub sensors_rank: Option<usize>,
    /// Best run of each task.
    pub tasks: BTreeMap<String, TaskBest>,
}

/// A team's best run of a task.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct TaskBest {
    /// Points.
    pub score: f64,
    /// The earliest run with this score.
    pub run_id: String,
    /// `practice`, `provisional` or `verified`.
    pub status: String,
    /// End of the run, ms since 1970 UTC.
    pub ended_unix_ms: i64,
    /// Its number among all ended runs, in the order in which they were stored.
    #[serde(skip)]
    pub ended_seq: i64,
}

/// A row of the table `best`: team, task, runs that count, whether a run had the true state, the best run if any counts, number and
/// time of changes, number of the best run among all ended ones.
type Best = (
    String,
    String,
    i64,
    i64,
    Option<f64>,
    Option<String>,
    Option<String>,
    Option<i64>,
    i64,
    i64,
    Option<i64>,
);

/// Changes may become visible this much later than the time that they have, ms: at the end of their transaction.
const LATE_MS: i64 = 3_000;

/// The ranking as it was read last, so that the next reading needs only what has changed since.
#[derive(Debug, Default)]
pub struct ReadTeams {
    teams: HashMap<String, HashMap<String, ReadTask>>,
    /// Sum of the revisions of all rows.
    revision: i64,
    /// Time of the last change.
    changed_at: i64,
}

/// A team's runs of a task.
#[derive(Debug)]
struct ReadTask {
    runs: i64,
    truth: bool,
    best: Option<TaskBest>,
    revision: i64,
}

impl ReadTeams {
    /// The revision of the ranking.
    pub fn revision(&self) -> i64 {
        self.revision
    }

    fn insert(&mut self, row: Best) {
        let (team, task, runs, truth, score, run_id, status, ended_at, revision, changed_at, ended_seq) = row;
        let ended_seq = ended_seq.unwrap_or_default();
        let best = match (score, run_id, status, ended_at) {
            (Some(score), Some(run_id), Some(status), Some(ended_unix_ms)) => {
                Some(TaskBest { score, run_id, status, ended_unix_ms, ended_seq })
            }
            _ => None,
        };
        let read = ReadTask { runs, truth: truth != 0, best, revision };
        let before = self.teams.entry(team).or_default().insert(task, read);
        self.revision += revision - before.map_or(0, |before| before.revision);
        self.changed_at = self.changed_at.max(changed_at);
    }

    /// The ranking.
    fn rows(&self) -> Vec<LeaderboardRow> {
        let row = |(team, read): (&String, &HashMap<String, ReadTask>)| {
            let best = |(task, read): (&String, &ReadTask)| Some((task.clone(), read.best.clone()?));
            LeaderboardRow {
                rank: 0,
                team: team.clone(),
                total: 0.0,
                runs: read.values().map(|task| task.runs).sum(),
                reached_unix_ms: i64::MIN,
                reached_seq: 0,
                sensors_only: !read.values().any(|task| task.truth),
                sensors_rank: None,
                tasks: read.iter().filter_map(best).collect(),
            }
        };
        rank(self.teams.iter().map(row).filter(|row| !row.tasks.is_empty()).collect())
    }
}

impl Store {
    /// All teams with a finished run that counts, best first. Rejected and voided runs do not count, practice runs
    /// only in practice.
    pub async fn leaderboard(&self, official: bool) -> Result<Vec<LeaderboardRow>, StoreError> {
        self.read_leaderboard(official, &mut ReadTeams::default()).await
    }

    /// The ranking, from an earlier reading and the changes since.
    pub async fn read_leaderboard(
        &self,
        official: bool,
        read: &mut ReadTeams,
    ) -> Result<Vec<LeaderboardRow>, StoreError> {
        let since = if read.teams.is_empty() { i64::MIN } else { read.changed_at - LATE_MS };
        if !self.read_changes(official, since, read).await? {
            // A change came later than expected, or the database's clock was set back.
            *read = ReadTeams::default();
            self.read_changes(official, i64::MIN, read).await?;
        }
        Ok(read.rows())
    }

    /// Reads the rows that changed since a time; whether no change is missing after that.
    async fn read_changes(
        &self,
        official: bool,
        since: i64,
        read: &mut ReadTeams,
    ) -> Result<bool, StoreError> {
        // One statement, so that the sum is that of the rows. It is the first row.
        let rows: Vec<Best> = sqlx::query_as(
            "SELECT '' AS team, '' AS task, CAST(0 AS BIGINT) AS runs, CAST(0 AS BIGINT) AS truth, \
                 CAST(NULL AS DOUBLE PRECISION) AS score, CAST(NULL AS TEXT) AS run_id, CAST(NULL AS TEXT) AS status, \
                 CAST(NULL AS BIGINT) AS ended_at, CAST(COALESCE(SUM(revision), 0) AS BIGINT) AS revision, \
                 CAST(0 AS BIGINT) AS changed_at, CAST(NULL AS BIGINT) AS ended_seq FROM best WHERE official = $1 \
             UNION ALL \
             SELECT team, task, runs, truth, score, run_id, status, ended_at, revision, changed_at, ended_seq FROM best \
             WHERE official = $1 AND changed_at >= $2",
        )
        .bind(i64::from(official))
        .bind(since)
        .fetch_all(&self.pool())
        .await?;
        let (mut total, mut rows) = (0, rows.into_iter());
        for row in rows.by_ref() {
            match row.0.is_empty() {
                true => total += row.8,
                false => read.insert(row),
            }
        }
        Ok(read.revision == total)
    }

    /// The revision of the ranking: it grows with every change, on whichever server.
    pub async fn leaderboard_revision(
        &self,
        connection: &mut AnyConnection,
        official: bool,
    ) -> Result<i64, StoreError> {
        let query = sqlx::query_scalar(
            "SELECT CAST(COALESCE(SUM(revision), 0) AS BIGINT) FROM best WHERE official = $1",
        );
        Ok(query.bind(i64::from(official)).fetch_one(connection).await?)
    }
}

/// Adds the scores, sorts and numbers the rows. Scores are added in order of the task's name, so that the sum is deterministic.
fn rank(mut rows: Vec<LeaderboardRow>) -> Vec<LeaderboardRow> {
    for row in &mut rows {
        row.total = row.tasks.values().map(|best| best.score).sum();
        let last = row.tasks.values().max_by_key(|best| best.ended_seq);
        (row.reached_unix_ms, row.reached_seq) =
            last.map(|best| (best.ended_unix_ms, best.ended_seq)).unwrap_or_default();
    }
    rows.sort_by(|a, b| {
        b.total.total_cmp(&a.total).then(a.reached_seq.cmp(&b.reached_seq)).then(a.team.cmp(&b.team))
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
