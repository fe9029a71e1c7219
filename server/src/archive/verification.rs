//! Verifies finished official runs by playing them again, and deletes old practice replays, at the lowest priority.
//!
//! A verdict needs the file and the engine that recorded it. Without them a try gives no verdict: the run keeps its status, and is
//! tried again later, by this server or another one. A missing file whose ticks are stored is written again first.

use super::folder::Archive;
use super::lost_replay::{WriteAgain, WrittenAgain, write_again};
use super::retention::apply_retention;
use crate::watch::Hub;
use palmares_metrics::METRICS;
use palmares_net::auth::{random_hex, sha256_hex};
use palmares_replay::likeness::{Path, compare, verified_path};
use palmares_replay::{Replay, VerifyError, read, word};
use palmares_store::files::blocking::blocking;
use palmares_store::{CLAIM, Claim, MAX_TRIES, RunInScene, RunRecord, Store, StoreError, VerificationStatus};
use palmares_tasks::Task;
use palmares_worlds::compute::{Background, JobPriority};
use serde_json::{Value, json};
use std::future::Future;
use std::sync::Arc;
use std::time::Duration;

/// Longest time between two rounds: tries become due, and other servers leave runs behind.
const ROUND_PERIOD: Duration = Duration::from_secs(5);
/// Number of rounds without a finished run from one application of the retention to the next.
const RETENTION_ROUNDS: u32 = 12;
/// Pauses after the first tries without a verdict: a file may still be copied, a server with the right engine may still start.
const PAUSES: [Duration; MAX_TRIES as usize - 1] =
    [Duration::from_secs(10), Duration::from_secs(60), Duration::from_secs(600), Duration::from_secs(3600)];

/// Verifies runs, and keeps the folder of replays small.
#[derive(Debug)]
pub(crate) struct Verification {
    store: Store,
    archive: Arc<Archive>,
    hub: Arc<Hub>,
    /// Tasks that are not built in.
    tasks: Arc<[Arc<Task>]>,
    /// Permits of its own: verification must not delay the jobs that clients wait for.
    background: Background,
    /// Of this process, in its claims.
    owner: String,
    /// Writes missing replays again; None without a fleet.
    writer: Option<Arc<dyn WriteAgain>>,
    pub(super) pauses: [Duration; MAX_TRIES as usize - 1],
}

impl Verification {
    /// The verification of runs of these tasks and of the built-in ones.
    ///
    /// # Errors
    /// The system has no randomness.
    pub(crate) fn new(
        store: Store,
        archive: Arc<Archive>,
        hub: Arc<Hub>,
        tasks: Arc<[Arc<Task>]>,
    ) -> Result<Self, getrandom::Error> {
        let host = store.host_name().map(|host| format!("{host}/")).unwrap_or_default();
        let (background, owner) = (Background::new(1), host + &random_hex(8)?);
        Ok(Verification { store, archive, hub, tasks, background, owner, writer: None, pauses: PAUSES })
    }

    /// The same verification, which writes missing replays again.
    pub(crate) fn writing(self, writer: Option<Arc<dyn WriteAgain>>) -> Self {
        Verification { writer, ..self }
    }

    /// Verifies until `stopping`. An interrupted verification is repeated, by another server or after the next start.
    pub(crate) async fn run(self, stopping: impl Future<Output = ()>) {
        tokio::pin!(stopping);
        let (mut rounds, mut failed) = (0, false);
        loop {
            let round = async {
                let cleans = rounds == 0;
                rounds = (rounds + 1) % RETENTION_ROUNDS;
                // The try that could not be stored does not count, and its run does not wait for the end of the claim.
                let released = match failed {
                    true => self.store.release_claims(&self.owner).await,
                    false => Ok(()),
                };
                let done = match released {
                    Ok(()) => self.round(cleans).await,
                    error => error,
                };
                failed = done.is_err();
                if let Err(error) = done {
                    tracing::error!(%error, "the database failed; verification continues later");
                }
                if tokio::time::timeout(ROUND_PERIOD, self.archive.wakeup.notified()).await.is_ok() {
                    rounds = 0;
                }
            };
            tokio::select! {
                () = round => {}
                () = &mut stopping => break,
            }
        }
        if let Err(error) = self.store.release_claims(&self.owner).await {
            tracing::warn!(%error, "a claim on a verification ends by itself");
        }
    }

    /// The result of a statement; an error if its connection was lost in the network: the verification goes on with others.
    async fn answered<T>(
        &self,
        statement: impl Future<Output = Result<T, StoreError>>,
    ) -> Result<T, StoreError> {
        self.store.answered(statement).await
    }

    /// Tries every run that is due.
    pub(super) async fn round(&self, cleans: bool) -> Result<(), StoreError> {
        while let Some(claim) = self.claim().await? {
            self.attempt(&claim).await?;
        }
        if cleans {
            self.answered(self.store.note_other_engines()).await?;
            self.answered(apply_retention(&self.store, &self.archive)).await?;
        }
        Ok(())
    }

