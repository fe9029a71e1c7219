//! A replay whose host was lost before anybody else had the file.

use super::folder::stored_path;
use palmares_replay::ReplayFile;
use palmares_store::{LostRun, NewAuditEntry, Store};
use std::fmt::Debug;
use std::future::Future;
use std::pin::Pin;

/// Writes the replay of a run again from its stored ticks, into the data directory of this server.
pub(crate) trait WriteAgain: Debug + Send + Sync {
    /// The replay, with the same chain. Also with the same bytes, if the lost one was recorded by one host.
    fn write_again<'a>(
        &'a self,
        run: &'a LostRun,
    ) -> Pin<Box<dyn Future<Output = anyhow::Result<ReplayFile>> + Send + 'a>>;
}

/// The result of an attempt to write a replay again.
pub(super) enum WrittenAgain {
    /// Path and SHA-256, as stored with the run.
    File { path: String, sha256: String },
    /// There are no ticks.
    NoTicks,
    /// Another process has the claim.
    ClaimLost,
}

/// Writes a missing replay again, and stores its path with the run that `owner` has claimed.
pub(super) async fn write_again(
    store: &Store,
    writer: &dyn WriteAgain,
    owner: &str,
    run_id: &str,
) -> anyhow::Result<WrittenAgain> {
    let Some(run) = store.answered(store.lost_run(run_id)).await? else { return Ok(WrittenAgain::NoTicks) };
    let before = store.answered(store.replay(run_id)).await?.map(|(_, sha256)| sha256);
    let file = writer.write_again(&run).await?;
    let (path, sha256) = (stored_path(&file), file.sha256);
    if !store.answered(store.replay_written_again(owner, run_id, &path, &sha256)).await? {
        return Ok(WrittenAgain::ClaimLost);
    }
    let same = before.as_deref() == Some(sha256.as_str());
    let bytes = if same { "the same bytes" } else { "the same actions and states, other poses" };
    let reason = format!("its host was lost before the upload; written again from the stored ticks: {bytes}");
    tracing::warn!(run = run_id, sha256, same, "a missing replay was written again from the stored ticks");
    let entry =
        NewAuditEntry { actor: "server", action: "replay.rewrite", subject: run_id, reason: Some(&reason) };
    store.answered(store.record(&entry)).await?;
    Ok(WrittenAgain::File { path, sha256 })
}
