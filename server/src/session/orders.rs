//! What organizers ask of sessions. Whoever holds a session, a connection or the keeper of a waiting one, obeys.

use super::driver::{Session, Stage};
use crate::protocol::{Refusal, Reply};
use palmares_tasks::Reason;
use tokio::sync::oneshot;
use tokio::task::spawn_blocking;

/// What is asked.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Order {
    /// Clock and worlds stand still.
    Pause,
    /// They go on.
    Resume,
    /// The session gets longer.
    Grant {
        /// By how much, s.
        seconds: f64,
    },
    /// A run of the session is void: an open one ends, and the time of either is given back.
    VoidRun {
        /// Which.
        run_id: String,
        /// Why, for people.
        note: String,
    },
    /// The session ends; its open run counts or is void.
    End {
        /// Whether the open run is void.
        void: bool,
        /// Why, for people.
        note: String,
    },
}

/// An order on its way.
#[derive(Debug)]
pub(crate) struct Ordered {
    /// What is asked.
    pub(crate) order: Order,
    /// Told when it is done.
    pub(crate) done: oneshot::Sender<Result<(), Refusal>>,
}

impl Session {
    /// The next thing an organizer asks.
    pub(crate) async fn order(&mut self) -> Ordered {
        match self.orders.recv().await {
            Some(ordered) => ordered,
            // The registry holds the other end as long as the session exists.
            None => std::future::pending().await,
        }
    }

    /// Does what an organizer asks. Returns whether the session is over, and what its client is told.
    pub(crate) async fn obey(&mut self, ordered: Ordered) -> (bool, Option<Reply>) {
        let now = self.host.now();
        self.catch_up();
        let Ordered { order, done } = ordered;
        tracing::info!(session = self.session_id, ?order, "an organizer's order");
        let (mut over, mut told) = (false, None);
        let result = match order {
            Order::Pause => {
                self.machine.pause(now);
                if let Stage::Realtime(live) = &self.stage {
                    live.pause();
                }
                Ok(())
            }
            Order::Resume => {
                self.machine.resume(now);
                if let Stage::Realtime(live) = &self.stage {
                    let (live, host) = (live.clone(), self.host.clone());
                    // A tick that is being made may take long: not on a thread that others need.
                    let resumed = spawn_blocking(move || live.resume(&host.compute.pacer)).await;
                    if let Err(error) = resumed {
                        tracing::error!(%error, "a realtime world does not go on");
                    }
                }
                Ok(())
            }
            Order::Grant { seconds } => {
                self.machine.grant(seconds, now);
                Ok(())
            }
            Order::VoidRun { run_id, note } => match self.machine.playing() {
                Some(run) if run.run_id == run_id => {
                    self.close_run(Reason::Voided, Some(&note)).await;
                    Ok(())
                }
                _ => self.give_back().await,
            },
            Order::End { void, note } => {
                over = true;
                let reason = if void { Reason::Voided } else { Reason::Stopped };
                match self.machine.playing() {
                    Some(_) => self.finish(reason, Some(&note)).await.map(|result| {
                        told = Some(Reply::Result(Box::new(result)));
                    }),
                    None => Ok(()),
                }
            }
        };
        self.save(true).await;
        // The organizer may have gone; what was asked is done.
        let _ = done.send(result);
        (over, told)
    }
}