    async fn claim(&self) -> Result<Option<Claim>, StoreError> {
        match self.answered(self.store.claim_verification(&self.owner)).await? {
            None if self.writer.is_some() => self.answered(self.store.claim_lost_replay(&self.owner)).await,
            claim => Ok(claim),
        }
    }

    /// Tries to verify a run.
    async fn attempt(&self, claim: &Claim) -> Result<(), StoreError> {
        let run_id = claim.run_id.as_str();
        let Some(record) = self.answered(self.store.run(run_id)).await? else { return Ok(()) };
        let checked = tokio::select! {
            checked = self.judge(claim, record) => checked,
            () = self.renew(run_id) => None,
        };
        let Some(checked) = checked else {
            tracing::info!(run = run_id, "the claim on its verification is lost");
            return Ok(());
        };
        let owned = match checked {
            Ok(verdict) => {
                // Before the status: a run with a verdict is not checked again.
                let compared = tokio::select! {
                    compared = self.compare(run_id, verdict.path.clone()) => compared?,
                    () = self.renew(run_id) => None,
                };
                match compared {
                    Some(()) => self.settle(claim, verdict).await?,
                    None => false,
                }
            }
            Err(reason) => {
                let (tries, pause) = (claim.tries, self.pause(claim.tries));
                METRICS.inconclusive(reason.name());
                if tries < MAX_TRIES {
                    tracing::warn!(run = run_id, tries, %reason, "no verdict; tried again after {pause:?}");
                } else {
                    tracing::error!(run = run_id, tries, %reason, "no verdict; not tried again until an organizer orders it");
                }
                let reason = reason.to_string();
                self.answered(self.store.set_inconclusive(&self.owner, run_id, &reason, pause)).await?
            }
        };
        if !owned {
            tracing::info!(run = run_id, "verified elsewhere or ordered again; this try does not count");
        }
        Ok(())
    }

    /// Judges a run. Its replay is written again first if this server cannot get it and the ticks are stored. None if the claim is
    /// lost.
    async fn judge(&self, claim: &Claim, record: RunRecord) -> Option<Result<Verdict, Inconclusive>> {
        let mut claim = claim.clone();
        if let Some(writer) = &self.writer
            && !self.has_replay(&claim).await
        {
            match write_again(&self.store, writer.as_ref(), &self.owner, &claim.run_id).await {
                Ok(WrittenAgain::NoTicks) => {}
                Ok(WrittenAgain::ClaimLost) => return None,
                Ok(WrittenAgain::File { path, sha256 }) => {
                    (claim.replay_path, claim.replay_sha256) = (path, sha256);
                    self.archive.finished.notify_one();
                }
                Err(error) => return Some(Err(Inconclusive::Unwritten(format!("{error:#}")))),
            }
        }
        Some(self.check(claim, record).await)
    }

    /// Whether this server gets the replay as it was written. A part of it may be here: of a host that failed while it recorded.
    async fn has_replay(&self, claim: &Claim) -> bool {
        let (archive, claim) = (self.archive.clone(), claim.clone());
        let read = blocking(move || {
            let bytes = archive.read(&claim.replay_path, &claim.replay_sha256);
            bytes.is_ok_and(|bytes| bytes.is_some_and(|bytes| sha256_hex(&bytes) == claim.replay_sha256))
        });
        read.await.unwrap_or(false)
    }

    /// Plays a run again, in the background.
    async fn check(&self, claim: Claim, record: RunRecord) -> Result<Verdict, Inconclusive> {
        let (archive, tasks) = (self.archive.clone(), self.tasks.clone());
        let job = self.background.run(JobPriority::Idle, move || check(&claim, &record, &archive, &tasks));
        job.await.unwrap_or_else(|error| Err(Inconclusive::Unreadable(error.to_string())))
    }

    /// Renews the claim on a run until it is lost.
    async fn renew(&self, run_id: &str) {
        loop {
            tokio::time::sleep(CLAIM / 3).await;
            match self.answered(self.store.renew_claim(&self.owner, run_id)).await {
                Ok(true) => {}
                Ok(false) => return,
                Err(error) => {
                    tracing::warn!(%error, run = run_id, "the claim on a verification is not renewed")
                }
            }
        }
    }

    /// Compares the path of a run with those of other teams in its scene. None if it cannot be compared here.
    async fn compare(&self, run_id: &str, path: Path) -> Result<Option<()>, StoreError> {
        let others = self.answered(self.store.store_path(run_id, &path)).await?;
        let alike = move || {
            let likeness = |other: RunInScene| {
                let likeness = compare(&path, &Path::of_text(&other.path)?)?;
                Some((other, likeness))
            };
            others.into_iter().filter_map(likeness).collect()
        };
        match self.background.run(JobPriority::Idle, alike).await {
            Ok(found) => self.answered(self.store.store_likeness(run_id, found)).await.map(Some),
            Err(error) => {
                tracing::error!(%error, run = run_id, "the comparison with other runs failed");
                Ok(None)
            }
        }
    }

