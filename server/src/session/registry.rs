//! The open sessions, connected or waiting for their client, and the channels for commands of organizers. It is generic over
//! the session.

use super::command::{Command, PendingCommand};
use palmares_protocol::text::shortened;
use palmares_protocol::{Code, Refusal};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::{Mutex, MutexGuard, PoisonError};
use tokio::sync::{mpsc, oneshot};

/// Hands a waiting session to its client's new connection.
pub(super) type Handover<S> = oneshot::Sender<Box<S>>;

#[derive(Debug)]
enum Holder<S> {
    /// A connection holds the session.
    Connection,
    /// A task keeps it for its client.
    Task(oneshot::Sender<Handover<S>>),
}

/// Longest queue of commands for a session.
const COMMAND_QUEUE: usize = 8;

/// The open sessions by the hash of their resume token, and their command channels by session id. The locks are held for a look-up
/// only.
#[derive(Debug)]
pub(crate) struct Registry<S> {
    holders: Mutex<HashMap<String, Holder<S>>>,
    commands: Mutex<HashMap<String, mpsc::Sender<PendingCommand>>>,
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

    fn channels(&self) -> MutexGuard<'_, HashMap<String, mpsc::Sender<PendingCommand>>> {
        self.commands.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Number of open sessions.
    pub(crate) fn len(&self) -> usize {
        self.holders().len()
    }

    /// Adds a new session, held by a connection. Returns the receiver of its commands.
    pub(super) fn insert(&self, token_hash: &str, session_id: &str) -> mpsc::Receiver<PendingCommand> {
        let (channel, commands) = mpsc::channel(COMMAND_QUEUE);
        self.holders().insert(token_hash.to_owned(), Holder::Connection);
        self.channels().insert(session_id.to_owned(), channel);
        commands
    }

    /// Adds a session of the database, unless it is open already.
    pub(super) fn insert_once(
        &self,
        token_hash: &str,
        session_id: &str,
    ) -> Option<mpsc::Receiver<PendingCommand>> {
        let (channel, commands) = mpsc::channel(COMMAND_QUEUE);
        match self.channels().entry(session_id.to_owned()) {
            Entry::Occupied(_) => return None,
            Entry::Vacant(free) => free.insert(channel),
        };
        self.holders().insert(token_hash.to_owned(), Holder::Connection);
        Some(commands)
    }

    /// Removes a session that has ended.
    pub(super) fn remove(&self, token_hash: &str, session_id: &str) {
        self.holders().remove(token_hash);
        self.channels().remove(session_id);
    }

    /// Sends a command to a session and waits for its result.
    pub(crate) async fn command(&self, session_id: &str, command: Command) -> Result<(), Refusal> {
        let gone = || Refusal::new(Code::NotFound, format!("no open session `{}`", shortened(session_id)));
        let channel = self.channels().get(session_id).cloned().ok_or_else(gone)?;
        let (done, result) = oneshot::channel();
        channel.send(PendingCommand { command, done }).await.map_err(|_| gone())?;
        result.await.map_err(|_| gone())?
    }

    /// The ids of the open sessions.
    pub(super) fn ids(&self) -> Vec<String> {
        self.channels().keys().cloned().collect()
    }

    /// Replaces the resume token of a session that a connection holds.
    pub(super) fn rekey(&self, old: &str, new: &str) {
        let mut holders = self.holders();
        if let Some(holder) = holders.remove(old) {
            holders.insert(new.to_owned(), holder);
        }
    }

    /// Whether a session is open here, under any token.
    pub(super) fn knows(&self, session_id: &str) -> bool {
        self.channels().contains_key(session_id)
    }

    /// The refusal for a session that another connection holds.
    pub(super) fn taken() -> Refusal {
        Refusal::new(Code::SessionTaken, "another connection holds this session").retry_after(1.0)
    }

