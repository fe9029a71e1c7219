//! The server's start, its stop, and the tasks that it waits for.

use std::time::{Duration, Instant};
use tokio::sync::watch;

/// The server's start, its stop, and the tasks that it waits for.
#[derive(Debug)]
pub struct Lifecycle {
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
pub struct Alive(watch::Sender<usize>);

impl Drop for Alive {
    fn drop(&mut self) {
        self.0.send_modify(|count| *count -= 1);
    }
}

impl Lifecycle {
    /// Time since the server started: the sessions' time.
    pub fn now(&self) -> Duration {
        self.started.elapsed()
    }

    /// A guard that the server waits for before it exits.
    pub fn alive(&self) -> Alive {
        self.alive.send_modify(|count| *count += 1);
        Alive(self.alive.clone())
    }

    /// Asks all tasks to finish.
    pub fn stop(&self) {
        self.stopping.send_replace(true);
    }

    /// Returns when the server stops.
    pub async fn stopping(&self) {
        // The sender is in `self`: waiting cannot fail.
        let _ = self.stopping.subscribe().wait_for(|&stopping| stopping).await;
    }

    /// Whether the server stops.
    pub fn is_stopping(&self) -> bool {
        *self.stopping.borrow()
    }

    /// Returns when no guard of [`Lifecycle::alive`] is left.
    pub async fn idle(&self) {
        let _ = self.alive.subscribe().wait_for(|&count| count == 0).await;
    }
}
