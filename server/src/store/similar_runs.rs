//! Runs of different teams with the same actions in the same scene.

use super::database::Store;
use super::error::StoreError;
use super::number::signed;
use crate::fingerprint::{Fingerprint, is_reportable};
use schemars::JsonSchema;
use serde::Serialize;
use sqlx::AssertSqlSafe;
use std::collections::{BTreeMap, BTreeSet};

/// Rows for each statement: two values each, well below the limits of the databases.
const BATCH: usize = 500;
/// A mark that more teams than this have in one scene is common. It says nothing about two of them: it belongs to a published
/// example, or to something else that the teams share.
pub(super) const MAX_TEAMS: usize = 4;
/// The longest common stretches that are kept for a run.
pub(super) const MAX_PARTNERS: usize = 8;

/// Another team's run with the same actions over a long stretch.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct SimilarRun {
    /// The other run.
    run_id: String,
    /// Its team.
    team: String,
    /// Its number among the team's runs of the task.
    k: Option<i64>,
    /// Number of consecutive changes of the action that are the same, a lower bound.
    changes: i64,
}

from_row!(SimilarRun { run_id: "other_run_id", team, k, changes });

/// Two runs with the same actions over a long stretch.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct SimilarPair {
    /// Number of consecutive changes of the action that are the same, a lower bound.
    changes: i64,
    /// Number of changes of the run with fewer.
    of_changes: i64,
    /// Task of both.
    task: String,
    /// Number of each among its team's runs of the task: both have the same scene.
    k: Option<i64>,
    /// The run that began first, and the other.
    runs: [PairedRun; 2],
}

/// A run of a pair.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct PairedRun {
    /// Its id.
    run_id: String,
    /// Its team.
    team: String,
    /// As in `GET /v1/runs/{id}`.
    status: String,
    /// Its score.
    score: Option<f64>,
    /// Time of its begin, ms since 1970 UTC.
    started_unix_ms: i64,
}

from_row!(SimilarPair { changes, of_changes, task, k; row => runs: [
    PairedRun {
        run_id: row.try_get("run_id")?,
        team: row.try_get("team")?,
        status: row.try_get("status")?,
        score: row.try_get("score")?,
        started_unix_ms: row.try_get("started_at")?,
    },
    PairedRun {
        run_id: row.try_get("other_run_id")?,
        team: row.try_get("other_team")?,
        status: row.try_get("other_status")?,
        score: row.try_get("other_score")?,
        started_unix_ms: row.try_get("other_started_at")?,
    },
] });

/// A mark shared with another team's run: its hash, id, team and changes of that run, and the places of the mark in both.
type Shared = (i64, String, String, i64, i64, i64);