    /// Takes a waiting session for its client's new connection.
    pub(crate) async fn claim(&self, token_hash: &str) -> Result<Box<S>, Refusal> {
        let gone = || {
            let message = "no session has this resume_token any more; send hello without it for a new one";
            Refusal::new(Code::SessionOver, message)
        };
        let keeper = {
            let mut holders = self.holders();
            let holder = holders.get_mut(token_hash).ok_or_else(gone)?;
            match std::mem::replace(holder, Holder::Connection) {
                Holder::Task(keeper) => keeper,
                Holder::Connection => {
                    return Err(Self::taken());
                }
            }
        };
        let (handover, session) = oneshot::channel();
        keeper.send(handover).map_err(|_| gone())?;
        session.await.map_err(|_| gone())
    }

    /// A task keeps the session while its client is away. Returns the receiver of the new connection's claim.
    pub(super) fn wait(&self, token_hash: &str) -> oneshot::Receiver<Handover<S>> {
        let (keeper, claimed) = oneshot::channel();
        self.holders().insert(token_hash.to_owned(), Holder::Task(keeper));
        claimed
    }

    /// Removes the session unless a connection has claimed it. Returns whether it was removed.
    pub(super) fn withdraw(&self, token_hash: &str) -> bool {
        let mut holders = self.holders();
        if matches!(holders.get(token_hash), Some(Holder::Connection)) {
            return false;
        }
        holders.remove(token_hash);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type TestRegistry = Registry<&'static str>;

    fn code<T>(done: Result<T, Refusal>) -> Option<Code> {
        done.err().map(|refusal| refusal.code)
    }

    #[tokio::test]
    async fn only_one_client_gets_a_waiting_session() {
        let registry = TestRegistry::default();
        let _commands = registry.insert("hash", "ses");
        assert_eq!(code(registry.claim("hash").await), Some(Code::SessionTaken), "a connection holds it");
        let asked = registry.wait("hash");
        let keeper = tokio::spawn(async move { asked.await.map(|handover| handover.send(Box::new("it"))) });
        assert_eq!(registry.claim("hash").await.map(|session| *session), Ok("it"));
        assert!(matches!(keeper.await, Ok(Ok(Ok(())))));
        assert_eq!(code(registry.claim("hash").await), Some(Code::SessionTaken));
        assert_eq!(code(registry.claim("other").await), Some(Code::SessionOver));
        assert_eq!(registry.len(), 1);
    }

    #[tokio::test]
    async fn it_is_claimed_or_withdrawn_but_not_both() {
        let registry = TestRegistry::default();
        let _commands = registry.insert("hash", "ses");
        let asked = registry.wait("hash");
        assert!(registry.withdraw("hash"));
        drop(asked);
        assert_eq!(code(registry.claim("hash").await), Some(Code::SessionOver), "it is gone");
        let asked = registry.wait("hash");
        let claimed = async { registry.claim("hash").await };
        let late = async {
            let handover = asked.await.expect("asked for");
            assert!(!registry.withdraw("hash"), "it was claimed first");
            handover.send(Box::new("it")).expect("still wanted");
        };
        assert!(tokio::join!(claimed, late).0.is_ok());
    }

    #[tokio::test]
    async fn a_new_token_leads_to_the_same_session_and_the_old_one_nowhere() {
        let registry = TestRegistry::default();
        let _commands = registry.insert("old", "ses");
        registry.rekey("old", "new");
        assert_eq!(code(registry.claim("old").await), Some(Code::SessionOver));
        assert_eq!(code(registry.claim("new").await), Some(Code::SessionTaken));
        assert!(registry.insert_once("third", "ses").is_none() && registry.knows("ses"));
        registry.remove("new", "ses");
        assert!(!registry.knows("ses") && registry.len() == 0);
    }

    #[tokio::test]
    async fn a_command_returns_when_it_is_done_or_its_session_is_gone() {
        let registry = TestRegistry::default();
        let mut commands = registry.insert("hash", "ses");
        let obey = async {
            let PendingCommand { command, done } = commands.recv().await.expect("asked");
            assert_eq!(command, Command::Pause);
            done.send(Ok(())).expect("waited for");
            let ignored = commands.recv().await.expect("asked again");
            drop((ignored, commands));
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
