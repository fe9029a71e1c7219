//! The open sessions, connected or waiting for their client, and the channels for commands of organizers and for claims of new
//! connections. It is generic over the session.

use super::command::{Command, PendingCommand};
use super::sync::Mutex;
use palmares_protocol::text::shortened;
use palmares_protocol::{Code, Refusal};
use palmares_store::Held;
use std::collections::HashMap;
use tokio::sync::{mpsc, oneshot};

/// The request of a new connection for a session.
#[derive(Debug)]
pub(crate) struct Claim<S> {
    /// The token that was shown; the session may have another one since.
    pub(super) token_hash: String,
    /// Gets the session.
    pub(super) to: oneshot::Sender<Box<S>>,
}

/// The claims of new connections.
pub(super) type Claims<S> = mpsc::UnboundedReceiver<Claim<S>>;

/// The messages of others to a session; its holder reads them.
#[derive(Debug)]
pub(crate) struct Inbox<S> {
    /// Commands of organizers.
    pub(super) commands: mpsc::Receiver<PendingCommand>,
    /// Claims of new connections.
    pub(super) claims: Claims<S>,
}

#[derive(Debug)]
struct Holder<S> {
    held: Held,
    /// Whether a task keeps the session for its client; otherwise a connection holds it, or gets it now.
    waiting: bool,
    /// Never more than one claim for each connection, so that the queue needs no bound of its own.
    claims: mpsc::UnboundedSender<Claim<S>>,
}

impl<S> Holder<S> {
    fn is_of(&self, held: &Held) -> bool {
        self.held.session_id == held.session_id && self.held.epoch == held.epoch
    }
}

/// Longest queue of commands for a session.
const COMMAND_QUEUE: usize = 8;

/// The open sessions by the hash of their resume token, and their command channels by session id. A lock is held for a look-up only;
/// that of the channels is taken first.
#[derive(Debug)]
pub(crate) struct Registry<S> {
    holders: Mutex<HashMap<String, Holder<S>>>,
    commands: Mutex<HashMap<String, Channel>>,
}

/// An open session, as others see it.
#[derive(Clone, Debug)]
struct Channel {
    held: Held,
    commands: mpsc::Sender<PendingCommand>,
}

impl Channel {
    fn new(held: &Held) -> (Self, mpsc::Receiver<PendingCommand>) {
        let (commands, receiver) = mpsc::channel(COMMAND_QUEUE);
        (Channel { held: held.clone(), commands }, receiver)
    }
}

impl<S> Default for Registry<S> {
    fn default() -> Self {
        Registry { holders: Mutex::default(), commands: Mutex::default() }
    }
}

impl<S> Registry<S> {
    /// Number of open sessions.
    pub(crate) fn len(&self) -> usize {
        self.holders.lock().len()
    }

    /// Adds a session, held by a connection, unless it is open already. One that this process has lost and taken again replaces the
    /// lost one, whose holder may not have noticed yet.
    pub(super) fn insert(&self, token_hash: &str, held: &Held) -> Option<Inbox<S>> {
        let (channel, commands) = Channel::new(held);
        let (sender, claims) = mpsc::unbounded_channel();
        let mut channels = self.commands.lock();
        if let Some(earlier) = channels.get(&held.session_id) {
            if earlier.held.epoch >= held.epoch {
                return None;
            }
            earlier.held.lose();
            self.holders.lock().retain(|_, holder| holder.held.session_id != held.session_id);
        }
        channels.insert(held.session_id.clone(), channel);
        let holder = Holder { held: held.clone(), waiting: false, claims: sender };
        self.holders.lock().insert(token_hash.to_owned(), holder);
        Some(Inbox { commands, claims })
    }

    /// Removes a session that has ended.
    pub(super) fn remove(&self, held: &Held) {
        let mut channels = self.commands.lock();
        if channels.get(&held.session_id).is_some_and(|channel| channel.held.epoch == held.epoch) {
            channels.remove(&held.session_id);
            self.holders.lock().retain(|_, holder| holder.held.session_id != held.session_id);
        }
    }

