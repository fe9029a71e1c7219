//! Replays of runs, and their verification.
//!
//! A run waits for its verification while it is provisional, or since an organizer ordered it again. Several servers can share the
//! work: each claims one run at a time, for a while. A verdict counts only while the claim is its writer's.

use super::audit::NewAuditEntry;
use super::database::Store;
use super::error::StoreError;
use super::number::unix_ms;
use palmares_tasks::identity;
use sqlx::AssertSqlSafe;
use std::collections::BTreeSet;
use std::time::Duration;

/// Tries without a verdict after which a run waits for an organizer's order.
pub const MAX_TRIES: i64 = 5;

/// Tries without a verdict from which a run is stuck: the next try is minutes away, and will end in the same way unless somebody mends
/// the cause.
pub(super) const STUCK_TRIES: i64 = 3;

/// The condition that a waiting run is stuck: also if its engine is another one, since all hosts have the same.
const STUCK: &str = "(verify_owner IS NULL AND verify_tries >= $1 OR engine IS NOT NULL AND engine <> $2)";

/// Length of a claim; its owner renews it.
pub const CLAIM: Duration = Duration::from_secs(60);

/// Time after the end of a host's lease from which its replays are written again elsewhere: it may be back.
const GONE: Duration = Duration::from_secs(4);

/// The condition that a run waits for its verification.
const WAITING: &str = "(status = 'provisional' OR verify_since IS NOT NULL AND status IN ('verified', 'rejected')) \
     AND replay_sha256 IS NOT NULL";

/// The result of a verification.
#[derive(Clone, Copy, Debug, PartialEq, Eq, strum::IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum VerificationStatus {
    /// The replay reached the same states and the same score.
    Verified,
    /// It did not.
    Rejected,
}

/// A run that this process verifies.
#[derive(Clone, Debug, PartialEq)]
pub struct Claim {
    /// The run.
    pub run_id: String,
    /// Its status before the verdict.
    pub status: String,
    /// Path of the replay, relative to the data directory.
    pub replay_path: String,
    /// SHA-256 of the file, hexadecimal.
    pub replay_sha256: String,
    /// Number of this try, from 1.
    pub tries: i64,
}

from_row!(Claim { run_id, status, replay_path, replay_sha256, tries: "verify_tries" });

/// A replay that waits for its upload.
#[derive(Clone, Debug, PartialEq)]
pub struct UnstoredReplay {
    /// The run.
    pub run_id: String,
    /// Path, relative to the data directory.
    pub replay_path: String,
    /// SHA-256 of the file, hexadecimal.
    pub replay_sha256: String,
}

from_row!(UnstoredReplay { run_id, replay_path, replay_sha256 });

/// A run whose replay is missing, for another one from its stored ticks.
#[derive(Clone, Debug, PartialEq)]
pub struct LostRun {
    /// The run.
    pub run_id: String,
    /// Its team.
    pub team: String,
    /// Header of its replay as JSON.
    pub header: String,
    /// Reason of its end.
    pub reason: String,
    /// Time of its end, ms since 1970 UTC.
    pub ended_unix_ms: i64,
}

from_row!(LostRun { run_id, team, header, reason, ended_unix_ms: "ended_at" });

/// What the database knows about the replay of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedReplay {
    /// Status of the run.
    pub status: String,
    /// Number of the run, if it is official.
    pub k: Option<i64>,
    /// SHA-256 of the file, hexadecimal.
    pub replay_sha256: Option<String>,
    /// The host of a fleet that recorded it.
    pub replay_host: Option<String>,
}

from_row!(RecordedReplay { status, k, replay_sha256, replay_host });

/// The runs that wait for their verification.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VerificationQueue {
    /// Runs that will be tried soon, or are being tried.
    pub waiting: i64,
    /// Since when the oldest of them waits, ms since 1970 UTC.
    pub oldest_unix_ms: Option<i64>,
    /// Runs without a verdict after [`STUCK_TRIES`] tries, or of another engine.
    pub stuck: i64,
}

from_row!(VerificationQueue { waiting, oldest_unix_ms: "oldest", stuck });

impl VerificationQueue {
    /// How long the oldest run waits; zero if none does.
    pub fn oldest(&self) -> Duration {
        let waited = self.oldest_unix_ms.map_or(0, |since| unix_ms() - since);
        Duration::from_millis(u64::try_from(waited).unwrap_or_default())
    }
}

fn ms(length: Duration) -> i64 {
    i64::try_from(length.as_millis()).unwrap_or(i64::MAX)
}

/// A run whose score is provisional.
#[derive(Clone, Debug, PartialEq)]
pub struct ProvisionalRun {
    /// The run.
    pub run_id: String,
    /// Its team.
    pub team: String,
    /// Its task.
    pub task: String,
}

