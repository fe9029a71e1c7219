//! Replays of runs, and their verification.

use super::audit::NewAuditEntry;
use super::database::Store;
use super::error::StoreError;
use super::number::unix_ms;
use std::collections::BTreeSet;

/// The result of a verification.
#[derive(Clone, Copy, Debug, PartialEq, Eq, strum::IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub(crate) enum VerificationStatus {
    /// The replay reached the same states and the same score.
    Verified,
    /// It did not.
    Rejected,
}

/// A run that waits for its verification.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct UnverifiedRun {
    /// The run.
    pub(crate) run_id: String,
    /// Path of the replay, relative to the data directory.
    pub(crate) replay_path: String,
    /// SHA-256 of the file, hexadecimal.
    pub(crate) replay_sha256: String,
}

from_row!(UnverifiedRun { run_id, replay_path, replay_sha256 });

/// A run whose score is provisional.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ProvisionalRun {
    /// The run.
    pub(crate) run_id: String,
    /// Its team.
    pub(crate) team: String,
    /// Its task.
    pub(crate) task: String,
}

from_row!(ProvisionalRun { run_id, team, task });

impl Store {
    /// The runs whose score is provisional, oldest first.
    pub(crate) async fn provisional_runs(&self) -> Result<Vec<ProvisionalRun>, StoreError> {
        let query = sqlx::query_as(
            "SELECT run_id, team, task FROM runs WHERE status = 'provisional' ORDER BY ended_at, run_id",
        );
        Ok(query.fetch_all(&self.pool()).await?)
    }

    /// Stores path and SHA-256 of another replay of a finished run.
    #[cfg(test)]
    pub(crate) async fn set_replay(&self, run_id: &str, path: &str, sha256: &str) -> Result<(), StoreError> {
        sqlx::query("UPDATE runs SET replay_path = $1, replay_sha256 = $2 WHERE run_id = $3")
            .bind(path)
            .bind(sha256)
            .bind(run_id)
            .execute(&self.pool())
            .await?;
        Ok(())
    }

    /// Path and SHA-256 of a run's replay.
    pub(crate) async fn replay(&self, run_id: &str) -> Result<Option<(String, String)>, StoreError> {
        let row: Option<(Option<String>, Option<String>)> =
            sqlx::query_as("SELECT replay_path, replay_sha256 FROM runs WHERE run_id = $1")
                .bind(run_id)
                .fetch_optional(&self.pool())
                .await?;
        Ok(row.and_then(|(path, sha256)| Some((path?, sha256?))))
    }

    /// Finished runs that wait for their verification, oldest first.
    pub(crate) async fn runs_to_verify(&self) -> Result<Vec<UnverifiedRun>, StoreError> {
        let query = sqlx::query_as(
            "SELECT run_id, replay_path, replay_sha256 FROM runs WHERE status = 'provisional' \
             AND replay_path IS NOT NULL AND replay_sha256 IS NOT NULL ORDER BY ended_at, run_id",
        );
        Ok(query.fetch_all(&self.pool()).await?)
    }

    /// Stores the result of a run's verification. A void run stays void.
    pub(crate) async fn set_verification(
        &self,
        run_id: &str,
        status: VerificationStatus,
        note: Option<&str>,
    ) -> Result<(), StoreError> {
        sqlx::query(
            "UPDATE runs SET status = $1, verify_note = $2, verified_at = $3 \
             WHERE run_id = $4 AND status IN ('provisional', 'verified', 'rejected')",
        )
        .bind(<&str>::from(status))
        .bind(note)
        .bind(unix_ms())
        .bind(run_id)
        .execute(&self.pool())
        .await?;
        Ok(())
    }

    /// The runs whose replays must not be deleted: open and official ones.
    pub(crate) async fn replays_to_keep(&self) -> Result<BTreeSet<String>, StoreError> {
        let query = sqlx::query_scalar(
            "SELECT run_id FROM runs WHERE status = 'open' \
             OR session_id IN (SELECT session_id FROM sessions WHERE mode = 'official')",
        );
        let runs: Vec<String> = query.fetch_all(&self.pool()).await?;
        Ok(runs.into_iter().collect())
    }

    /// Deletes path and SHA-256 of a run's deleted replay.
    pub(crate) async fn forget_replay(&self, run_id: &str) -> Result<(), StoreError> {
        sqlx::query(
            "UPDATE runs SET replay_path = NULL, replay_sha256 = NULL WHERE run_id = $1 AND status <> 'open'",
        )
        .bind(run_id)
        .execute(&self.pool())
        .await?;
        Ok(())
    }

    /// Makes a run wait for its verification again; false if it has no replay or is not verifiable.
    pub(crate) async fn reverify(&self, run_id: &str, entry: &NewAuditEntry<'_>) -> Result<bool, StoreError> {
        let change = sqlx::query(
            "UPDATE runs SET status = 'provisional', verify_note = NULL, verified_at = NULL \
             WHERE run_id = $1 AND status IN ('provisional', 'verified', 'rejected') AND replay_path IS NOT NULL",
        )
        .bind(run_id);
        self.recorded(entry).await?.change_one(change).await
    }

    /// Voids a finished run: it counts for nothing. False if there is none.
    pub(crate) async fn void_run(&self, run_id: &str, entry: &NewAuditEntry<'_>) -> Result<bool, StoreError> {
        let change = sqlx::query(
            "UPDATE runs SET status = 'voided', note = $1 WHERE run_id = $2 AND status NOT IN ('open', 'voided')",
        )
        .bind(entry.reason)
        .bind(run_id);
        self.recorded(entry).await?.change_one(change).await
    }
}
