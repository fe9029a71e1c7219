//! A session without a connection: it waits for its client, or ends.

use super::session::{Handover, InboxMessage, Session};
use palmares_tasks::Reason;
use palmares_worlds::world::realtime::RealtimeWorld;
use tokio::time::{Instant, sleep_until};

impl Session {
    /// After `bye`: a practice session ends, an official one waits as long as it has time.
    pub(crate) async fn leave(mut self: Box<Self>) {
        let note = Some("the client said bye");
        if self.machine.playing().is_some() {
            self.close_run(Reason::Stopped, note).await;
        }
        // A result that could not be stored is tried again.
        if (self.official && !self.machine.clock().is_over(self.now())) || self.is_unstored() {
            self.park();
        } else {
            self.end(Reason::Stopped, note).await;
        }
    }

    /// Lets the session wait for its client after a lost connection.
    pub(crate) fn park(self: Box<Self>) {
        tracing::info!(session = self.held.session_id, "connection lost; the session waits");
        self.wait();
    }

    /// Hands the session to its client's new connection.
    pub(crate) fn give(self: Box<Self>, to: Handover) {
        // If the new connection has ended already, the session waits for the next.
        if let Err(session) = to.send(self) {
            session.wait();
        }
    }

    /// Starts a task that keeps the session until its client reconnects, its grace period or its time ends, or the server stops.
    pub(super) fn wait(self: Box<Self>) {
        self.shared.registry.wait(&self.held, &self.token_hash);
        tokio::spawn(keep(self));
    }
}

async fn keep(mut session: Box<Session>) {
    let (shared, token_hash) = (session.shared.clone(), session.token_hash.clone());
    let lifecycle = &shared.lifecycle;
    let _alive = lifecycle.alive();
    let held = session.held().clone();
    let mut grace = Some(Instant::now() + shared.competition.settings.resume_grace);
    let give_up = loop {
        let change = session.next_change().map(|wait| Instant::now() + wait);
        let live = session.stream().cloned();
        tokio::select! {
            message = session.inbox_message(false) => match message {
                InboxMessage::Claim(to) => return session.give(to),
                // The reply is for a connected client.
                InboxMessage::Command(command) => if session.execute(command).await.0 {
                    break Reason::Voided;
                }
            },
            () = changed(live.as_deref()) => session.close_if_world_over().await,
            () = until(change) => {
                // The warning is for a connected client.
                session.expire().await;
                if grace.is_none() && !session.outlasts_absence() && !session.is_unstored() {
                    break Reason::SessionOver;
                }
            }
            () = until(grace) => {
                let outlasts = session.outlasts_absence();
                if outlasts {
                    session.go_on().await;
                }
                // The run ends; the session waits as long as it has time, or a result that is not stored.
                if session.machine.playing().is_some() {
                    session.close_run(Reason::Disconnected, None).await;
                }
                if !outlasts && !session.is_unstored() {
                    break Reason::Disconnected;
                }
                grace = None;
            }
            () = held.lost() => {
                session.part();
                return;
            }
            () = lifecycle.stopping() => break Reason::Disconnected,
        }
    };
    // A client that claims the session while an organizer ends it is refused.
    let ended = give_up == Reason::Voided;
    if shared.registry.withdraw(&held, &token_hash) || ended {
        if lifecycle.is_stopping() && session.moves_on() {
            return session.hand_over().await;
        }
        let note = lifecycle.is_stopping().then_some("the server shut down");
        session.end(give_up, note).await;
    } else {
        let to = session.claimed(false).await;
        session.give(to);
    }
}

async fn until(moment: Option<Instant>) {
    match moment {
        Some(moment) => sleep_until(moment).await,
        None => std::future::pending().await,
    }
}

/// Returns when a realtime world has an observation or is over; never without one.
pub(crate) async fn changed(live: Option<&RealtimeWorld>) {
    match live {
        Some(live) => live.changed().await,
        None => std::future::pending().await,
    }
}