    /// Sends a command to a session and waits for its result.
    pub(crate) async fn command(&self, session_id: &str, command: Command) -> Result<(), Refusal> {
        let gone = || Refusal::new(Code::NotFound, format!("no open session `{}`", shortened(session_id)));
        let channel = self.commands.lock().get(session_id).cloned().ok_or_else(gone)?;
        let (done, result) = oneshot::channel();
        channel.commands.send(PendingCommand { command, done }).await.map_err(|_| gone())?;
        result.await.map_err(|_| gone())?
    }

    /// Replaces the resume token of a session that a connection holds.
    pub(super) fn rekey(&self, held: &Held, old: &str, new: &str) {
        let mut holders = self.holders.lock();
        if holders.get(old).is_some_and(|holder| holder.is_of(held))
            && let Some(holder) = holders.remove(old)
        {
            holders.insert(new.to_owned(), holder);
        }
    }

    /// The sessions that are open here.
    pub(crate) fn held(&self) -> Vec<Held> {
        self.commands.lock().values().map(|channel| channel.held.clone()).collect()
    }

    /// Gives up all sessions: they end here, and continue elsewhere.
    pub(crate) fn lose_all(&self) {
        self.commands.lock().values().for_each(|channel| channel.held.lose());
    }

    /// Whether a connection holds the session of this id.
    pub(super) fn is_connected(&self, token_hash: &str) -> bool {
        self.holders.lock().get(token_hash).is_some_and(|holder| !holder.waiting)
    }

    /// Whether the session with this token is open here.
    pub(super) fn has(&self, token_hash: &str) -> bool {
        self.holders.lock().get(token_hash).is_some_and(|holder| !holder.held.is_lost())
    }

    /// Whether a session is open here, under any token.
    pub(super) fn knows(&self, session_id: &str) -> bool {
        self.commands.lock().get(session_id).is_some_and(|channel| !channel.held.is_lost())
    }

    /// The refusal for a session that another connection holds.
    pub(super) fn taken() -> Refusal {
        Refusal::new(Code::SessionTaken, "another connection holds this session").retry_after(1.0)
    }

    /// Takes a waiting session for its client's new connection.
    pub(super) async fn claim(&self, token_hash: &str) -> Result<Box<S>, Refusal> {
        self.take(token_hash, false).await
    }

    /// Takes a session for a connection that shows its resume token, also from an earlier connection: that one may be dead
    /// without the server's knowledge.
    pub(super) async fn replace(&self, token_hash: &str) -> Result<Box<S>, Refusal> {
        self.take(token_hash, true).await
    }

    async fn take(&self, token_hash: &str, held: bool) -> Result<Box<S>, Refusal> {
        let gone = || {
            let message = "no session has this resume_token any more; send hello without it for a new one";
            Refusal::new(Code::SessionOver, message)
        };
        let (to, session) = oneshot::channel();
        {
            let mut holders = self.holders.lock();
            let holder = holders.get_mut(token_hash).ok_or_else(gone)?;
            if !holder.waiting && !held {
                return Err(Self::taken());
            }
            holder.waiting = false;
            let claim = Claim { token_hash: token_hash.to_owned(), to };
            holder.claims.send(claim).map_err(|_| gone())?;
        }
        session.await.map_err(|_| gone())
    }

    /// A task keeps the session while its client is away.
    pub(super) fn wait(&self, held: &Held, token_hash: &str) {
        if let Some(holder) = self.holders.lock().get_mut(token_hash).filter(|holder| holder.is_of(held)) {
            holder.waiting = true;
        }
    }

    /// Removes the session unless a connection has claimed it. Returns whether no connection can claim it any more.
    pub(super) fn withdraw(&self, held: &Held, token_hash: &str) -> bool {
        let mut holders = self.holders.lock();
        let Some(holder) = holders.get(token_hash).filter(|holder| holder.is_of(held)) else { return true };
        if holder.waiting {
            holders.remove(token_hash);
            return true;
        }
        false
    }
}
