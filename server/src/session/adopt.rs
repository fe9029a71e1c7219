//! Sessions that this server takes over: from its earlier process, or from a host that is gone.

use super::command::Command;
use super::continued::NotContinued;
use super::session::{Session, Sessions};
use palmares_metrics::METRICS;
use palmares_store::{Held, NewAuditEntry, OwnedSession, StoreError};
use palmares_tasks::Reason;
use std::sync::Arc;
use std::time::Duration;
use tokio::task::JoinSet;

/// Time after which a session does what its row says.
const ORDER_PATIENCE: Duration = Duration::from_millis(300);

/// The note of a run whose session was ended while no host had it.
const ENDED_MEANWHILE: &str = "an organizer ended the session while its host was away";

impl Sessions {
    /// Takes over open sessions without an owner, at most `max` of them; they wait for their clients.
    ///
    /// # Errors
    /// The database failed.
    pub(crate) async fn adopt(self: &Arc<Self>, max: usize) -> Result<(), StoreError> {
        let _adopting = self.adopting.0.lock().await;
        let taken = self.store.take_sessions(max, None).await?;
        // Their runs are built side by side, on all cores.
        let mut adopted = JoinSet::new();
        for held in taken {
            let sessions = self.clone();
            adopted.spawn(async move { sessions.adopt_or_release(&held).await });
        }
        adopted.join_all().await;
        Ok(())
    }

    /// Gives up the sessions of this server that nobody here has: an answer of the database was lost, or a task ended before the
    /// registry had the session. The next beat takes them over, or that of the host where the client is.
    ///
    /// # Errors
    /// The database failed.
    pub(crate) async fn give_up_orphans(&self) -> Result<(), StoreError> {
        // No take-over is in progress.
        let _adopting = self.adopting.0.lock().await;
        // The registry has a new session before the database does.
        for held in self.store.own_sessions().await? {
            if !self.registry.knows(&held.session_id) {
                tracing::warn!(session = held.session_id, "nobody here has the session; it is given up");
                self.store.release_session(&held).await?;
            }
        }
        Ok(())
    }

    async fn adopt_or_release(self: &Arc<Self>, held: &Held) {
        let Err(error) = self.adopt_one(held).await else { return };
        tracing::error!(%error, session = held.session_id, "a session could not be taken over");
        // For another attempt, here or elsewhere.
        if let Err(error) = self.store.release_session(held).await {
            tracing::error!(%error, session = held.session_id, "the session waits for the end of this server's lease");
        }
    }

    /// Takes over this session, if it has no owner. Also an ended session of this process that is open again. It goes on when the
    /// caller is dropped: a session that was taken needs its holder.
    ///
    /// # Errors
    /// The database failed.
    pub(crate) async fn revive(self: &Arc<Self>, session_id: &str) -> Result<(), StoreError> {
        let (sessions, session_id) = (self.clone(), session_id.to_owned());
        let reviving = tokio::spawn(async move { sessions.take_over(&session_id).await });
        // It panics only when a take-over does, which the log has.
        reviving.await.unwrap_or(Ok(()))
    }

    async fn take_over(self: &Arc<Self>, session_id: &str) -> Result<(), StoreError> {
        // A session that is being taken over is not taken twice.
        let _adopting = self.adopting.0.lock().await;
        if self.registry.knows(session_id) {
            return Ok(());
        }
        let taken = match self.lease.is_whole() {
            true => self.store.take_sessions(1, Some(session_id)).await?.pop(),
            // After an outage of the database another owner may renew its lease in a moment.
            false => self.store.take_released(session_id).await?,
        };
        if let Some(held) = taken {
            self.adopt_or_release(&held).await;
        }
        Ok(())
    }

    /// Compares the sessions that are open here with their rows: a session with another owner ends here, one that another host wants is
    /// given to it. A session that an organizer has paused or ended while this host had no lease is paused or ended.
    pub(crate) fn follow_owners(self: &Arc<Self>, owned: Vec<OwnedSession>) {
        for OwnedSession { held, epoch, wanted, firmly, ended, paused } in owned {
            if epoch != held.epoch {
                // Once: it stays open here until its connection has noticed.
                if !held.is_lost() {
                    tracing::warn!(session = held.session_id, "the session has another owner; it ends here");
                    held.lose();
                }
            } else if ended || paused != held.is_paused() {
                let sessions = self.clone();
                tokio::spawn(async move {
                    // Usually the organizer's own command is on its way.
                    tokio::time::sleep(ORDER_PATIENCE).await;
                    // Not found: it has ended.
                    let _ = sessions.registry.command(&held.session_id, Command::Follow).await;
                });
            } else if let Some(host) = wanted {
                let sessions = self.clone();
                tokio::spawn(async move {
                    let command = Command::Release { firmly };
                    if sessions.registry.command(&held.session_id, command).await.is_ok() {
                        tracing::info!(
                            session = held.session_id,
                            host,
                            "the session was given to the host of its client"
                        );
                    }
                });
            }
        }
    }

    async fn adopt_one(self: &Arc<Self>, held: &Held) -> Result<(), NotContinued> {
        let row = self.store.resumable_session(held).await?;
        if let Some(row) = &row
            && let Some(run) = self.store.interrupted_run(held).await?
        {
            let run_id = run.run_id.clone();
            match self.continued(row, held, run).await {
                Ok(session) => {
                    METRICS.sessions_taken.inc();
                    METRICS.runs_continued.inc();
                    if row.open {
                        session.wait();
                    } else {
                        session.end(Reason::Stopped, Some(ENDED_MEANWHILE)).await;
                    }
                    return Ok(());
                }
                Err(error) => {
                    if let Some(shipper) = &self.shipper {
                        shipper.forget(&run_id, held).await;
                    }
                    if let NotContinued::Now(_) = error {
                        return Err(error);
                    }
                    tracing::error!(%error, run = run_id, "the run of another host cannot be continued");
                }
            }
        }
        for run in self.store.abort_open_runs(held).await? {
            tracing::warn!(run, "the server stopped during this run; marked as aborted");
            let why = match row {
                Some(_) => "the server stopped during this run; its time is given back",
                None => "the server stopped during this run",
            };
            let entry =
                NewAuditEntry { actor: "server", action: "run.abort", subject: &run, reason: Some(why) };
            self.store.record(&entry).await?;
            // Now the retention can delete its file.
            if let Some(archive) = &self.archive {
                archive.wake();
            }
        }
        match row {
            Some(row) if row.open => {
                if let Some(session) = Session::restored(self, row) {
                    METRICS.sessions_taken.inc();
                    session.wait();
                }
            }
            _ => self.store.end_session(held).await?,
        }
        Ok(())
    }

    /// Ends what hosts that are gone have left: their practice sessions, and the open runs of sessions that an organizer has ended
    /// meanwhile. Such a run is scored if its ticks are stored, otherwise it is aborted.
    ///
    /// # Errors
    /// The database failed.
    pub(crate) async fn end_lost(self: &Arc<Self>) -> Result<(), StoreError> {
        self.store.end_lost_practice().await?;
        let _adopting = self.adopting.0.lock().await;
        for held in self.store.take_ended_sessions().await? {
            // It goes on when the caller is dropped: a session that was taken needs its holder.
            let sessions = self.clone();
            let closing = tokio::spawn(async move { sessions.adopt_or_release(&held).await });
            if closing.await.is_err() {
                tracing::error!("a session that had ended was not closed");
            }
        }
        Ok(())
    }
}
