//! What official sessions do differently: whose they are, when they may begin, with which seed and hand a run is
//! played.

use super::Host;
use super::driver::{Session, hash_of, random_hex, store_failed};
use super::host::LONGEST_SESSION_S;
use super::registry::Registry;
use crate::auth::Identity;
use crate::names::{self, printable};
use crate::protocol::request::shortened;
use crate::protocol::{Code, Hello, Refusal};
use crate::rules::Phase;
use palmares_models::hand::Hand;
use palmares_tasks::{Seed, Task};
use std::sync::Arc;

/// What a session begins with.
pub(super) struct Entry {
    pub(super) team: String,
    pub(super) client_version: Option<String>,
    pub(super) limit_s: Option<f64>,
    pub(super) mode: &'static str,
    /// How many sessions the team may have had, this one included.
    pub(super) most: Option<u32>,
    /// What the team is told about its name.
    pub(super) note: Option<String>,
}

/// Where a run's scene comes from.
pub(super) struct Origin {
    pub(super) seed: Seed,
    /// What the client is told, in practice.
    pub(super) number: Option<u64>,
    /// The number of the run, officially.
    pub(super) k: Option<u64>,
}

/// A practice seed that a person can type.
fn random_seed() -> Result<u64, Refusal> {
    let hex = random_hex(4)?;
    Ok(u64::from_str_radix(&hex, 16).unwrap_or_default())
}

/// The team of somebody without a token, by the name it gives itself; and what it is told about it. A name that has been
/// here before stays as it is.
pub(crate) async fn practice_team(host: &Host, name: &str) -> Result<(String, Option<String>), Refusal> {
    let failed = |error| store_failed("the session", &error);
    let name = name.trim();
    if host.store.knows_team(name).await.map_err(failed)? {
        return Ok((name.to_owned(), None));
    }
    let name = names::team(name).map_err(|error| error.of("the team's name"))?;
    let others = host.store.practice_teams().await.map_err(failed)?;
    let others = others.iter().map(String::as_str).filter(|other| *other != name);
    let note = names::like(&name, others).map(|other| {
        format!(
            "`{name}` looks like the team `{}`, which was here before; spectators may mistake them",
            printable(other)
        )
    });
    Ok((name, note))
}

/// Whether this client may begin a session, and which.
pub(super) async fn entry(host: &Host, hello: &Hello, identity: Option<&Identity>) -> Result<Entry, Refusal> {
    let (name, version) = hello.client.parts();
    let client_version =
        version.map(names::label).transpose().map_err(|error| error.of("client: the version"))?;
    let team = identity.and_then(|identity| identity.team.clone());
    let bad = |message: String| Refusal::new(Code::BadRequest, message);
    if !host.rules.official() {
        if let Some(seconds) = hello.session_s
            && !(seconds > 0.0 && seconds <= LONGEST_SESSION_S)
        {
            return Err(bad(format!("session_s: expected more than 0 and at most {LONGEST_SESSION_S} s")));
        }
        let (team, note) = match team {
            Some(team) => (team, None),
            None => practice_team(host, name).await?,
        };
        return Ok(Entry {
            team,
            client_version,
            limit_s: hello.session_s,
            mode: "practice",
            most: None,
            note,
        });
    }
    // The handshake has seen to it; whoever has no team has no session.
    let team = team.ok_or_else(|| Refusal::new(Code::NotAuthorized, "this needs a team's token"))?;
    if hello.session_s.is_some() {
        return Err(
            bad("session_s: the organizer sets the length of official sessions; leave it out".into()),
        );
    }
    match host.rules.phase() {
        Phase::Open => {}
        Phase::Closed => {
            let message = "the competition is closed; ask again when it is open";
            return Err(Refusal::new(Code::WrongState, message).retry_after(10.0));
        }
        Phase::Revealed => return Err(Refusal::new(Code::WrongState, "the competition is over")),
    }
    let (limit_s, most) = (host.rules.session_s, Some(host.rules.sessions_per_team));
    Ok(Entry { team, client_version, limit_s, mode: "official", most, note: None })
}

/// A session is taken up by its own team only. To others it does not exist.
pub(super) async fn may_resume(host: &Host, token: &str, identity: Option<&Identity>) -> Result<(), Refusal> {
    let Some(team) = identity.and_then(|identity| identity.team.as_ref()) else { return Ok(()) };
    let owner = host.store.team_of_resume_token(&hash_of(token)).await;
    match owner.map_err(|error| store_failed("the session", &error))? {
        Some(owner) if owner != *team => {
            let message = "no session has this resume_token any more; say hello without it for a new one";
            Err(Refusal::new(Code::SessionOver, message))
        }
        _ => Ok(()),
    }
}

