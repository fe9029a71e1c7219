//! A session whose connection is gone waits for its client; or it ends, when its client has said bye.

use super::registry::Handover;
use super::session::Session;
use crate::world::live::Live;
use palmares_tasks::Reason;
use tokio::sync::oneshot;
use tokio::time::{Instant, sleep_until};

impl Session {
    /// The client says bye: a practice session ends, an official one goes on without it as long as it has time.
    pub(crate) async fn leave(mut self: Box<Self>) {
        if self.official && !self.machine.clock().is_over(self.now()) {
            if self.machine.playing().is_some() {
                self.close_run(Reason::Stopped, Some("the client said bye")).await;
            }
            self.park();
        } else {
            self.end(Reason::Stopped, Some("the client said bye")).await;
        }
    }

    /// Leaves the session waiting for its client.
    pub(crate) fn park(self: Box<Self>) {
        tracing::info!(session = self.session_id, "connection lost; the session waits");
        self.wait();
    }

    /// Has a task keep the session until its client comes back, its grace or its time is spent, or the server stops.
    pub(super) fn wait(self: Box<Self>) {
        let asked = self.shared.registry.wait(&self.token_hash);
        tokio::spawn(keep(self, asked));
    }
}

async fn keep(mut session: Box<Session>, mut asked: oneshot::Receiver<Handover<Session>>) {
    let (shared, token_hash) = (session.shared.clone(), session.token_hash.clone());
    let lifecycle = &shared.lifecycle;
    let _alive = lifecycle.alive();
    let mut grace = Some(Instant::now() + shared.competition.settings.resume_grace);
    let give_up = loop {
        let change = session.next_change().map(|wait| Instant::now() + wait);
        let live = session.stream().cloned();
        tokio::select! {
            handover = &mut asked => {
                if let Ok(handover) = handover {
                    give(handover, session);
                }
                return;
            }
            command = session.command() => {
                // Nobody listens to what the client would be told.
                if session.obey(command).await.0 {
                    break Reason::Voided;
                }
            }
            () = news(live.as_deref()) => session.close_if_played_out().await,
            () = until(change) => {
                // The warnings are for a client that listens.
                session.expire().await;
                if grace.is_none() && !session.outlasts_absence() {
                    break Reason::SessionOver;
                }
            }
            () = until(grace) => {
                if !session.outlasts_absence() {
                    break Reason::Disconnected;
                }
                // The run is over; the session goes on as long as it has time.
                session.close_run(Reason::Disconnected, None).await;
                grace = None;
            }
            () = lifecycle.stopping() => break Reason::Disconnected,
        }
    };
    if shared.registry.withdraw(&token_hash) {
        let note = lifecycle.is_stopping().then_some("the server shut down");
        session.end(give_up, note).await;
    } else if let Ok(handover) = asked.await {
        give(handover, session);
    }
}

async fn until(moment: Option<Instant>) {
    match moment {
        Some(moment) => sleep_until(moment).await,
        None => std::future::pending().await,
    }
}

/// Returns when a realtime world has something to tell.
pub(crate) async fn news(live: Option<&Live>) {
    match live {
        Some(live) => live.news().await,
        None => std::future::pending().await,
    }
}

fn give(handover: Handover<Session>, session: Box<Session>) {
    // The new connection may be gone already; then the session waits for the next.
    if let Err(session) = handover.send(session) {
        session.wait();
    }
}
