//! Replays that are written again from stored ticks.

use super::run_inputs;
use super::session::Sessions;
use crate::archive::WriteAgain;
use crate::fleet::continued_run::ContinuedRun;
use anyhow::{Context, anyhow};
use palmares_replay::{Header, ReplayFile};
use palmares_store::LostRun;
use palmares_tasks::Reason;
use palmares_worlds::compute::background::{Background, JobPriority};
use serde_json::Value;
use std::future::Future;
use std::pin::Pin;

impl WriteAgain for Sessions {
    fn write_again<'a>(
        &'a self,
        run: &'a LostRun,
    ) -> Pin<Box<dyn Future<Output = anyhow::Result<ReplayFile>> + Send + 'a>> {
        Box::pin(self.written_again(run))
    }
}

impl Sessions {
    async fn written_again(&self, run: &LostRun) -> anyhow::Result<ReplayFile> {
        let archive = self.archive.as_ref().context("this server records nothing")?;
        let header = Header::from_json(&run.header).map_err(|error| anyhow!("its header: {error}"))?;
        let reason: Reason = serde_json::from_value(Value::from(run.reason.as_str()))?;
        let task = self.competition.task(&header.task).context("its task is not played here")?.clone();
        let found = run_inputs::hand(self, &run.team, &header.hand).await;
        let (hand, hand_sha256) = found.map_err(|refusal| anyhow!("its hand: {}", refusal.message))?;
        let provided = run_inputs::provide(self, &hand, hand_sha256.as_deref()).await;
        provided.map_err(|refusal| anyhow!("its hand: {}", refusal.message))?;
        let shipped = self.store.shipped_run(&run.run_id).await?;
        let ended_unix_ms = u64::try_from(run.ended_unix_ms).unwrap_or_default();
        let (mut recorder, recording) = archive.record_again(header.clone(), ended_unix_ms);
        let again = ContinuedRun { header, task, hand, shipped };
        // Of its own: it must not delay the jobs for which clients wait.
        let background = Background::new(1);
        let play = move || again.play_again(&mut recorder, reason);
        background.run(JobPriority::Idle, play).await??;
        let file = recording.file().await.map_err(anyhow::Error::msg)?;
        file.context("its stored ticks have no tick")
    }
}
