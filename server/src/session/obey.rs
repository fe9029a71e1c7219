//! What a session does when an organizer commands it. Whoever holds it obeys: a connection, or the task that keeps it
//! waiting.

use super::command::{Command, PendingCommand};
use super::session::{OpenRun, Session};
use palmares_protocol::{Refusal, Reply};
use palmares_tasks::Reason;
use tokio::task::spawn_blocking;

impl Session {
    /// Does what an organizer asks. Returns whether the session is over, and what its client is told.
    pub(crate) async fn obey(&mut self, pending: PendingCommand) -> (bool, Option<Reply>) {
        self.catch_up();
        let PendingCommand { command, done } = pending;
        tracing::info!(session = self.session_id, ?command, "an organizer's command");
        let (over, mut told) = (matches!(command, Command::End { .. }), None);
        let result = match command {
            Command::Pause => {
                self.pause();
                Ok(())
            }
            Command::Resume => {
                self.go_on().await;
                Ok(())
            }
            Command::Grant { seconds } => {
                self.machine.grant(seconds, self.now());
                Ok(())
            }
            Command::VoidRun { run_id, note } => self.void_run(&run_id, &note).await,
            Command::End { void, note } => {
                let reason = if void { Reason::Voided } else { Reason::Stopped };
                self.end_run(reason, &note).await.map(|result| told = result)
            }
        };
        self.save(true).await;
        // The organizer may have gone; what was asked is done.
        let _ = done.send(result);
        (over, told)
    }

    fn pause(&mut self) {
        self.machine.pause(self.now());
        if let OpenRun::Realtime(live) = &self.open_run {
            live.pause();
        }
    }

    async fn go_on(&mut self) {
        self.machine.resume(self.now());
        if let OpenRun::Realtime(live) = &self.open_run {
            let (live, compute) = (live.clone(), self.shared.compute.clone());
            // A tick that is being made may take long: not on a thread that others need.
            let resumed = spawn_blocking(move || live.resume(&compute.pacer)).await;
            if let Err(error) = resumed {
                tracing::error!(%error, "a realtime world does not go on");
            }
        }
    }

    async fn void_run(&mut self, run_id: &str, note: &str) -> Result<(), Refusal> {
        if self.machine.playing().is_none_or(|run| run.run_id != run_id) {
            return self.give_back().await;
        }
        self.close_run(Reason::Voided, Some(note)).await;
        Ok(())
    }

    /// Finishes the open run, if there is one.
    async fn end_run(&mut self, reason: Reason, note: &str) -> Result<Option<Reply>, Refusal> {
        if self.machine.playing().is_none() {
            return Ok(None);
        }
        let result = self.finish(reason, Some(note)).await?;
        Ok(Some(Reply::Result(Box::new(result))))
    }
}