    /// Stores a verdict.
    async fn settle(&self, claim: &Claim, verdict: Verdict) -> Result<bool, StoreError> {
        let Verdict { status, note, path: _ } = verdict;
        let run_id = claim.run_id.as_str();
        let owned = self.answered(self.store.set_verdict(&self.owner, run_id, status, &note)).await?;
        if owned {
            match status {
                VerificationStatus::Rejected => {
                    tracing::error!(run = run_id, note, "rejected: the run does not replay")
                }
                VerificationStatus::Verified => tracing::info!(run = run_id, note, "verified"),
            }
            if claim.status != <&str>::from(status) {
                self.hub.ranking_changed();
            }
        }
        Ok(owned)
    }

    /// The pause after a number of tries.
    fn pause(&self, tries: i64) -> Duration {
        let last = self.pauses.len() - 1;
        self.pauses[usize::try_from(tries - 1).unwrap_or_default().min(last)]
    }
}

/// The verdict on a run.
struct Verdict {
    status: VerificationStatus,
    note: String,
    /// Path of its hand; empty when it is rejected.
    path: Path,
}

/// Reason why a run cannot be judged here.
#[derive(Debug, thiserror::Error, strum::IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
enum Inconclusive {
    /// There is no file.
    #[error("missing_file: this server has no such replay")]
    MissingFile,
    /// There is no file, and it cannot be written again from the stored ticks.
    #[error("missing_file: it cannot be written again: {0}")]
    Unwritten(String),
    /// The file cannot be read, or the check failed.
    #[error("unreadable: {0}")]
    Unreadable(String),
    /// This server has another engine, task or hand than the run.
    #[error("not_here: {0}")]
    NotHere(String),
}

impl Inconclusive {
    fn name(&self) -> &'static str {
        self.into()
    }
}

/// Plays a run again.
fn check(
    claim: &Claim,
    record: &RunRecord,
    archive: &Archive,
    tasks: &[Arc<Task>],
) -> Result<Verdict, Inconclusive> {
    let bytes = archive.read(&claim.replay_path, &claim.replay_sha256);
    let bytes = bytes.map_err(|error| Inconclusive::Unreadable(error.to_string()))?;
    let bytes = bytes.ok_or(Inconclusive::MissingFile)?;
    let result = (|| -> Result<_, VerifyError> {
        let replay = read(&bytes)?;
        archive.signed(&replay)?;
        if replay.sha256 != claim.replay_sha256 {
            return Err(VerifyError::BadSignature(
                "it is not the file that was written at the end of the run".into(),
            ));
        }
        same_run(record, &replay)?;
        verified_path(&replay, tasks)
    })();
    match result {
        Ok((verified, path)) => {
            let note = format!("{} ticks, {} states equal", verified.ticks, verified.states);
            Ok(Verdict { status: VerificationStatus::Verified, note, path })
        }
        // The file is the right one, but this server cannot play it.
        Err(
            refused @ (VerifyError::OtherEngine(_)
            | VerifyError::OtherPhysics(_)
            | VerifyError::OtherTask(_)
            | VerifyError::OtherHand(_)),
        ) => Err(Inconclusive::NotHere(format!("{}: {refused}", refused.name()))),
        Err(refused) => Ok(Verdict {
            status: VerificationStatus::Rejected,
            note: format!("{}: {refused}", refused.name()),
            path: Path::default(),
        }),
    }
}

/// Compares a replay's header and outcome with the database.
fn same_run(record: &RunRecord, replay: &Replay) -> Result<(), VerifyError> {
    // Strings, numbers and lists: encoding cannot fail.
    let record = serde_json::to_value(record).unwrap_or_default();
    let (header, outcome) = (&replay.header, &replay.outcome);
    let replayed = json!({
        "run_id": header.run_id, "team": header.team, "task": header.task, "hand": header.hand,
        "sensing": word(&header.sensing), "seed_hex": header.seed.to_hex(), "score": outcome.score,
        "ticks": outcome.ticks, "state_hash": outcome.state_hash, "reason": word(&outcome.reason),
    });
    let differs = replayed
        .as_object()
        .and_then(|fields| fields.iter().find(|(field, value)| record.get(field) != Some(value)));
    match differs {
        Some((field, value)) => {
            let stored = record.get(field).unwrap_or(&Value::Null);
            Err(VerifyError::ScoreDiffers(format!(
                "{field} is {value} in the replay, {stored} in the database"
            )))
        }
        None => Ok(()),
    }
}
