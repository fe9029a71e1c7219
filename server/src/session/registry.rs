//! The open sessions, connected or waiting for their client, and the channels for commands of organizers and for claims of new
//! connections. It is generic over the session.

use super::command::{Command, PendingCommand};
use crate::store::Held;
use palmares_protocol::text::shortened;
use palmares_protocol::{Code, Refusal};
use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
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
    fn holders(&self) -> MutexGuard<'_, HashMap<String, Holder<S>>> {
        // Nothing panics while it holds the lock; if something did, the map would still be whole.
        self.holders.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn channels(&self) -> MutexGuard<'_, HashMap<String, Channel>> {
        self.commands.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Number of open sessions.
    pub(crate) fn len(&self) -> usize {
        self.holders().len()
    }

    /// Adds a session, held by a connection, unless it is open already. One that this process has lost and taken again replaces the
    /// lost one, whose holder may not have noticed yet.
    pub(super) fn insert(&self, token_hash: &str, held: &Held) -> Option<Inbox<S>> {
        let (channel, commands) = Channel::new(held);
        let (sender, claims) = mpsc::unbounded_channel();
        let mut channels = self.channels();
        if let Some(earlier) = channels.get(&held.session_id) {
            if earlier.held.epoch >= held.epoch {
                return None;
            }
            earlier.held.lose();
            self.holders().retain(|_, holder| holder.held.session_id != held.session_id);
        }
        channels.insert(held.session_id.clone(), channel);
        let holder = Holder { held: held.clone(), waiting: false, claims: sender };
        self.holders().insert(token_hash.to_owned(), holder);
        Some(Inbox { commands, claims })
    }

    /// Removes a session that has ended.
    pub(super) fn remove(&self, held: &Held) {
        let mut channels = self.channels();
        if channels.get(&held.session_id).is_some_and(|channel| channel.held.epoch == held.epoch) {
            channels.remove(&held.session_id);
            self.holders().retain(|_, holder| holder.held.session_id != held.session_id);
        }
    }

    /// Sends a command to a session and waits for its result.
    pub(crate) async fn command(&self, session_id: &str, command: Command) -> Result<(), Refusal> {
        let gone = || Refusal::new(Code::NotFound, format!("no open session `{}`", shortened(session_id)));
        let channel = self.channels().get(session_id).cloned().ok_or_else(gone)?;
        let (done, result) = oneshot::channel();
        channel.commands.send(PendingCommand { command, done }).await.map_err(|_| gone())?;
        result.await.map_err(|_| gone())?
    }

    /// Replaces the resume token of a session that a connection holds.
    pub(super) fn rekey(&self, held: &Held, old: &str, new: &str) {
        let mut holders = self.holders();
        if holders.get(old).is_some_and(|holder| holder.is_of(held))
            && let Some(holder) = holders.remove(old)
        {
            holders.insert(new.to_owned(), holder);
        }
    }

    /// The sessions that are open here.
    pub(crate) fn held(&self) -> Vec<Held> {
        self.channels().values().map(|channel| channel.held.clone()).collect()
    }

    /// Gives up all sessions: they end here, and continue elsewhere.
    pub(crate) fn lose_all(&self) {
        self.channels().values().for_each(|channel| channel.held.lose());
    }

    /// Whether a connection holds the session of this id.
    pub(super) fn is_connected(&self, token_hash: &str) -> bool {
        self.holders().get(token_hash).is_some_and(|holder| !holder.waiting)
    }

    /// Whether the session with this token is open here.
    pub(super) fn has(&self, token_hash: &str) -> bool {
        self.holders().get(token_hash).is_some_and(|holder| !holder.held.is_lost())
    }

    /// Whether a session is open here, under any token.
    pub(super) fn knows(&self, session_id: &str) -> bool {
        self.channels().get(session_id).is_some_and(|channel| !channel.held.is_lost())
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
            let mut holders = self.holders();
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
        if let Some(holder) = self.holders().get_mut(token_hash).filter(|holder| holder.is_of(held)) {
            holder.waiting = true;
        }
    }

    /// Removes the session unless a connection has claimed it. Returns whether no connection can claim it any more.
    pub(super) fn withdraw(&self, held: &Held, token_hash: &str) -> bool {
        let mut holders = self.holders();
        let Some(holder) = holders.get(token_hash).filter(|holder| holder.is_of(held)) else { return true };
        if holder.waiting {
            holders.remove(token_hash);
            return true;
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn held() -> Held {
        Held::new("ses".into(), 1)
    }

    type TestRegistry = Registry<&'static str>;

    fn code<T>(done: Result<T, Refusal>) -> Option<Code> {
        done.err().map(|refusal| refusal.code)
    }

    /// Gives the session to the next claim.
    async fn give(inbox: &mut Inbox<&'static str>) -> Result<(), Box<&'static str>> {
        inbox.claims.recv().await.expect("claimed").to.send(Box::new("it"))
    }

    #[tokio::test]
    async fn only_one_client_gets_a_waiting_session() {
        let registry = TestRegistry::default();
        let mut inbox = registry.insert("hash", &held()).expect("new");
        assert_eq!(code(registry.claim("hash").await), Some(Code::SessionTaken), "a connection holds it");
        registry.wait(&held(), "hash");
        let (claimed, given) = tokio::join!(registry.claim("hash"), give(&mut inbox));
        assert_eq!((claimed.map(|session| *session), given), (Ok("it"), Ok(())));
        assert_eq!(code(registry.claim("hash").await), Some(Code::SessionTaken));
        assert_eq!(code(registry.claim("other").await), Some(Code::SessionOver));
        assert_eq!(registry.len(), 1);
    }

    #[tokio::test]
    async fn a_session_is_taken_from_a_connection_by_its_token() {
        let registry = TestRegistry::default();
        let mut inbox = registry.insert("hash", &held()).expect("new");
        for _ in 0..2 {
            let (claimed, given) = tokio::join!(registry.replace("hash"), give(&mut inbox));
            assert_eq!((claimed.map(|session| *session), given), (Ok("it"), Ok(())));
            assert_eq!(code(registry.claim("hash").await), Some(Code::SessionTaken));
        }
        assert_eq!(code(registry.replace("other").await), Some(Code::SessionOver));
        // The session ends before its holder reads the claim.
        let (claimed, ()) = tokio::join!(registry.replace("hash"), async { drop(inbox) });
        assert_eq!(code(claimed), Some(Code::SessionOver));
    }

    #[tokio::test]
    async fn it_is_claimed_or_withdrawn_but_not_both() {
        let registry = TestRegistry::default();
        let inbox = registry.insert("hash", &held()).expect("new");
        registry.wait(&held(), "hash");
        assert!(registry.withdraw(&held(), "hash"));
        assert_eq!(code(registry.claim("hash").await), Some(Code::SessionOver), "it is gone");
        registry.remove(&held());
        drop(inbox);
        let mut inbox = registry.insert("hash", &held()).expect("new");
        registry.wait(&held(), "hash");
        let late = async {
            assert!(!registry.withdraw(&held(), "hash"), "it was claimed first");
            give(&mut inbox).await.expect("still wanted");
        };
        assert!(tokio::join!(registry.claim("hash"), late).0.is_ok());
    }

    #[tokio::test]
    async fn a_new_token_leads_to_the_same_session_and_the_old_one_nowhere() {
        let registry = TestRegistry::default();
        let _inbox = registry.insert("old", &held()).expect("new");
        registry.rekey(&held(), "old", "new");
        assert_eq!(code(registry.replace("old").await), Some(Code::SessionOver));
        assert_eq!(code(registry.claim("new").await), Some(Code::SessionTaken));
        assert!(registry.insert("third", &held()).is_none() && registry.knows("ses"));
        registry.remove(&held());
        assert!(!registry.knows("ses") && registry.len() == 0);
    }

    #[tokio::test]
    async fn a_session_that_was_lost_and_taken_again_replaces_the_lost_one() {
        let registry = TestRegistry::default();
        let (lost, again) = (held(), Held::new("ses".into(), 3));
        let _late = registry.insert("old", &lost).expect("new");
        assert!(registry.insert("old", &held()).is_none(), "the same epoch");
        lost.lose();
        assert!(!registry.has("old") && !registry.knows("ses"), "a lost session is not here");
        let mut inbox = registry.insert("hash", &again).expect("a later epoch");
        assert!(!registry.has("old") && registry.has("hash") && registry.len() == 1);
        // The late holder changes nothing any more.
        registry.wait(&lost, "hash");
        registry.rekey(&lost, "hash", "other");
        registry.remove(&lost);
        assert!(registry.withdraw(&lost, "hash"), "nobody can claim the lost one");
        assert_eq!(code(registry.claim("hash").await), Some(Code::SessionTaken));
        registry.wait(&again, "hash");
        let (claimed, given) = tokio::join!(registry.claim("hash"), give(&mut inbox));
        assert_eq!((claimed.map(|session| *session), given), (Ok("it"), Ok(())));
        registry.remove(&again);
        assert!(registry.len() == 0 && !registry.knows("ses"));
    }

    #[tokio::test]
    async fn a_command_returns_when_it_is_done_or_its_session_is_gone() {
        let registry = TestRegistry::default();
        let mut inbox = registry.insert("hash", &held()).expect("new");
        let obey = async {
            let PendingCommand { command, done } = inbox.commands.recv().await.expect("a command");
            assert_eq!(command, Command::Pause);
            done.send(Ok(())).expect("waited for");
            let ignored = inbox.commands.recv().await.expect("another command");
            drop((ignored, inbox));
        };
        let ask = async {
            assert_eq!(registry.command("ses", Command::Pause).await, Ok(()));
            assert_eq!(code(registry.command("ses", Command::Resume).await), Some(Code::NotFound));
            assert_eq!(code(registry.command("ses", Command::Resume).await), Some(Code::NotFound));
        };
        tokio::join!(obey, ask);
        assert_eq!(code(registry.command("other", Command::Pause).await), Some(Code::NotFound));
    }
}
