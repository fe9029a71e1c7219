//! Looks at finished runs when nobody needs the machine: plays official ones again, and deletes old practice replays.

use super::folder::Archive;
use super::retention::apply_retention;
use crate::compute::{Background, Level};
use crate::fingerprint::Marks;
use crate::store::{RunRecord, Store, StoreError, UnverifiedRun, Verdict};
use crate::watch::Hub;
use palmares_replay::{Replay, VerifyError, read, verify, word};
use palmares_tasks::Task;
use serde_json::{Value, json};
use std::future::Future;
use std::io::ErrorKind;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Looks at the runs at least so often, for what went wrong the last time.
const AGAIN_AFTER: Duration = Duration::from_secs(60);

/// Verifies runs of these tasks and of the program's, and tidies up, until `stopping`. A verification that is cut off is made again at the next start.
pub(crate) async fn audit(
    store: Store,
    archive: Arc<Archive>,
    hub: Arc<Hub>,
    tasks: Arc<[Arc<Task>]>,
    stopping: impl Future<Output = ()>,
) {
    // Its own places: what nobody waits for must not keep those out for whom somebody waits.
    let background = Background::new(1);
    tokio::pin!(stopping);
    loop {
        let round = async {
            if let Err(error) = round(&store, &archive, &hub, &tasks, &background).await {
                tracing::error!(%error, "store failed; verification goes on later");
            }
            let _ = tokio::time::timeout(AGAIN_AFTER, archive.news.notified()).await;
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
        let job = move || judge(&path, &run, &record, &key, &tasks);
        let Judged { verdict, note, marks } = match background.run(Level::Idle, job).await {
            Ok(Ok(judged)) => judged,
            Ok(Err(error)) => {
                tracing::error!(%error, run = run_id, "the replay cannot be read; tried again later");
                continue;
            }
            Err(error) => {
                tracing::error!(%error, run = run_id, "verification failed; tried again later");
                continue;
            }
        };
        match verdict {
            Verdict::Rejected => tracing::error!(run = run_id, note, "rejected: the run does not replay"),
            _ => tracing::info!(run = run_id, note, "verified"),
        }
        // First: a run that is no longer provisional is not looked at again.
        store.compare_actions(&run_id, &marks).await?;
        store.set_verdict(&run_id, verdict, Some(&note)).await?;
        hub.ranking_changed();
    }
    apply_retention(store, archive).await
}

/// What playing a run again has shown.
struct Judged {
    verdict: Verdict,
    note: String,
    /// Of its actions; none when it was rejected.
    marks: Marks,
}

/// Plays a run again. An error is one of reading, which says nothing about the run.
fn judge(
    path: &PathBuf,
    run: &UnverifiedRun,
    record: &RunRecord,
    archive: &Archive,
    tasks: &[Arc<Task>],
) -> std::io::Result<Judged> {
    let rejected = |note: String| Judged { verdict: Verdict::Rejected, note, marks: Marks::default() };
    let bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == ErrorKind::NotFound => {
            return Ok(rejected("not_a_replay: the file is gone".into()));
        }
        Err(error) => return Err(error),
    };
    let verdict = (|| -> Result<_, VerifyError> {
        let replay = read(&bytes)?;
        replay.signed_by(Some(&archive.key()))?;
        if replay.sha256 != run.replay_sha256 {
            return Err(VerifyError::BadSignature(
                "it is not the file that was written at the end of the run".into(),
            ));
        }
        same_run(record, &replay)?;
        Ok((verify(&replay, tasks)?, Marks::of(replay.actions.iter().map(|tick| &tick.action))))
    })();
    Ok(match verdict {
        Ok((verified, marks)) => {
            let note = format!("{} ticks, {} states equal", verified.ticks, verified.states);
            Judged { verdict: Verdict::Verified, note, marks }
        }
        Err(refused) => rejected(format!("{}: {refused}", refused.name())),
    })
}

/// Whether a replay tells what the database tells.
fn same_run(record: &RunRecord, replay: &Replay) -> Result<(), VerifyError> {
    // Strings, numbers and lists only: cannot fail.
    let record = serde_json::to_value(record).unwrap_or_default();
    let (header, outcome) = (&replay.header, &replay.outcome);
    let told = json!({
        "run_id": header.run_id, "team": header.team, "task": header.task, "hand": header.hand,
        "sensing": word(&header.sensing), "seed_hex": header.seed.to_hex(), "score": outcome.score,
        "ticks": outcome.ticks, "state_hash": outcome.state_hash, "reason": word(&outcome.reason),
    });
    let differs =
        told.as_object().and_then(|told| told.iter().find(|(field, value)| record.get(field) != Some(value)));
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
