//! Commands of organizers to all sessions: the state of the competition, applied to the sessions of this host.

use super::command::Command;
use super::session::Sessions;
use futures_util::future::join_all;
use palmares_protocol::{Code, Refusal};
use palmares_store::StoreError;
use std::time::Duration;
use tokio::time::timeout;

/// Longest wait until all sessions have carried out a command. A session that needs longer carries it out afterwards.
const PATIENCE: Duration = Duration::from_secs(10);

impl Sessions {
    /// Reads the state of the competition from the database and applies a change of it to the sessions of this host. Organizers'
    /// commands call it, and every beat of a host that shares its database.
    ///
    /// # Errors
    /// The database failed.
    pub(crate) async fn follow_competition(&self) -> Result<(), StoreError> {
        // One at a time, so that no later state is applied before an earlier one.
        let _following = self.following.lock().await;
        let before = self.competition.rules.state();
        let now = self.store.answered(self.store.competition_state()).await?;
        let ended = match now.ended_unix_ms.filter(|_| before.ended_unix_ms != now.ended_unix_ms) {
            Some(at) => self.store.answered(self.store.sessions_ended_at(at)).await?,
            None => vec![],
        };
        self.competition.rules.adopt(now);
        // Before the sessions are: those that wait for a world keep their places.
        self.compute.admission.set_paused(now.paused_unix_ms.is_some());
        // A session that begins from here on is paused by `Session::new`.
        if before.paused_unix_ms.is_some() != now.paused_unix_ms.is_some() {
            let command = Command::PauseCompetition(now.paused_unix_ms.is_some());
            let ids = self.registry.held().into_iter().map(|held| held.session_id).collect();
            self.command_all(ids, command).await;
        }
        let note = "the organizers ended all sessions".to_owned();
        self.command_all(ended, Command::End { void: false, note }).await;
        Ok(())
    }

    /// Sends a command to sessions at once and waits for them.
    async fn command_all(&self, ids: Vec<String>, command: Command) {
        let command = &command;
        let all = ids.iter().map(|session_id| async move {
            match self.registry.command(session_id, command.clone()).await {
                // Not here, or over meanwhile.
                Err(Refusal { code: Code::NotFound, .. }) | Ok(()) => {}
                Err(refusal) => {
                    tracing::error!(session = session_id, %refusal, "a command to all sessions failed")
                }
            }
        });
        if timeout(PATIENCE, join_all(all)).await.is_err() {
            tracing::warn!(?command, "a session needs long for a command to all sessions");
        }
    }
}
