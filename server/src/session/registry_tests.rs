//! Tests of the registry, one thread at a time.

use super::command::{Command, PendingCommand};
use super::registry::{Inbox, Registry};
use palmares_protocol::{Code, Refusal};
use palmares_store::Held;

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