/// The open session of this client's team, if it has one: its token alone takes it up again, under a new
/// resume_token.
pub(super) async fn take_up(
    host: &Host,
    identity: Option<&Identity>,
) -> Result<Option<Box<Session>>, Refusal> {
    let Some(team) = identity.and_then(|identity| identity.team.as_ref()) else { return Ok(None) };
    if !host.rules.official() {
        return Ok(None);
    }
    let open = host.store.open_session_of(team).await;
    let Some((session_id, old)) = open.map_err(|error| store_failed("the session", &error))? else {
        return Ok(None);
    };
    let mut session = match host.registry.claim(&old).await {
        Ok(session) => session,
        // Whoever takes it up gives it a new secret at this moment.
        Err(refusal) if refusal.code == Code::SessionOver && host.registry.knows(&session_id) => {
            return Err(Registry::taken());
        }
        Err(refusal) if refusal.code == Code::SessionOver => return Ok(None),
        Err(refusal) => return Err(refusal),
    };
    let token = match random_hex(16) {
        Ok(token) => token,
        Err(refusal) => {
            session.park();
            return Err(refusal);
        }
    };
    let new = hash_of(&token);
    if let Err(error) = host.store.set_resume_token(&session_id, &new).await {
        session.park();
        return Err(store_failed("the session", &error));
    }
    host.registry.rekey(&old, &new);
    session.rekey(token, new);
    Ok(Some(session))
}

/// Where the next run's scene comes from.
pub(super) async fn origin(
    host: &Host,
    team: &str,
    task: &Task,
    asked: Option<u64>,
) -> Result<Origin, Refusal> {
    if !host.rules.official() {
        let number = match asked {
            Some(number) => number,
            None => random_seed()?,
        };
        return Ok(Origin { seed: Seed::from_u64(number), number: Some(number), k: None });
    }
    let k = host.store.next_k(team, &task.name).await;
    let k = k.map_err(|error| store_failed("the run", &error))?;
    let seed = host.rules.seed(&task.name, k).ok_or_else(|| {
        tracing::error!("an official session without a seed secret");
        Refusal::new(Code::Internal, "the server has no seeds")
    })?;
    Ok(Origin { seed, number: None, k: Some(k) })
}

/// The number of a run that could not be opened is the next run's.
pub(super) async fn give_back_number(
    host: &Host,
    team: &str,
    task: &Task,
    k: Option<u64>,
) -> Result<(), Refusal> {
    let Some(k) = k else { return Ok(()) };
    let given = host.store.give_back_k(team, &task.name, k).await;
    given.map_err(|error| store_failed("the run's number", &error))
}

/// The hand of that name: one of the server's, or one the team sent in, and then the SHA-256 of its archive.
pub(super) async fn hand(
    host: &Host,
    team: &str,
    name: &str,
) -> Result<(Arc<Hand>, Option<String>), Refusal> {
    if let Some(hand) = host.hand(name) {
        return Ok((hand.clone(), None));
    }
    let official = host.rules.official();
    let own = host.own_hands.find(&host.store, &host.compute.background, team, name, official).await?;
    if let Some((hand, sha256)) = own {
        return Ok((hand, Some(sha256)));
    }
    let known: Vec<&str> = host.hands.iter().map(|hand| hand.name.as_str()).collect();
    let what = if official { "approved hands of your own" } else { "hands of your own" };
    let message = format!("no hand `{}`; there are: {} and {what}", shortened(name), known.join(", "));
    Err(Refusal::new(Code::UnknownHand, message))
}

/// Makes a team's own hand known to the archive: a replay must stand on its own.
pub(super) fn provide(host: &Host, hand: &Hand, sha256: Option<&str>) -> Result<(), Refusal> {
    let (Some(archive), Some(sha256)) = (&host.replays, sha256) else { return Ok(()) };
    let files = host.own_hands.archive(sha256).map_err(|error| {
        tracing::error!(%error, hand = hand.name, "no archive");
        Refusal::new(Code::Internal, "the hand could not be loaded; try again").retry_after(5.0)
    })?;
    archive.add_hand(hand, Arc::new(files));
    Ok(())
}
