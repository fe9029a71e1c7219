//! Which client may begin or resume a session, in practice and officially.

use super::failure::{random_hex, store_failed};
use super::registry::Registry;
use super::session::{Session, Sessions};
use crate::competition::rules::CompetitionPhase;
use palmares_net::auth::{Identity, sha256_hex};
use palmares_net::config::MAX_SESSION_S;
use palmares_protocol::{Code, Hello, Refusal};
use palmares_store::Store;
use palmares_store::names::{self, printable};
use palmares_tasks::Reason;
use std::sync::Arc;

/// The properties of a new session.
pub(super) struct Entry {
    pub(super) team: String,
    pub(super) client_version: Option<String>,
    pub(super) limit_s: Option<f64>,
    pub(super) mode: &'static str,
    /// Number of sessions that the team may have in total.
    pub(super) max_sessions: Option<u32>,
    /// A remark on the team's name, for `welcome`.
    pub(super) note: Option<String>,
}

/// The team of a client without a token, from the name that it gives, and a remark on that name. A known name is accepted
/// unchanged.
pub(crate) async fn practice_team(store: &Store, name: &str) -> Result<(String, Option<String>), Refusal> {
    let failed = store_failed("the session");
    let name = name.trim();
    if store.knows_team(name).await.map_err(&failed)? {
        return Ok((name.to_owned(), None));
    }
    let name = names::team(name).map_err(|error| error.of("the team's name"))?;
    let others = store.practice_teams().await.map_err(&failed)?;
    let others = others.iter().map(String::as_str).filter(|other| *other != name);
    let note = names::like(&name, others).map(|other| {
        format!(
            "`{name}` looks like the team `{}`, which was here before; spectators may mistake them",
            printable(other)
        )
    });
    Ok((name, note))
}

/// Decides whether this client may begin a session, and with which properties.
pub(super) async fn entry(
    sessions: &Sessions,
    hello: &Hello,
    identity: Option<&Identity>,
) -> Result<Entry, Refusal> {
    let (name, version) = hello.client.parts();
    let client_version =
        version.map(names::label).transpose().map_err(|error| error.of("client: the version"))?;
    let team = identity.and_then(|identity| identity.team.clone());
    let bad = |message: String| Refusal::new(Code::BadRequest, message);
    if !sessions.competition.rules.official() {
        if let Some(seconds) = hello.session_s
            && !(seconds > 0.0 && seconds <= MAX_SESSION_S)
        {
            return Err(bad(format!("session_s: expected more than 0 and at most {MAX_SESSION_S} s")));
        }
        let (team, note) = match team {
            Some(team) => (team, None),
            None => practice_team(&sessions.store, name).await?,
        };
        return Ok(Entry {
            team,
            client_version,
            limit_s: hello.session_s,
            mode: "practice",
            max_sessions: None,
            note,
        });
    }
    // The handshake requires a token; one without a team gets no session.
    let team = team.ok_or_else(|| Refusal::new(Code::NotAuthorized, "this needs a team's token"))?;
    if hello.session_s.is_some() {
        return Err(
            bad("session_s: the organizer sets the length of official sessions; leave it out".into()),
        );
    }
    is_open(sessions.competition.rules.phase())?;
    sessions.slot_now(&team).await?;
    let (limit_s, max_sessions) =
        (sessions.competition.rules.session_s, Some(sessions.competition.rules.sessions_per_team));
    Ok(Entry { team, client_version, limit_s, mode: "official", max_sessions, note: None })
}

/// Refuses a session in a phase in which none can begin.
pub(super) fn is_open(phase: CompetitionPhase) -> Result<(), Refusal> {
    match phase {
        CompetitionPhase::Open => Ok(()),
        CompetitionPhase::Closed => {
            let message = "the competition is closed; try again when it is open";
            Err(Refusal::new(Code::WrongState, message).retry_after(10.0))
        }
        CompetitionPhase::Revealed => Err(Refusal::new(Code::WrongState, "the competition is over")),
    }
}

/// Only its own team may resume a session. For others it does not exist.
pub(super) async fn may_resume(
    sessions: &Sessions,
    token: &str,
    identity: Option<&Identity>,
) -> Result<(), Refusal> {
    let Some(team) = identity.and_then(|identity| identity.team.as_ref()) else { return Ok(()) };
    let owner = sessions.store.team_of_resume_token(&sha256_hex(token.as_bytes())).await;
    match owner.map_err(store_failed("the session"))? {
        Some(owner) if owner != *team => {
            let message = "no session has this resume_token any more; send hello without it for a new one";
            Err(Refusal::new(Code::SessionOver, message))
        }
        _ => Ok(()),
    }
}

/// Resumes the open session of this client's team, if it has one: the team's token suffices, and the session gets a new
/// resume_token. A session without time ends if the team may have another one.
pub(super) async fn resume_by_team(
    sessions: &Arc<Sessions>,
    identity: Option<&Identity>,
) -> Result<Option<Box<Session>>, Refusal> {
    let Some(team) = identity.and_then(|identity| identity.team.as_ref()) else { return Ok(None) };
    if !sessions.competition.rules.official() {
        return Ok(None);
    }
    let open = sessions.store.open_session_of(team).await;
    let Some((session_id, old)) = open.map_err(store_failed("the session"))? else {
        return Ok(None);
    };
    sessions.fetch(&old, false).await?;
    let mut session = match sessions.registry.claim(&old).await {
        Ok(session) => session,
        // Another client resumes it and gives it a new token at this moment.
        Err(refusal) if refusal.code == Code::SessionOver && sessions.registry.knows(&session_id) => {
            return Err(Registry::<Session>::taken());
        }
        Err(refusal) if refusal.code == Code::SessionOver => return Ok(None),
        Err(refusal) => return Err(refusal),
    };
    if session.is_spent() {
        let had = sessions.store.official_sessions_of(team).await;
        match had {
            Ok(had) if had < sessions.competition.rules.sessions_per_team => {
                session.end(Reason::SessionOver, None).await;
                return Ok(None);
            }
            Ok(_) => {}
            Err(error) => {
                session.park();
                return Err(store_failed("the session")(error));
            }
        }
    }
    let token = match random_hex(16) {
        Ok(token) => token,
        Err(refusal) => {
            session.park();
            return Err(refusal);
        }
    };
    let new = sha256_hex(token.as_bytes());
    if let Err(error) = sessions.store.set_resume_token(&session.held, &new).await {
        session.park();
        return Err(store_failed("the session")(error));
    }
    sessions.registry.rekey(&session.held, &old, &new);
    session.go_on().await;
    session.rekey(token, new);
    Ok(Some(session))
}
