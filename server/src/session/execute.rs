//! Executes the commands of organizers, for a session with a connection and for one that waits.

use super::command::{Command, PendingCommand};
use super::failure::store_failed;
use super::session::Session;
use palmares_protocol::{Code, Refusal, Reply};
use palmares_tasks::Reason;
use palmares_worlds::compute::queue::WAIT;
use tokio::task::spawn_blocking;

impl Session {
    /// Executes a command. Returns whether the session is over or given away, and the message for its client.
    pub(crate) async fn execute(&mut self, pending: PendingCommand) -> (bool, Option<Reply>) {
        self.catch_up();
        let PendingCommand { command, done } = pending;
        tracing::info!(session = self.held.session_id, ?command, "an organizer's command");
        let (mut over, mut reply) = (matches!(command, Command::End { .. }), None);
        let result = match command {
            Command::Pause => {
                self.set_paused(true).await;
                Ok(())
            }
            Command::Resume => {
                self.set_paused(false).await;
                Ok(())
            }
            Command::PauseCompetition(paused) => {
                self.machine.set_competition_paused(paused, self.now());
                if !paused && self.shared.compute.admission.place_in_queue(&self.held.session_id).is_some() {
                    // It waits for a world: its client has time to ask again.
                    self.machine.hold(self.now() + WAIT, self.now());
                }
                self.follow_clock().await;
                Ok(())
            }
            Command::Grant { seconds } => {
                self.machine.grant(seconds, self.now());
                Ok(())
            }
            Command::Release { firmly } => self.release(firmly).await,
            Command::Follow => self.follow_row().await.map(|end| (over, reply) = end),
            Command::VoidRun { run_id, note } => self.void_run(&run_id, &note).await,
            Command::UnvoidRun { run_id, actor, reason } => self.unvoid_run(&run_id, &actor, &reason).await,
            Command::End { void, note } => {
                let reason = if void { Reason::Voided } else { Reason::Stopped };
                self.end_run(reason, &note).await.map(|result| reply = result)
            }
        };
        if !self.held.is_lost() {
            self.save(true).await;
        }
        // An error means that the organizer's request was dropped; the command is done.
        let _ = done.send(result);
        (over, reply)
    }

    /// Does what the session's row says. Returns whether the session is over, and the message for its client.
    async fn follow_row(&mut self) -> Result<(bool, Option<Reply>), Refusal> {
        let row =
            self.shared.store.session(&self.held.session_id).await.map_err(store_failed("the session"))?;
        let Some(row) = row else { return Ok((false, None)) };
        if row.status != "open" {
            let reason = if row.status == "voided" { Reason::Voided } else { Reason::Stopped };
            let reply = self.end_run(reason, "the organizers ended the session").await?;
            return Ok((true, reply));
        }
        let paused = row.paused_unix_ms.is_some();
        if paused != self.held.is_paused() {
            self.set_paused(paused).await;
        }
        Ok((false, None))
    }

    /// Stops or continues this session.
    async fn set_paused(&mut self, paused: bool) {
        self.held.set_paused(paused);
        if let Some(standing) = &mut self.standing {
            *standing = paused;
            if !paused {
                // The clock stands until the client is back.
                return;
            }
        }
        if paused {
            self.machine.pause(self.now());
        } else {
            self.machine.resume(self.now());
        }
        self.follow_clock().await;
    }

    /// Stops a realtime world.
    pub(super) fn stand(&mut self) {
        if let Some(live) = self.realtime() {
            live.pause();
        }
    }

    /// Stops or continues a realtime world, as the clock is.
    pub(super) async fn follow_clock(&mut self) {
        if self.machine.clock().is_paused() {
            self.stand();
        } else if let Some(live) = self.realtime() {
            let (live, compute) = (live.clone(), self.shared.compute.clone());
            // Blocks while a tick is in progress.
            let resumed = spawn_blocking(move || live.resume(&compute.pacer)).await;
            if let Err(error) = resumed {
                tracing::error!(%error, "a realtime world does not continue");
            }
        }
    }

    /// Gives the session to the host where its client is, unless a client is here that has not gone.
    async fn release(&mut self, firmly: bool) -> Result<(), Refusal> {
        if !firmly && self.shared.registry.is_connected(&self.token_hash) {
            return Err(Refusal::new(Code::SessionTaken, "a connection holds the session"));
        }
        let given = self.give_away().await;
        if given.is_err() {
            // The session stays.
            self.follow_clock().await;
        }
        given
    }

    async fn void_run(&mut self, run_id: &str, note: &str) -> Result<(), Refusal> {
        if self.machine.playing().is_none_or(|run| run.run_id != run_id) {
            return self.refund_void_runs().await;
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
