//! Runs of different teams with the same actions.

use super::audit::NewAuditEntry;
use super::database::Store;
use super::error::StoreError;
use super::number::signed;
use crate::fingerprint::{Fingerprint, is_reportable};
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;

/// Rows for each statement: three values each, well below the limits of the databases.
const BATCH: usize = 200;

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

/// A mark shared with another team's run: id, team and changes of that run, and the places of the mark in both.
type Shared = (String, String, i64, i64, i64);

impl Store {
    /// Stores the fingerprint of a run and compares it with those of other teams' runs of the task. Reportable matches are stored with both
    /// runs and, the first time, recorded in the audit.
    pub(crate) async fn compare_actions(
        &self,
        run_id: &str,
        fingerprint: &Fingerprint,
    ) -> Result<(), StoreError> {
        let mut transaction = self.write().await?;
        sqlx::query("DELETE FROM action_marks WHERE run_id = $1")
            .bind(run_id)
            .execute(&mut *transaction)
            .await?;
        sqlx::query("UPDATE runs SET action_changes = $1 WHERE run_id = $2")
            .bind(signed(fingerprint.changes))
            .bind(run_id)
            .execute(&mut *transaction)
            .await?;
        for batch in fingerprint.marks.chunks(BATCH) {
            let rows: Vec<String> =
                (0..batch.len()).map(|k| format!("($1, ${}, ${})", 2 * k + 2, 2 * k + 3)).collect();
            let sql = format!("INSERT INTO action_marks (run_id, hash, place) VALUES {}", rows.join(", "));
            let mut query = sqlx::query(sqlx::AssertSqlSafe(sql)).bind(run_id.to_owned());
            for mark in batch {
                query = query.bind(mark.hash).bind(mark.place);
            }
            query.execute(&mut *transaction).await?;
        }
        let shared: Vec<Shared> = sqlx::query_as(
            "SELECT theirs.run_id, other.team, COALESCE(other.action_changes, 0), mine.place, theirs.place \
             FROM action_marks AS mine JOIN action_marks AS theirs ON theirs.hash = mine.hash \
             JOIN runs AS own ON own.run_id = mine.run_id JOIN runs AS other ON other.run_id = theirs.run_id \
             WHERE mine.run_id = $1 AND other.team <> own.team AND other.task = own.task",
        )
        .bind(run_id)
        .fetch_all(&mut *transaction)
        .await?;
        let mut others: BTreeMap<(String, String, i64), Vec<(i64, i64)>> = BTreeMap::new();
        for (other, team, changes, here, there) in shared {
            others.entry((other, team, changes)).or_default().push((here, there));
        }
        let mut reasons = Vec::new();
        for ((other, team, changes), places) in others {
            let longest = fingerprint.longest(&places);
            if !is_reportable(longest, (fingerprint.changes, changes.unsigned_abs())) {
                continue;
            }
            for (one, another) in [(run_id, other.as_str()), (other.as_str(), run_id)] {
                let stored = sqlx::query(
                    "INSERT INTO similar_runs (run_id, other_run_id, changes) VALUES ($1, $2, $3) \
                     ON CONFLICT (run_id, other_run_id) DO NOTHING",
                )
                .bind(one)
                .bind(another)
                .bind(signed(longest))
                .execute(&mut *transaction)
                .await?
                .rows_affected();
                if stored == 1 && one == run_id {
                    reasons.push(format!(
                        "at least {longest} changes of its action are those of run {other} of team {team}"
                    ));
                }
            }
        }
        transaction.commit().await?;
        for reason in reasons {
            let entry = NewAuditEntry {
                actor: "server",
                action: "run.similar",
                subject: run_id,
                reason: Some(&reason),
            };
            self.record(&entry).await?;
        }
        Ok(())
    }

    /// The similar runs of one run, or of all, by run.
    pub(super) async fn similar_runs(
        &self,
        run_id: Option<&str>,
    ) -> Result<BTreeMap<String, Vec<SimilarRun>>, StoreError> {
        use sqlx::{FromRow, Row};
        let rows = sqlx::query(
            "SELECT similar_runs.run_id AS of_run, other_run_id, runs.team, runs.k, changes FROM similar_runs \
             JOIN runs ON runs.run_id = other_run_id WHERE similar_runs.run_id = $1 OR $2 = 1 \
             ORDER BY changes DESC, other_run_id",
        )
        .bind(run_id.unwrap_or_default().to_owned())
        .bind(i64::from(run_id.is_none()))
        .fetch_all(&self.pool())
        .await?;
        let mut found: BTreeMap<String, Vec<SimilarRun>> = BTreeMap::new();
        for row in &rows {
            found.entry(row.try_get("of_run")?).or_default().push(SimilarRun::from_row(row)?);
        }
        Ok(found)
    }
}
