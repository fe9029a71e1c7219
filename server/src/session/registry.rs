//! Where sessions wait for clients that lost their connection, and how organizers reach them. It does not know what a
//! session is.

use super::command::{Command, PendingCommand};
use palmares_protocol::text::shortened;
use palmares_protocol::{Code, Refusal};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::{Mutex, MutexGuard, PoisonError};
use tokio::sync::{mpsc, oneshot};

/// How a waiting session is given to its client's new connection.
pub(super) type Handover<S> = oneshot::Sender<Box<S>>;

#[derive(Debug)]
enum Holder<S> {
    /// A connection holds the session.
    Connection,
    /// A task keeps it until somebody asks.
    Task(oneshot::Sender<Handover<S>>),
}

/// Commands that wait for a session at most.
const COMMANDS: usize = 8;

/// All sessions by the hash of their resume token, and the ways to them by their id. The locks are held for a look-up
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

    fn ways(&self) -> MutexGuard<'_, HashMap<String, mpsc::Sender<PendingCommand>>> {
        self.commands.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sessions now.
    pub(crate) fn len(&self) -> usize {
        self.holders().len()
    }

    /// A new session, held by a connection. Returns where its commands come from.
    pub(super) fn insert(&self, token_hash: &str, session_id: &str) -> mpsc::Receiver<PendingCommand> {
        let (way, commands) = mpsc::channel(COMMANDS);
        self.holders().insert(token_hash.to_owned(), Holder::Connection);
        self.ways().insert(session_id.to_owned(), way);
        commands
    }

    /// The same for a session of the database that somebody else may have taken from there already.
    pub(super) fn insert_once(
        &self,
        token_hash: &str,
        session_id: &str,
    ) -> Option<mpsc::Receiver<PendingCommand>> {
        let (way, commands) = mpsc::channel(COMMANDS);
        match self.ways().entry(session_id.to_owned()) {
            Entry::Occupied(_) => return None,
            Entry::Vacant(free) => free.insert(way),
        };
        self.holders().insert(token_hash.to_owned(), Holder::Connection);
        Some(commands)
    }

    /// A session that ended.
    pub(super) fn remove(&self, token_hash: &str, session_id: &str) {
        self.holders().remove(token_hash);
        self.ways().remove(session_id);
    }

    /// Asks something of a session and waits until it is done.
    pub(crate) async fn command(&self, session_id: &str, command: Command) -> Result<(), Refusal> {
        let gone = || Refusal::new(Code::NotFound, format!("no open session `{}`", shortened(session_id)));
        let way = self.ways().get(session_id).cloned().ok_or_else(gone)?;
        let (done, result) = oneshot::channel();
        way.send(PendingCommand { command, done }).await.map_err(|_| gone())?;
        result.await.map_err(|_| gone())?
    }

    /// A session that a connection holds is known by another token from now on.
    pub(super) fn rekey(&self, old: &str, new: &str) {
        let mut holders = self.holders();
        if let Some(holder) = holders.remove(old) {
            holders.insert(new.to_owned(), holder);
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
    pub(crate) async fn claim(&self, token_hash: &str) -> Result<Box<S>, Refusal> {
        let gone = || {
            let message = "no session has this resume_token any more; say hello without it for a new one";
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

    /// Somebody keeps the session while its client is away. Returns where that is asked for it.
    pub(super) fn wait(&self, token_hash: &str) -> oneshot::Receiver<Handover<S>> {
        let (keeper, asked) = oneshot::channel();
        self.holders().insert(token_hash.to_owned(), Holder::Task(keeper));
        asked
    }

    /// Whether nobody has claimed the session; then nobody can any more.
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

    type Toys = Registry<&'static str>;

    fn code<T>(done: Result<T, Refusal>) -> Option<Code> {
        done.err().map(|refusal| refusal.code)
    }

    #[tokio::test]
    async fn a_session_that_waits_is_given_to_one_client_only() {
        let toys = Toys::default();
        let _commands = toys.insert("hash", "ses");
        assert_eq!(code(toys.claim("hash").await), Some(Code::SessionTaken), "a connection holds it");
        let asked = toys.wait("hash");
        let keeper = tokio::spawn(async move { asked.await.map(|handover| handover.send(Box::new("it"))) });
        assert_eq!(toys.claim("hash").await.map(|session| *session), Ok("it"));
        assert!(matches!(keeper.await, Ok(Ok(Ok(())))));
        assert_eq!(code(toys.claim("hash").await), Some(Code::SessionTaken));
        assert_eq!(code(toys.claim("other").await), Some(Code::SessionOver));
        assert_eq!(toys.len(), 1);
    }

    #[tokio::test]
    async fn it_is_claimed_or_withdrawn_but_not_both() {
        let toys = Toys::default();
        let _commands = toys.insert("hash", "ses");
        let asked = toys.wait("hash");
        assert!(toys.withdraw("hash"));
        drop(asked);
        assert_eq!(code(toys.claim("hash").await), Some(Code::SessionOver), "it is gone");
        let asked = toys.wait("hash");
        let claimed = async { toys.claim("hash").await };
        let late = async {
            let handover = asked.await.expect("asked for");
            assert!(!toys.withdraw("hash"), "it was claimed first");
            handover.send(Box::new("it")).expect("still wanted");
        };
        assert!(tokio::join!(claimed, late).0.is_ok());
    }

    #[tokio::test]
    async fn a_new_token_leads_to_the_same_session_and_the_old_one_nowhere() {
        let toys = Toys::default();
        let _commands = toys.insert("old", "ses");
        toys.rekey("old", "new");
        assert_eq!(code(toys.claim("old").await), Some(Code::SessionOver));
        assert_eq!(code(toys.claim("new").await), Some(Code::SessionTaken));
        assert!(toys.insert_once("third", "ses").is_none() && toys.knows("ses"));
        toys.remove("new", "ses");
        assert!(!toys.knows("ses") && toys.len() == 0);
    }

    #[tokio::test]
    async fn a_command_is_waited_for_until_it_is_done_or_nobody_is_left() {
        let toys = Toys::default();
        let mut commands = toys.insert("hash", "ses");
        let obey = async {
            let PendingCommand { command, done } = commands.recv().await.expect("asked");
            assert_eq!(command, Command::Pause);
            done.send(Ok(())).expect("waited for");
            let ignored = commands.recv().await.expect("asked again");
            drop((ignored, commands));
        };
        let ask = async {
            assert_eq!(toys.command("ses", Command::Pause).await, Ok(()));
            assert_eq!(code(toys.command("ses", Command::Resume).await), Some(Code::NotFound));
            assert_eq!(code(toys.command("ses", Command::Resume).await), Some(Code::NotFound));
        };
        tokio::join!(obey, ask);
        assert_eq!(code(toys.command("other", Command::Pause).await), Some(Code::NotFound));
    }
}