impl Store {
    /// Stores the fingerprint of a run and compares it with those of other teams' runs in the same scene: of the same task and the same
    /// k. The longest reportable matches are stored with both runs. The rows that it reads grow with the marks of the run alone: a mark
    /// of more than [`MAX_TEAMS`] teams is never read again.
    pub(crate) async fn compare_actions(
        &self,
        run_id: &str,
        fingerprint: &Fingerprint,
    ) -> Result<(), StoreError> {
        self.store_marks(run_id, fingerprint).await?;
        let shared: Vec<Shared> = sqlx::query_as(
            "SELECT mine.hash, theirs.run_id, other.team, COALESCE(other.action_changes, 0), mine.place, theirs.place \
             FROM action_marks AS mine JOIN action_marks AS theirs ON theirs.hash = mine.hash AND theirs.k = mine.k \
             JOIN runs AS own ON own.run_id = mine.run_id JOIN runs AS other ON other.run_id = theirs.run_id \
             WHERE mine.run_id = $1 AND other.team <> own.team AND other.task = own.task \
             AND NOT EXISTS (SELECT 1 FROM common_marks WHERE common_marks.hash = mine.hash)",
        )
        .bind(run_id)
        .fetch_all(&self.pool())
        .await?;
        let mut teams: BTreeMap<i64, BTreeSet<&str>> = BTreeMap::new();
        for (hash, _, team, ..) in &shared {
            teams.entry(*hash).or_default().insert(team);
        }
        teams.retain(|_, teams| teams.len() >= MAX_TEAMS);
        let mut others: BTreeMap<(&str, i64), Vec<(i64, i64)>> = BTreeMap::new();
        for (hash, other, _, changes, here, there) in &shared {
            if !teams.contains_key(hash) {
                others.entry((other, *changes)).or_default().push((*here, *there));
            }
        }
        let mut matches: Vec<(u64, &str)> = others
            .iter()
            .map(|((other, changes), places)| (fingerprint.longest(places), *other, changes.unsigned_abs()))
            .filter(|(longest, _, changes)| is_reportable(*longest, (fingerprint.changes, *changes)))
            .map(|(longest, other, _)| (longest, other))
            .collect();
        matches.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(b.1)));
        matches.truncate(MAX_PARTNERS);
        self.store_matches(run_id, &matches, teams.keys().copied()).await
    }

    /// Replaces the marks of a run. In several statements, so that no other writer waits for all of them; a verification that is
    /// interrupted in between is repeated.
    async fn store_marks(&self, run_id: &str, fingerprint: &Fingerprint) -> Result<(), StoreError> {
        sqlx::query("DELETE FROM action_marks WHERE run_id = $1").bind(run_id).execute(&self.pool()).await?;
        sqlx::query("UPDATE runs SET action_changes = $1 WHERE run_id = $2")
            .bind(signed(fingerprint.changes))
            .bind(run_id)
            .execute(&self.pool())
            .await?;
        for batch in fingerprint.marks.chunks(BATCH) {
            let row =
                |k| format!("($1, (SELECT k FROM runs WHERE run_id = $1), ${}, ${})", 2 * k + 2, 2 * k + 3);
            let rows: Vec<String> = (0..batch.len()).map(row).collect();
            let sql = format!("INSERT INTO action_marks (run_id, k, hash, place) VALUES {}", rows.join(", "));
            let mut query = sqlx::query(AssertSqlSafe(sql)).bind(run_id.to_owned());
            for mark in batch {
                query = query.bind(mark.hash).bind(mark.place);
            }
            query.execute(&self.pool()).await?;
        }
        Ok(())
    }

    /// Stores the matches of a run, of both runs only the longest, and the marks that became common.
    async fn store_matches(
        &self,
        run_id: &str,
        matches: &[(u64, &str)],
        common: impl Iterator<Item = i64>,
    ) -> Result<(), StoreError> {
        let mut transaction = self.write().await?;
        for hash in common {
            sqlx::query("INSERT INTO common_marks (hash) VALUES ($1) ON CONFLICT (hash) DO NOTHING")
                .bind(hash)
                .execute(&mut *transaction)
                .await?;
        }
        for (longest, other) in matches {
            for (one, another) in [(run_id, *other), (*other, run_id)] {
                sqlx::query(
                    "INSERT INTO similar_runs (run_id, other_run_id, changes) VALUES ($1, $2, $3) \
                     ON CONFLICT (run_id, other_run_id) DO NOTHING",
                )
                .bind(one)
                .bind(another)
                .bind(signed(*longest))
                .execute(&mut *transaction)
                .await?;
            }
        }
        for run in matches.iter().map(|(_, other)| *other).chain([run_id]) {
            sqlx::query(
                "DELETE FROM similar_runs WHERE run_id = $1 AND other_run_id NOT IN (SELECT other_run_id \
                 FROM similar_runs WHERE run_id = $1 ORDER BY changes DESC, other_run_id LIMIT $2)",
            )
            .bind(run)
            .bind(MAX_PARTNERS as i64)
            .execute(&mut *transaction)
            .await?;
        }
        Ok(transaction.commit().await?)
    }

    /// The similar runs of these runs, or of all, by run.
    pub(super) async fn similar_runs(
        &self,
        of: Option<&[&str]>,
    ) -> Result<BTreeMap<String, Vec<SimilarRun>>, StoreError> {
        use sqlx::{FromRow, Row};
        let which = match of {
            Some([]) => return Ok(BTreeMap::new()),
            Some(runs) => {
                let numbers: Vec<String> = (1..=runs.len()).map(|k| format!("${k}")).collect();
                format!("WHERE similar_runs.run_id IN ({})", numbers.join(", "))
            }
            None => String::new(),
        };
        let sql = format!(
            "SELECT similar_runs.run_id AS of_run, other_run_id, runs.team, runs.k, changes FROM similar_runs \
             JOIN runs ON runs.run_id = other_run_id {which} ORDER BY changes DESC, other_run_id"
        );
        let mut query = sqlx::query(AssertSqlSafe(sql));
        for run_id in of.unwrap_or_default() {
            query = query.bind((*run_id).to_owned());
        }
        let rows = query.fetch_all(&self.pool()).await?;
        let mut found: BTreeMap<String, Vec<SimilarRun>> = BTreeMap::new();
        for row in &rows {
            found.entry(row.try_get("of_run")?).or_default().push(SimilarRun::from_row(row)?);
        }
        Ok(found)
    }

    /// The pairs of similar runs of a team and a task, or of all, longest common stretch first, at most `limit` of them.
    pub(crate) async fn similar_pairs(
        &self,
        team: Option<&str>,
        task: Option<&str>,
        limit: u32,
    ) -> Result<Vec<SimilarPair>, StoreError> {
        // A pair can be stored with one of its runs only: the other may have longer ones.
        let query = sqlx::query_as(
            "SELECT changes, COALESCE(CASE WHEN run.action_changes < other.action_changes THEN run.action_changes \
               ELSE other.action_changes END, changes) AS of_changes, run.task, run.k, \
               run.run_id, run.team, run.status, run.score, run.started_at, \
               other.run_id AS other_run_id, other.team AS other_team, other.status AS other_status, \
               other.score AS other_score, other.started_at AS other_started_at \
             FROM similar_runs AS pair JOIN runs AS run ON run.run_id = pair.run_id \
             JOIN runs AS other ON other.run_id = pair.other_run_id \
             WHERE ($1 = '' OR run.team = $1 OR other.team = $1) AND ($2 = '' OR run.task = $2) \
             AND (pair.run_id < pair.other_run_id OR NOT EXISTS (SELECT 1 FROM similar_runs AS back \
               WHERE back.run_id = pair.other_run_id AND back.other_run_id = pair.run_id)) \
             ORDER BY changes DESC, run.run_id, other.run_id LIMIT $3",
        );
        let query = query.bind(team.unwrap_or_default().to_owned()).bind(task.unwrap_or_default().to_owned());
        let mut pairs: Vec<SimilarPair> = query.bind(i64::from(limit)).fetch_all(&self.pool()).await?;
        for pair in &mut pairs {
            pair.runs.sort_by_key(|run| run.started_unix_ms);
        }
        Ok(pairs)
    }
}
