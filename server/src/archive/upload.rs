//! Uploads replays and hands into the storage that the servers share. Until then other servers cannot verify or show the run.

use super::folder::Archive;
use crate::competition::hands::OwnHands;
use palmares_metrics::METRICS;
use palmares_net::auth::sha256_hex;
use palmares_store::files::blocking::blocking;
use palmares_store::files::objects::{Objects, hand_key, replay_key};
use palmares_store::{Store, UnstoredReplay};
use std::collections::BTreeSet;
use std::future::Future;
use std::sync::Arc;
use std::time::Duration;

/// Longest time between two rounds.
const ROUND_PERIOD: Duration = Duration::from_secs(30);
/// Pause after the first failure; it doubles with every further one, up to the period of the rounds.
const FIRST_PAUSE: Duration = Duration::from_secs(1);

/// Uploads this server's finished files.
#[derive(Debug)]
pub(crate) struct Upload {
    store: Store,
    archive: Arc<Archive>,
    objects: Arc<Objects>,
    hands: Arc<OwnHands>,
    /// Runs whose file is missing or changed here.
    unusable: BTreeSet<String>,
}

impl Upload {
    /// The upload into an archive's storage; None if it has none.
    pub(crate) fn new(store: Store, archive: Arc<Archive>, hands: Arc<OwnHands>) -> Option<Self> {
        let objects = archive.objects()?.clone();
        Some(Upload { store, archive, objects, hands, unusable: BTreeSet::new() })
    }

    /// Uploads until `stopping`.
    pub(crate) async fn run(mut self, stopping: impl Future<Output = ()>) {
        tokio::pin!(stopping);
        let mut pause = FIRST_PAUSE;
        loop {
            let round = async {
                let store = self.store.clone();
                match store.answered(self.round()).await {
                    Ok(()) => {
                        pause = FIRST_PAUSE;
                        let _ = tokio::time::timeout(ROUND_PERIOD, self.archive.finished.notified()).await;
                    }
                    Err(error) => {
                        METRICS.upload_failures.inc();
                        tracing::error!(%error, "files wait for the shared storage; tried again after {pause:?}");
                        tokio::time::sleep(pause).await;
                        pause = (pause * 2).min(ROUND_PERIOD);
                    }
                }
            };
            tokio::select! {
                () = round => {}
                () = &mut stopping => return,
            }
        }
    }

    /// Uploads everything that waits.
    pub(super) async fn round(&mut self) -> anyhow::Result<()> {
        let waiting = self.store.unstored_replays().await?;
        let usable = waiting.iter().filter(|replay| !self.unusable.contains(&replay.run_id));
        let mut left = usable.count();
        METRICS.uploads_waiting.set(left as u64);
        for replay in &waiting {
            let known = self.unusable.contains(&replay.run_id);
            // A file that was missing may be there by now.
            if self.upload(replay).await? {
                self.store.replay_stored(&replay.run_id, &replay.replay_sha256).await?;
                self.unusable.remove(&replay.run_id);
            } else if !known {
                tracing::warn!(
                    run = replay.run_id,
                    "its replay is missing or changed here, and is not uploaded"
                );
                self.unusable.insert(replay.run_id.clone());
                if self.store.lost_run(&replay.run_id).await?.is_some() {
                    // Which writes a missing replay again.
                    self.store.verify_again(&replay.run_id).await?;
                    self.archive.wakeup.notify_one();
                }
            }
            left -= usize::from(!known);
            METRICS.uploads_waiting.set(left as u64);
        }
        for sha256 in self.store.unstored_hands().await? {
            if let Ok(bytes) = self.hands.local_archive(&sha256).await {
                let (objects, key) = (self.objects.clone(), hand_key(&sha256));
                blocking(move || objects.put(&key, &bytes)).await??;
                self.store.hand_stored(&sha256).await?;
            }
        }
        Ok(())
    }

    /// Uploads a replay; false if this server does not have it as it was written.
    async fn upload(&self, replay: &UnstoredReplay) -> anyhow::Result<bool> {
        let Ok(path) = self.archive.locate(&replay.replay_path) else { return Ok(false) };
        let (objects, sha256) = (self.objects.clone(), replay.replay_sha256.clone());
        let upload = move || match std::fs::read(path) {
            Ok(bytes) if sha256_hex(&bytes) == sha256 => {
                objects.put(&replay_key(&sha256), &bytes).map(|()| true)
            }
            _ => Ok(false),
        };
        Ok(blocking(upload).await??)
    }
}
