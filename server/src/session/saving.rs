//! The clocks of all sessions are saved regularly, so that a crash forgets a few seconds at most. Those are given back: they were not
//! the team's to lose. The time in which the server is down does not count.

use super::clock_rows::saved_row;
use super::session::Sessions;
use palmares_store::{SavedClock, StoreError};
use std::sync::Arc;
use std::time::Duration;
use tokio::time::{MissedTickBehavior, interval};

/// How often the clocks are saved.
const INTERVAL: Duration = Duration::from_secs(5);

impl Sessions {
    /// Saves the clocks that have changed since they were saved last: of official sessions, while a run is open as before that run.
    ///
    /// # Errors
    /// The database failed.
    pub(crate) async fn save_clocks(&self) -> Result<(), StoreError> {
        let _saving = self.saving.lock().await;
        let unsaved = self.clocks.unsaved(self.lifecycle.now(), self.shipper.is_some());
        let rows = unsaved.iter().map(|unsaved| SavedClock {
            session_id: unsaved.session_id.clone(),
            epoch: unsaved.epoch,
            clock: saved_row(unsaved.state, unsaved.in_run),
            in_run: unsaved.present.map(|present| (present.spent.wall_s, present.refunded_s)),
        });
        let rows: Vec<_> = rows.collect();
        self.store.answered(self.store.save_clocks(&rows)).await?;
        self.clocks.saved(&unsaved);
        Ok(())
    }

    /// Saves the clocks until the server stops.
    pub(crate) async fn keep_clocks_saved(self: Arc<Self>) {
        let mut due = interval(INTERVAL);
        // After an outage of the database there is nothing to catch up with.
        due.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                _ = due.tick() => {}
                () = self.lifecycle.stopping() => return,
            }
            if let Err(error) = self.save_clocks().await {
                tracing::error!(%error, "the sessions' clocks could not be saved");
            }
        }
    }
}
