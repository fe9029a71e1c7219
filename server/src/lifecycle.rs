//! How long the server lives: since when, whether it is finishing, and who is still there.

use std::time::{Duration, Instant};
use tokio::sync::watch;

/// What the parts of the program know of its life.
#[derive(Debug)]
pub(crate) struct Lifecycle {
    started: Instant,
    stopping: watch::Sender<bool>,
    alive: watch::Sender<usize>,
}

impl Default for Lifecycle {
    fn default() -> Self {
        Lifecycle {
            started: Instant::now(),
            stopping: watch::Sender::new(false),
            alive: watch::Sender::new(0),
        }
    }
}

/// Keeps the server from exiting while it exists.
#[derive(Debug)]
pub(crate) struct Alive(watch::Sender<usize>);

impl Drop for Alive {
    fn drop(&mut self) {
        self.0.send_modify(|count| *count -= 1);
    }
}

impl Lifecycle {
    /// The sessions' time: since the server started.
    pub(crate) fn now(&self) -> Duration {
        self.started.elapsed()
    }

    /// A guard that the server waits for before it exits.
    pub(crate) fn alive(&self) -> Alive {
        self.alive.send_modify(|count| *count += 1);
        Alive(self.alive.clone())
    }

    /// Tells everyone to finish.
    pub(crate) fn stop(&self) {
        self.stopping.send_replace(true);
    }

    /// Returns when the server is to finish.
    pub(crate) async fn stopping(&self) {
        // The sender lives in `self`: waiting cannot fail.
        let _ = self.stopping.subscribe().wait_for(|&stopping| stopping).await;
    }

    /// Whether the server is finishing.
    pub(crate) fn is_stopping(&self) -> bool {
        *self.stopping.borrow()
    }

    /// Returns when nobody is left.
    pub(crate) async fn deserted(&self) {
        let _ = self.alive.subscribe().wait_for(|&count| count == 0).await;
    }
}
