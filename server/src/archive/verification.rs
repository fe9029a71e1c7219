//! Verifies finished official runs by playing them again, and deletes old practice replays, at the lowest priority.

use super::folder::Archive;
use super::retention::apply_retention;
use crate::compute::{Background, JobPriority};
use crate::fingerprint::Fingerprint;
use crate::store::{RunRecord, Store, StoreError, UnverifiedRun, VerificationStatus};
use crate::watch::Hub;
use palmares_replay::{Replay, VerifyError, read, verify, word};
use palmares_tasks::Task;
use serde_json::{Value, json};
use std::future::Future;
use std::io::ErrorKind;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Longest time between two rounds: a failed verification is tried again.
const ROUND_PERIOD: Duration = Duration::from_secs(60);

/// Verifies runs of these tasks and of the built-in ones, and applies the retention, until `stopping`. An interrupted verification is
/// repeated after the next start.
pub(crate) async fn verify_runs(
    store: Store,
    archive: Arc<Archive>,
    hub: Arc<Hub>,
    tasks: Arc<[Arc<Task>]>,
    stopping: impl Future<Output = ()>,
) {
    // Permits of its own: verification must not delay the jobs that clients wait for.
    let background = Background::new(1);
    tokio::pin!(stopping);
    loop {
        let round = async {
            if let Err(error) = round(&store, &archive, &hub, &tasks, &background).await {
                tracing::error!(%error, "the database failed; verification continues later");
            }
            let _ = tokio::time::timeout(ROUND_PERIOD, archive.wakeup.notified()).await;
        };
        tokio::select! {
            () = round => {}
            () = &mut stopping => return,
        }
    }
}

async fn round(
    store: &Store,
    archive: &Arc<Archive>,
    hub: &Hub,
    tasks: &Arc<[Arc<Task>]>,
    background: &Background,
) -> Result<(), StoreError> {
    for run in store.runs_to_verify().await? {
        let Some(record) = store.run(&run.run_id).await? else { continue };
        let (path, run_id) = (archive.locate(&run.replay_path), run.run_id.clone());
        let (key, tasks) = (archive.clone(), tasks.clone());
        let job = move || check(&path, &run, &record, &key, &tasks);
        let Checked { status, note, fingerprint } = match background.run(JobPriority::Idle, job).await {
            Ok(Ok(checked)) => checked,
            Ok(Err(error)) => {
                tracing::error!(%error, run = run_id, "the replay cannot be read; tried again later");
                continue;
            }
            Err(error) => {
                tracing::error!(%error, run = run_id, "verification failed; tried again later");
                continue;
            }
        };
        match status {
            VerificationStatus::Rejected => {
                tracing::error!(run = run_id, note, "rejected: the run does not replay")
            }
            _ => tracing::info!(run = run_id, note, "verified"),
        }
        // Before the status: a run that is no longer provisional is not checked again.
        store.compare_actions(&run_id, &fingerprint).await?;
        store.set_verification(&run_id, status, Some(&note)).await?;
        hub.ranking_changed();
    }
    apply_retention(store, archive).await
}

/// The result of playing a run again.
struct Checked {
    status: VerificationStatus,
    note: String,
    /// Fingerprint of its actions; empty when it is rejected.
    fingerprint: Fingerprint,
}

/// Plays a run again. An error means that the file could not be read, and does not reject the run.
fn check(
    path: &PathBuf,
    run: &UnverifiedRun,
    record: &RunRecord,
    archive: &Archive,
    tasks: &[Arc<Task>],
) -> std::io::Result<Checked> {
    let rejected = |note: String| Checked {
        status: VerificationStatus::Rejected,
        note,
        fingerprint: Fingerprint::default(),
    };
    let bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == ErrorKind::NotFound => {
            return Ok(rejected("not_a_replay: the file is gone".into()));
        }
        Err(error) => return Err(error),
    };
    let result = (|| -> Result<_, VerifyError> {
        let replay = read(&bytes)?;
        archive.signed(&replay)?;
        if replay.sha256 != run.replay_sha256 {
            return Err(VerifyError::BadSignature(
                "it is not the file that was written at the end of the run".into(),
            ));
        }
        same_run(record, &replay)?;
        Ok((verify(&replay, tasks)?, Fingerprint::of(replay.actions.iter().map(|tick| &tick.action))))
    })();
    Ok(match result {
        Ok((verified, fingerprint)) => {
            let note = format!("{} ticks, {} states equal", verified.ticks, verified.states);
            Checked { status: VerificationStatus::Verified, note, fingerprint }
        }
        Err(refused) => rejected(format!("{}: {refused}", refused.name())),
    })
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