from_row!(ProvisionalRun { run_id, team, task });

impl Store {
    /// The runs whose score is provisional, oldest first.
    pub async fn provisional_runs(&self) -> Result<Vec<ProvisionalRun>, StoreError> {
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
    pub async fn replay(&self, run_id: &str) -> Result<Option<(String, String)>, StoreError> {
        let row: Option<(Option<String>, Option<String>)> =
            sqlx::query_as("SELECT replay_path, replay_sha256 FROM runs WHERE run_id = $1")
                .bind(run_id)
                .fetch_optional(&self.pool())
                .await?;
        Ok(row.and_then(|(path, sha256)| Some((path?, sha256?))))
    }

    /// Whether an official run has a replay.
    pub async fn has_official_replays(&self) -> Result<bool, StoreError> {
        let query = "SELECT COUNT(*) FROM runs WHERE k IS NOT NULL AND replay_sha256 IS NOT NULL";
        let count: i64 = sqlx::query_scalar(query).fetch_one(&self.pool()).await?;
        Ok(count > 0)
    }

    /// Claims the run that waits longest, for [`CLAIM`]: of this engine, and with its replay on this host or in the shared
    /// storage.
    pub async fn claim_verification(&self, owner: &str) -> Result<Option<Claim>, StoreError> {
        let (now, locked) = (self.dialect.now_ms(), self.dialect.lock_rows_of("runs"));
        let sql = format!(
            "UPDATE runs SET verify_owner = $1, verify_until = {now} + $2, verify_tries = verify_tries + 1 \
             WHERE run_id = (SELECT run_id FROM runs WHERE {WAITING} AND replay_path IS NOT NULL \
             AND verify_tries < $3 AND (verify_until IS NULL OR verify_until < {now}) \
             AND (engine IS NULL OR engine = $4) \
             AND (replay_stored_at IS NOT NULL OR replay_host IS NULL OR replay_host = $5) \
             ORDER BY COALESCE(verify_since, ended_at), run_id LIMIT 1{locked}) \
             RETURNING run_id, status, replay_path, replay_sha256, verify_tries"
        );
        let query = sqlx::query_as(AssertSqlSafe(sql)).bind(owner).bind(ms(CLAIM)).bind(MAX_TRIES);
        let query = query.bind(identity::engine()).bind(self.host.host_id.clone());
        Ok(query.fetch_all(&self.pool()).await?.pop())
    }

    /// Claims a run whose host is gone before anybody else had its replay, but with its ticks stored: also a verified one, whose
    /// replay is to be written again. The claim of the host that is gone has ended with it.
    pub async fn claim_lost_replay(&self, owner: &str) -> Result<Option<Claim>, StoreError> {
        if !self.host.fleet {
            return Ok(None);
        }
        let (now, locked) = (self.dialect.now_ms(), self.dialect.lock_rows_of("runs"));
        let sql = format!(
            "UPDATE runs SET verify_owner = $1, verify_until = {now} + $2, verify_tries = verify_tries + 1 \
             WHERE run_id = (SELECT run_id FROM runs WHERE run_id IN (SELECT run_id FROM run_actions) \
             AND status IN ('provisional', 'verified') AND replay_stored_at IS NULL AND replay_path IS NOT NULL \
             AND replay_sha256 IS NOT NULL AND engine = $4 AND replay_host <> $5 \
             AND verify_tries < $3 AND (verify_until IS NULL OR verify_until < {now} \
             OR verify_owner LIKE replay_host || '/%') AND NOT EXISTS (SELECT 1 FROM hosts \
             WHERE hosts.host_id = runs.replay_host AND hosts.lease_until >= {now} - $6) \
             ORDER BY ended_at, run_id LIMIT 1{locked}) \
             RETURNING run_id, status, replay_path, replay_sha256, verify_tries"
        );
        let query = sqlx::query_as(AssertSqlSafe(sql)).bind(owner).bind(ms(CLAIM)).bind(MAX_TRIES);
        let query = query.bind(identity::engine()).bind(self.host.host_id.clone()).bind(ms(GONE));
        Ok(query.fetch_all(&self.pool()).await?.pop())
    }

    /// Makes a run wait for its verification again: its replay is not where it should be. It keeps its status until the verdict.
    pub async fn verify_again(&self, run_id: &str) -> Result<(), StoreError> {
        sqlx::query("UPDATE runs SET verify_since = $1 WHERE run_id = $2 AND status = 'verified'")
            .bind(unix_ms())
            .bind(run_id)
            .execute(&self.pool())
            .await?;
        Ok(())
    }

    /// Renews a claim; false if it is lost.
    pub async fn renew_claim(&self, owner: &str, run_id: &str) -> Result<bool, StoreError> {
        let now = self.dialect.now_ms();
        let sql =
            format!("UPDATE runs SET verify_until = {now} + $1 WHERE run_id = $2 AND verify_owner = $3");
        let query = sqlx::query(AssertSqlSafe(sql)).bind(ms(CLAIM)).bind(run_id).bind(owner);
        Ok(query.execute(&self.pool()).await?.rows_affected() == 1)
    }

    /// Gives all claims of a process back; its tries in progress do not count.
    pub async fn release_claims(&self, owner: &str) -> Result<(), StoreError> {
        sqlx::query(
            "UPDATE runs SET verify_owner = NULL, verify_until = NULL, verify_tries = verify_tries - 1 \
             WHERE verify_owner = $1",
        )
        .bind(owner)
        .execute(&self.pool())
        .await?;
        Ok(())
    }

    /// Stores a verdict; false if the claim is lost. A void run stays void.
    pub async fn set_verdict(
        &self,
        owner: &str,
        run_id: &str,
        status: VerificationStatus,
        note: &str,
    ) -> Result<bool, StoreError> {
        let query = sqlx::query(
            "UPDATE runs SET status = $1, verify_note = $2, verified_at = $3, verify_since = NULL, \
             verify_owner = NULL, verify_until = NULL, verify_tries = 0, verify_problem = NULL \
             WHERE run_id = $4 AND verify_owner = $5 AND status IN ('provisional', 'verified', 'rejected')",
        )
        .bind(<&str>::from(status))
        .bind(note)
        .bind(unix_ms())
        .bind(run_id)
        .bind(owner);
        Ok(query.execute(&self.pool()).await?.rows_affected() == 1)
    }

    /// Notes why a try gave no verdict, and gives the claim back. The next try is after `pause`. False if the claim is lost.
    pub async fn set_inconclusive(
        &self,
        owner: &str,
        run_id: &str,
        problem: &str,
        pause: Duration,
    ) -> Result<bool, StoreError> {
        let now = self.dialect.now_ms();
        let sql = format!(
            "UPDATE runs SET verify_problem = $1, verify_owner = NULL, verify_until = {now} + $2 \
             WHERE run_id = $3 AND verify_owner = $4"
        );
        let query = sqlx::query(AssertSqlSafe(sql)).bind(problem).bind(ms(pause)).bind(run_id).bind(owner);
        Ok(query.execute(&self.pool()).await?.rows_affected() == 1)
    }

    /// Notes with runs of other engines why they wait.
    pub async fn note_other_engines(&self) -> Result<(), StoreError> {
        let sql = format!(
            "UPDATE runs SET verify_problem = 'not_here: other_engine: recorded by engine ' || engine || ', this server has ' || $1 \
             WHERE {WAITING} AND engine <> $1 AND verify_problem IS NULL"
        );
        sqlx::query(AssertSqlSafe(sql)).bind(identity::engine()).execute(&self.pool()).await?;
        Ok(())
    }

    /// The runs that wait for their verification.
    pub async fn verification_queue(&self) -> Result<VerificationQueue, StoreError> {
        // The counts are cast: the sum of integers is a decimal in Postgres, which the driver for both databases cannot read.
        let sql = format!(
            "SELECT CAST(COALESCE(SUM(CASE WHEN {STUCK} THEN 0 ELSE 1 END), 0) AS BIGINT) AS waiting, \
             CAST(COALESCE(SUM(CASE WHEN {STUCK} THEN 1 ELSE 0 END), 0) AS BIGINT) AS stuck, \
             MIN(CASE WHEN {STUCK} THEN NULL ELSE COALESCE(verify_since, ended_at) END) AS oldest \
             FROM runs WHERE {WAITING}"
        );
        Ok(sqlx::query_as(AssertSqlSafe(sql))
            .bind(STUCK_TRIES)
            .bind(identity::engine())
            .fetch_one(&self.pool())
            .await?)
    }

    /// The runs whose replays must stay in the data directory: open and official ones, except official ones in the shared storage if
    /// this server has one.
    pub async fn replays_to_keep(&self, shared: bool) -> Result<BTreeSet<String>, StoreError> {
        let query = sqlx::query_scalar(
            "SELECT run_id FROM runs WHERE status = 'open' \
             OR (session_id IN (SELECT session_id FROM sessions WHERE mode = 'official') \
             AND (replay_stored_at IS NULL OR $1 = 0))",
        );
        let runs: Vec<String> = query.bind(i64::from(shared)).fetch_all(&self.pool()).await?;
        Ok(runs.into_iter().collect())
    }

    /// What the database knows about the replay of a run.
    pub async fn recorded_replay(&self, run_id: &str) -> Result<Option<RecordedReplay>, StoreError> {
        let query =
            sqlx::query_as("SELECT status, k, replay_sha256, replay_host FROM runs WHERE run_id = $1");
        Ok(query.bind(run_id).fetch_optional(&self.pool()).await?)
    }

    /// Whether a stored host is this one; without a host all files are here.
    pub fn is_here(&self, host: Option<&str>) -> bool {
        host.is_none_or(|host| host == self.host.host_id)
    }

    /// Replays of this host that are not in the shared storage yet, oldest first.
    pub async fn unstored_replays(&self) -> Result<Vec<UnstoredReplay>, StoreError> {
        let query = sqlx::query_as(
            "SELECT run_id, replay_path, replay_sha256 FROM runs WHERE replay_stored_at IS NULL \
             AND replay_path IS NOT NULL AND replay_sha256 IS NOT NULL AND status <> 'open' \
             AND (replay_host IS NULL OR replay_host = $1) ORDER BY ended_at, run_id",
        );
        Ok(query.bind(self.host.host_id.clone()).fetch_all(&self.pool()).await?)
    }

    /// Notes that the shared storage has a replay.
    pub async fn replay_stored(&self, run_id: &str, sha256: &str) -> Result<(), StoreError> {
        sqlx::query("UPDATE runs SET replay_stored_at = $1 WHERE run_id = $2 AND replay_sha256 = $3")
            .bind(unix_ms())
            .bind(run_id)
            .bind(sha256)
            .execute(&self.pool())
            .await?;
        Ok(())
    }

    /// What is needed to write a run's replay again from its stored ticks; None if there are none.
    pub async fn lost_run(&self, run_id: &str) -> Result<Option<LostRun>, StoreError> {
        let query = sqlx::query_as(
            "SELECT run_id, team, header, reason, ended_at FROM runs WHERE run_id = $1 AND header IS NOT NULL \
             AND reason IS NOT NULL AND ended_at IS NOT NULL \
             AND EXISTS (SELECT 1 FROM run_actions WHERE run_actions.run_id = runs.run_id)",
        );
        Ok(query.bind(run_id).fetch_optional(&self.pool()).await?)
    }

    /// Stores path and SHA-256 of a replay that this host has written again; false if the claim on the run is lost.
    pub async fn replay_written_again(
        &self,
        owner: &str,
        run_id: &str,
        path: &str,
        sha256: &str,
    ) -> Result<bool, StoreError> {
        let query = sqlx::query(
            "UPDATE runs SET replay_path = $1, replay_sha256 = $2, replay_host = $3, replay_stored_at = NULL \
             WHERE run_id = $4 AND verify_owner = $5",
        );
        let query = query.bind(path).bind(sha256).bind(self.host_name()).bind(run_id).bind(owner);
        Ok(query.execute(&self.pool()).await?.rows_affected() == 1)
    }

    /// Deletes path and SHA-256 of a run's deleted replay.
    pub async fn forget_replay(&self, run_id: &str) -> Result<(), StoreError> {
        sqlx::query(
            "UPDATE runs SET replay_path = NULL, replay_sha256 = NULL, replay_stored_at = NULL WHERE run_id = $1 AND status <> 'open'",
        )
        .bind(run_id)
        .execute(&self.pool())
        .await?;
        Ok(())
    }

    /// Makes a run wait for its verification again, from its first try; false if it has no replay or is not verifiable. It keeps its
    /// status until the verdict. A verification in progress loses its claim.
    pub async fn reverify(&self, run_id: &str, entry: &NewAuditEntry<'_>) -> Result<bool, StoreError> {
        let change = sqlx::query(
            "UPDATE runs SET verify_since = $1, verify_owner = NULL, verify_until = NULL, verify_tries = 0, \
             verify_problem = NULL WHERE run_id = $2 AND status IN ('provisional', 'verified', 'rejected') \
             AND replay_sha256 IS NOT NULL",
        )
        .bind(unix_ms())
        .bind(run_id);
        self.recorded(entry).await?.change_one(change).await
    }

    /// Voids a finished run: it counts for nothing. False if there is none.
    pub async fn void_run(&self, run_id: &str, entry: &NewAuditEntry<'_>) -> Result<bool, StoreError> {
        let change = sqlx::query(
            "UPDATE runs SET status = 'voided', note = $1 WHERE run_id = $2 AND status NOT IN ('open', 'voided')",
        )
        .bind(entry.reason)
        .bind(run_id);
        self.recorded(entry).await?.change_one(change).await
    }
}
