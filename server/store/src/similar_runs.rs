//! Runs of different teams with the same movements in the same scene.

use super::database::Store;
use super::error::StoreError;
use palmares_replay::likeness::{Likeness, Path};
use schemars::JsonSchema;
use serde::Serialize;
use sqlx::AssertSqlSafe;
use std::collections::BTreeMap;

/// Pairs of runs that share less of the shorter path are not listed. The example controllers of one task share at most 0.52 of theirs in
/// the same scene; copies that still score share 0.58 to 1.
const LISTED_SHARE: f64 = 0.55;
/// What so many other teams share with a run says nothing about two of them: they play a published example.
pub(super) const MAX_TEAMS: usize = 4;
/// By how much the share of a pair must exceed what that many teams share.
const BEYOND_COMMON: f64 = 0.1;
/// The pairs that are kept for a run.
pub(super) const MAX_PARTNERS: usize = 8;
/// A run is compared with at most so many others, the newest ones of its scene.
const MAX_COMPARED: i64 = 200;

/// Another team's run with the same movements over a long stretch.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SimilarRun {
    /// The other run.
    run_id: String,
    /// Its team.
    team: String,
    /// Its number among the team's runs of the task.
    k: Option<i64>,
    /// Part of the shorter of both paths that is alike, 0 to 1.
    share: f64,
    /// Root mean square of the distance of both hands on that part, without a constant offset, mm.
    distance_mm: f64,
    /// The constant offset, mm.
    offset_mm: f64,
    /// How much later the other run is at the same place, s.
    shift_s: f64,
}

from_row!(SimilarRun { run_id: "other_run_id", team, k, share, distance_mm, offset_mm, shift_s });

/// Two runs with the same movements over a long stretch.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SimilarPair {
    /// Part of the shorter of both paths that is alike, 0 to 1.
    share: f64,
    /// Root mean square of the distance of both hands on that part, without a constant offset, mm.
    distance_mm: f64,
    /// The constant offset, mm.
    offset_mm: f64,
    /// How much later the second run is at the same place, s.
    shift_s: f64,
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

