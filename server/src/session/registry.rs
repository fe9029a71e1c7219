//! Where sessions wait for clients that lost their connection.

use super::Session;
use crate::protocol::{Code, Refusal};
use palmares_tasks::Reason;
use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use tokio::sync::oneshot;
use tokio::time::{Instant, sleep_until};

/// How a waiting session is given to its client's new connection.
type Handover = oneshot::Sender<Box<Session>>;

#[derive(Debug)]
enum Slot {
    /// A connection holds the session.
    Connected,
    /// A task keeps it until somebody asks.
    Waiting(oneshot::Sender<Handover>),
}

/// All sessions by resume token. The lock is held for a look-up only.
#[derive(Debug, Default)]
pub(crate) struct Registry {
    slots: Mutex<HashMap<String, Slot>>,
}

impl Registry {
    fn slots(&self) -> MutexGuard<'_, HashMap<String, Slot>> {
        // Nothing panics while it holds the lock; if something did, the map would still be whole.
        self.slots.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sessions now.
    pub(crate) fn len(&self) -> usize {
        self.slots().len()
    }

    /// A new session, held by a connection.
    pub(crate) fn insert(&self, token: &str) {
        self.slots().insert(token.to_owned(), Slot::Connected);
    }

    /// A session that ended.
    pub(crate) fn remove(&self, token: &str) {
        self.slots().remove(token);
    }

    /// Gives a waiting session to its client's new connection.
    pub(crate) async fn claim(&self, token: &str) -> Result<Box<Session>, Refusal> {
        let gone = || {
            let message = "no session has this resume_token any more; say hello without it for a new one";
            Refusal::new(Code::SessionOver, message)
        };
        let keeper = {
            let mut slots = self.slots();
            let slot = slots.get_mut(token).ok_or_else(gone)?;
            match std::mem::replace(slot, Slot::Connected) {
                Slot::Waiting(keeper) => keeper,
                Slot::Connected => {
                    let message = "another connection holds this session";
                    return Err(Refusal::new(Code::SessionTaken, message).retry_after(1.0));
                }
            }
        };
        let (handover, session) = oneshot::channel();
        keeper.send(handover).map_err(|_| gone())?;
        session.await.map_err(|_| gone())
    }

    /// Whether nobody has claimed the session; then nobody can any more.
    fn withdraw(&self, token: &str) -> bool {
        let mut slots = self.slots();
        if matches!(slots.get(token), Some(Slot::Connected)) {
            return false;
        }
        slots.remove(token);
        true
    }
}

/// Keeps a session whose connection is gone until its client comes back, its grace or its time is spent, or
/// the server stops.
pub(crate) fn park(session: Box<Session>) {
    let (keeper, asked) = oneshot::channel();
    let token = session.resume_token().to_owned();
    session.host().registry.slots().insert(token.clone(), Slot::Waiting(keeper));
    tokio::spawn(keep(session, token, asked));
}

async fn keep(mut session: Box<Session>, token: String, mut asked: oneshot::Receiver<Handover>) {
    let host = session.host().clone();
    let _alive = host.alive();
    let give_up = Instant::now() + host.settings.resume_grace;
    loop {
        let change = session.next_change().map(|wait| Instant::now() + wait);
        tokio::select! {
            handover = &mut asked => {
                if let Ok(handover) = handover {
                    give(handover, session);
                }
                return;
            }
            () = sleep_until(change.unwrap_or(give_up)), if change.is_some_and(|change| change < give_up) => {
                // The warnings are for a client that listens.
                session.expire().await;
            }
            () = sleep_until(give_up) => break,
            () = host.stopping() => break,
        }
    }
    if host.registry.withdraw(&token) {
        let note = host.is_stopping().then_some("the server shut down");
        session.end(Reason::Disconnected, note).await;
    } else if let Ok(handover) = asked.await {
        give(handover, session);
    }
}

fn give(handover: Handover, session: Box<Session>) {
    // The new connection may be gone already; then the session waits for the next.
    if let Err(session) = handover.send(session) {
        park(session);
    }
}
