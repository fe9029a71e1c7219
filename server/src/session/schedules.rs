//! Random schedules of a session that its client resumes while its old connection drops, an organizer ends it, or another host takes
//! it over.
//!
//! `PALMARES_SCHEDULES=100000 cargo test -p palmares-server schedules -- --nocapture` tries more, and prints their number.

use super::command;

/// The module's copy with locks that try schedules.
mod sync {
    pub(super) use palmares_random_schedules::Mutex;
}

#[expect(clippy::duplicate_mod, reason = "this copy has other locks")]
#[expect(dead_code, reason = "the schedules use a part of it")]
#[path = "registry.rs"]
mod registry;

use command::Command;
use palmares_protocol::Code;
use palmares_random_schedules::try_schedules;
use palmares_store::Held;
use registry::{Claim, Inbox, Registry};
use shuttle::rand::{Rng, thread_rng};
use shuttle::sync::Arc;
use shuttle::sync::atomic::{AtomicUsize, Ordering};
use shuttle::{future, thread};

/// Number of schedules that the tests try.
const SCHEDULES: usize = 300;
/// The hash of the session's token.
const TOKEN: &str = "hash";

/// A session; the test counts how many tasks hold it.
#[derive(Debug)]
struct Token {
    inbox: Inbox<Token>,
}

struct Place {
    registry: Registry<Token>,
    held: Held,
    /// Tasks that hold the session.
    holders: AtomicUsize,
    /// How often it has ended here.
    ends: AtomicUsize,
}

/// What the holder of a session gets next.
enum Next {
    Claim(Claim<Token>),
    End,
    Lost,
    /// The connection drops, or the grace period ends.
    Alone,
}

impl Place {
    fn new() -> (Arc<Self>, Box<Token>) {
        let (registry, held) = (Registry::default(), Held::new("ses".into(), 1));
        let inbox = registry.insert(TOKEN, &held).expect("new");
        let (holders, ends) = (AtomicUsize::new(0), AtomicUsize::new(0));
        (Arc::new(Place { registry, held, holders, ends }), Box::new(Token { inbox }))
    }

    /// A connection with the session, as `Connection::run` and `Connection::end`.
    fn connection(&self, mut session: Box<Token>) {
        self.enters();
        // The client may stay, so that only others end this.
        match future::block_on(next(&mut session, &self.held, thread_rng().gen_bool(0.5))) {
            Next::Claim(claim) => self.give(session, claim),
            Next::End | Next::Lost => self.ends_here(session),
            Next::Alone => self.park(session),
        }
    }

    /// As `Session::wait` and `keep`.
    fn park(&self, mut session: Box<Token>) {
        self.registry.wait(&self.held, TOKEN);
        let next = future::block_on(next(&mut session, &self.held, true));
        match next {
            Next::Claim(claim) => return self.give(session, claim),
            Next::End | Next::Lost => return self.ends_here(session),
            Next::Alone => {}
        }
        if self.registry.withdraw(&self.held, TOKEN) {
            assert!(
                session.inbox.claims.try_recv().is_err(),
                "a session that a client has claimed was withdrawn"
            );
            return self.ends_here(session);
        }
        // Claimed meanwhile.
        let claim = future::block_on(session.inbox.claims.recv()).expect("claimed");
        self.give(session, claim);
    }

    /// As `Session::give`.
    fn give(&self, session: Box<Token>, claim: Claim<Token>) {
        self.holders.fetch_sub(1, Ordering::SeqCst);
        if let Err(session) = claim.to.send(session) {
            self.enters();
            self.park(session);
        }
    }

    /// As `Session::end` and `Session::part`.
    fn ends_here(&self, session: Box<Token>) {
        self.registry.remove(&self.held);
        self.ends.fetch_add(1, Ordering::SeqCst);
        self.holders.fetch_sub(1, Ordering::SeqCst);
        drop(session);
    }

    fn enters(&self) {
        assert_eq!(self.holders.fetch_add(1, Ordering::SeqCst), 0, "two tasks hold the session");
    }

    /// A client that shows the token. It keeps the session for a while.
    fn resume(&self) {
        let claimed = match thread_rng().gen_bool(0.8) {
            true => future::block_on(self.registry.replace(TOKEN)),
            false => future::block_on(self.registry.claim(TOKEN)),
        };
        match claimed {
            Ok(session) => self.connection(session),
            Err(refusal) => assert!(matches!(refusal.code, Code::SessionOver | Code::SessionTaken)),
        }
    }
}

/// As the `select!` of a connection, and that of a waiting task. With `leaves` it may also end by itself.
async fn next(session: &mut Token, held: &Held, leaves: bool) -> Next {
    let alone = async {
        for _ in 0..thread_rng().gen_range(0..4) {
            future::yield_now().await;
        }
        if !leaves {
            std::future::pending::<()>().await;
        }
    };
    tokio::select! {
        biased;
        () = held.lost() => Next::Lost,
        command = session.inbox.commands.recv() => {
            let command = command.expect("the registry has the session");
            assert!(matches!(command.command, Command::End { .. }));
            // Nobody waits for it if the organizer's request was dropped.
            let _ = command.done.send(Ok(()));
            Next::End
        }
        claim = session.inbox.claims.recv() => match claim {
            Some(claim) => Next::Claim(claim),
            None => std::future::pending().await,
        },
        () = alone => Next::Alone,
    }
}

/// A connection with the session, two clients that resume it, and `other`. In the end the session has ended here once, and all have
/// their answer: otherwise the schedule does not end.
fn resumed_beside(other: impl Fn(&Place) + Send + Sync + 'static) {
    let (place, session) = Place::new();
    let spawn = |work: Box<dyn FnOnce(&Place) + Send>| {
        let place = place.clone();
        thread::spawn(move || work(&place))
    };
    let threads = [
        spawn(Box::new(move |place| place.connection(session))),
        spawn(Box::new(Place::resume)),
        spawn(Box::new(Place::resume)),
        spawn(Box::new(other)),
    ];
    for thread in threads {
        thread.join().expect("no panic");
    }
    assert_eq!((place.ends.load(Ordering::SeqCst), place.holders.load(Ordering::SeqCst)), (1, 0));
    assert_eq!((place.registry.len(), place.registry.knows("ses")), (0, false));
}

#[test]
fn registry_schedules_of_a_session_that_an_organizer_ends() {
    try_schedules("an end", SCHEDULES, || {
        resumed_beside(|place| {
            let end = Command::End { void: false, note: "a test".into() };
            let done = future::block_on(place.registry.command("ses", end));
            assert!(done.is_ok() || done.is_err_and(|refusal| refusal.code == Code::NotFound));
        });
    });
}

#[test]
fn registry_schedules_of_a_session_that_another_host_takes_over() {
    try_schedules("a take-over", SCHEDULES, || resumed_beside(|place| place.registry.lose_all()));
}