from_row!(SimilarPair { share, distance_mm, offset_mm, shift_s, task, k; row => runs: [
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

/// A run in the same scene as another one.
#[derive(Debug)]
pub struct RunInScene {
    /// The run.
    pub run_id: String,
    /// Its team.
    pub team: String,
    /// Its path, as text.
    pub path: String,
}

from_row!(RunInScene { run_id, team, path });

/// The pairs that say something, the greatest share first: those that exceed what [`MAX_TEAMS`] other teams share with the run.
fn telling(mut found: Vec<(RunInScene, Likeness)>) -> Vec<(RunInScene, Likeness)> {
    found.retain(|(_, likeness)| likeness.share >= LISTED_SHARE);
    found.sort_by(|(a, one), (b, other)| other.share.total_cmp(&one.share).then(a.run_id.cmp(&b.run_id)));
    let mut teams: Vec<&str> = Vec::new();
    let mut common = 0.0;
    for (other, likeness) in &found {
        if !teams.contains(&other.team.as_str()) {
            teams.push(&other.team);
            if teams.len() == MAX_TEAMS {
                common = likeness.share + BEYOND_COMMON;
            }
        }
    }
    found.retain(|(_, likeness)| likeness.share >= common);
    found.truncate(MAX_PARTNERS);
    found
}

impl Store {
    /// Stores the path of a run in place of an earlier one; returns other teams' runs in the same scene, the newest first.
    pub async fn store_path(&self, run_id: &str, path: &Path) -> Result<Vec<RunInScene>, StoreError> {
        let mut transaction = self.write().await?;
        sqlx::query("DELETE FROM run_paths WHERE run_id = $1")
            .bind(run_id)
            .execute(&mut *transaction)
            .await?;
        if path.is_comparable() {
            let insert = "INSERT INTO run_paths (run_id, scene, path) SELECT run_id, seed_hex, $2 FROM runs WHERE run_id = $1";
            sqlx::query(insert).bind(run_id).bind(path.to_text()).execute(&mut *transaction).await?;
        }
        transaction.commit().await?;
        let others = sqlx::query_as(
            "SELECT other.run_id, other.team, theirs.path FROM run_paths AS mine \
             JOIN run_paths AS theirs ON theirs.scene = mine.scene JOIN runs AS own ON own.run_id = mine.run_id \
             JOIN runs AS other ON other.run_id = theirs.run_id WHERE mine.run_id = $1 AND other.team <> own.team \
             AND other.task = own.task AND other.k = own.k ORDER BY other.started_at DESC, other.run_id LIMIT $2",
        );
        Ok(others.bind(run_id).bind(MAX_COMPARED).fetch_all(&self.pool()).await?)
    }

    /// Stores how alike a run is to others, in place of earlier results; of every run only the pairs with the greatest share.
    pub async fn store_likeness(
        &self,
        run_id: &str,
        found: Vec<(RunInScene, Likeness)>,
    ) -> Result<(), StoreError> {
        let found = telling(found);
        let mut transaction = self.write().await?;
        let old = "DELETE FROM alike_runs WHERE run_id = $1 OR other_run_id = $1";
        sqlx::query(old).bind(run_id).execute(&mut *transaction).await?;
        for (RunInScene { run_id: other, .. }, likeness) in &found {
            for (one, another, shift_s) in
                [(run_id, other.as_str(), likeness.shift_s), (other.as_str(), run_id, -likeness.shift_s)]
            {
                sqlx::query(
                    "INSERT INTO alike_runs (run_id, other_run_id, share, distance_mm, offset_mm, shift_s) \
                     VALUES ($1, $2, $3, $4, $5, $6)",
                )
                .bind(one)
                .bind(another)
                .bind(likeness.share)
                .bind(likeness.distance_mm)
                .bind(likeness.offset_mm)
                .bind(shift_s)
                .execute(&mut *transaction)
                .await?;
            }
        }
        for run in found.iter().map(|(other, _)| other.run_id.as_str()).chain([run_id]) {
            sqlx::query(
                "DELETE FROM alike_runs WHERE run_id = $1 AND other_run_id NOT IN (SELECT other_run_id \
                 FROM alike_runs WHERE run_id = $1 ORDER BY share DESC, other_run_id LIMIT $2)",
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
                format!("WHERE alike_runs.run_id IN ({})", numbers.join(", "))
            }
            None => String::new(),
        };
        let sql = format!(
            "SELECT alike_runs.run_id AS of_run, other_run_id, runs.team, runs.k, share, distance_mm, offset_mm, shift_s \
             FROM alike_runs JOIN runs ON runs.run_id = other_run_id {which} ORDER BY share DESC, other_run_id"
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

    /// The pairs of similar runs of a team and a task, or of all, the greatest share first, at most `limit` of them.
    pub async fn similar_pairs(
        &self,
        team: Option<&str>,
        task: Option<&str>,
        limit: u32,
    ) -> Result<Vec<SimilarPair>, StoreError> {
        // A pair can be stored with one of its runs only: the other may have better ones.
        let query = sqlx::query_as(
            "SELECT share, distance_mm, offset_mm, shift_s, run.task, run.k, \
             run.run_id, run.team, run.status, run.score, run.started_at, \
               other.run_id AS other_run_id, other.team AS other_team, other.status AS other_status, \
               other.score AS other_score, other.started_at AS other_started_at \
             FROM alike_runs AS pair JOIN runs AS run ON run.run_id = pair.run_id \
             JOIN runs AS other ON other.run_id = pair.other_run_id \
             WHERE ($1 = '' OR run.team = $1 OR other.team = $1) AND ($2 = '' OR run.task = $2) \
             AND (pair.run_id < pair.other_run_id OR NOT EXISTS (SELECT 1 FROM alike_runs AS back \
               WHERE back.run_id = pair.other_run_id AND back.other_run_id = pair.run_id)) \
             ORDER BY share DESC, distance_mm, run.run_id, other.run_id LIMIT $3",
        );
        let query = query.bind(team.unwrap_or_default().to_owned()).bind(task.unwrap_or_default().to_owned());
        let mut pairs: Vec<SimilarPair> = query.bind(i64::from(limit)).fetch_all(&self.pool()).await?;
        for pair in &mut pairs {
            let [first, second] = &pair.runs;
            if first.started_unix_ms > second.started_unix_ms {
                pair.runs.reverse();
                pair.shift_s = -pair.shift_s;
            }
        }
        Ok(pairs)
    }
}
