//! Where sessions wait for clients that lost their connection.

use super::Session;
use super::clock::SessionClock;
use super::orders::{Order, Ordered};
use crate::protocol::request::shortened;
use crate::protocol::{Code, Refusal};
use crate::world::live::Live;
use palmares_tasks::Reason;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::{Mutex, MutexGuard, PoisonError};
use tokio::sync::{mpsc, oneshot};
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

/// Orders that wait for a session at most.
const ORDERS: usize = 8;

/// All sessions by the hash of their resume token, and the ways to them by their id. The locks are held for a look-up
/// only.
#[derive(Debug, Default)]
pub(crate) struct Registry {
    slots: Mutex<HashMap<String, Slot>>,
    orders: Mutex<HashMap<String, mpsc::Sender<Ordered>>>,
    /// Clocks by session id, as they stood when something last happened; they run on by themselves.
    clocks: Mutex<HashMap<String, SessionClock>>,
}

impl Registry {
    fn slots(&self) -> MutexGuard<'_, HashMap<String, Slot>> {
        // Nothing panics while it holds the lock; if something did, the map would still be whole.
        self.slots.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn ways(&self) -> MutexGuard<'_, HashMap<String, mpsc::Sender<Ordered>>> {
        self.orders.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn clocks(&self) -> MutexGuard<'_, HashMap<String, SessionClock>> {
        self.clocks.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sessions now.
    pub(crate) fn len(&self) -> usize {
        self.slots().len()
    }

    /// A new session, held by a connection. Returns where its orders come from.
    pub(super) fn insert(&self, token_hash: &str, session_id: &str) -> mpsc::Receiver<Ordered> {
        let (way, orders) = mpsc::channel(ORDERS);
        self.slots().insert(token_hash.to_owned(), Slot::Connected);
        self.ways().insert(session_id.to_owned(), way);
        orders
    }

    /// The same for a session of the database that somebody else may have taken from there already.
    pub(super) fn insert_once(&self, token_hash: &str, session_id: &str) -> Option<mpsc::Receiver<Ordered>> {
        let (way, orders) = mpsc::channel(ORDERS);
        match self.ways().entry(session_id.to_owned()) {
            Entry::Occupied(_) => return None,
            Entry::Vacant(free) => free.insert(way),
        };
        self.slots().insert(token_hash.to_owned(), Slot::Connected);
        Some(orders)
    }

    /// A session that ended.
    pub(super) fn remove(&self, token_hash: &str, session_id: &str) {
        self.slots().remove(token_hash);
        self.ways().remove(session_id);
        self.clocks().remove(session_id);
    }

    /// Lets organizers see a session's clock.
    pub(super) fn show(&self, session_id: &str, clock: &SessionClock) {
        let mut clocks = self.clocks();
        match clocks.get_mut(session_id) {
            Some(shown) => shown.clone_from(clock),
            None => drop(clocks.insert(session_id.to_owned(), clock.clone())),
        }
    }

    /// The clock of a session that somebody holds.
    pub(crate) fn clock(&self, session_id: &str) -> Option<SessionClock> {
        self.clocks().get(session_id).cloned()
    }

    /// Asks something of a session and waits until it is done.
    pub(crate) async fn order(&self, session_id: &str, order: Order) -> Result<(), Refusal> {
        let gone = || Refusal::new(Code::NotFound, format!("no open session `{}`", shortened(session_id)));
        let way = self.ways().get(session_id).cloned().ok_or_else(gone)?;
        let (done, result) = oneshot::channel();
        way.send(Ordered { order, done }).await.map_err(|_| gone())?;
        result.await.map_err(|_| gone())?
    }

    /// A session that a connection holds is known by another token from now on.
    pub(super) fn rekey(&self, old: &str, new: &str) {
        let mut slots = self.slots();
        if let Some(slot) = slots.remove(old) {
            slots.insert(new.to_owned(), slot);
        }
    }

    /// Whether a session is open here, whatever it is known by.
    pub(super) fn knows(&self, session_id: &str) -> bool {
        self.ways().contains_key(session_id)
    }

    /// Somebody else has the session.
    pub(super) fn taken() -> Refusal {
        Refusal::new(Code::SessionTaken, "another connection holds this session").retry_after(1.0)
    }

    /// Gives a waiting session to its client's new connection.
    pub(crate) async fn claim(&self, token_hash: &str) -> Result<Box<Session>, Refusal> {
        let gone = || {
            let message = "no session has this resume_token any more; say hello without it for a new one";
            Refusal::new(Code::SessionOver, message)
        };
        let keeper = {
            let mut slots = self.slots();
            let slot = slots.get_mut(token_hash).ok_or_else(gone)?;
            match std::mem::replace(slot, Slot::Connected) {
                Slot::Waiting(keeper) => keeper,
                Slot::Connected => {
                    return Err(Self::taken());
                }
            }
        };
        let (handover, session) = oneshot::channel();
        keeper.send(handover).map_err(|_| gone())?;
        session.await.map_err(|_| gone())
    }

    /// Whether nobody has claimed the session; then nobody can any more.
    fn withdraw(&self, token_hash: &str) -> bool {
        let mut slots = self.slots();
        if matches!(slots.get(token_hash), Some(Slot::Connected)) {
            return false;
        }
        slots.remove(token_hash);
        true
    }
}

/// Keeps a session whose connection is gone until its client comes back, its grace or its time is spent, or
/// the server stops.
pub(crate) fn park(session: Box<Session>) {
    let (keeper, asked) = oneshot::channel();
    let token_hash = session.token_hash().to_owned();
    session.host().registry.slots().insert(token_hash.clone(), Slot::Waiting(keeper));
    tokio::spawn(keep(session, token_hash, asked));
}

async fn keep(mut session: Box<Session>, token_hash: String, mut asked: oneshot::Receiver<Handover>) {
    let host = session.host().clone();
    let _alive = host.alive();
    let mut grace = Some(Instant::now() + host.settings.resume_grace);
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
            ordered = session.order() => {
                // Nobody listens to what the client would be told.
                if session.obey(ordered).await.0 {
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
            () = host.stopping() => break Reason::Disconnected,
        }
    };
    if host.registry.withdraw(&token_hash) {
        let note = host.is_stopping().then_some("the server shut down");
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

fn give(handover: Handover, session: Box<Session>) {
    // The new connection may be gone already; then the session waits for the next.
    if let Err(session) = handover.send(session) {
        park(session);
    }
}
