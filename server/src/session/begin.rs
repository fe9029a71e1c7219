//! The begin of a session, and its resumption by a client that reconnects.

use super::entry::{self, Entry};
use super::failure::{random_hex, store_failed};
use super::machine::Machine;
use super::session::{Session, SessionIds, Sessions};
use palmares_net::auth::{Identity, sha256_hex};
use palmares_protocol::{Code, Hello, Refusal};
use palmares_store::{FIRST_EPOCH, Held, NewSession};
use std::sync::Arc;

impl Sessions {
    /// Begins a session, or resumes the one that waits for this client.
    ///
    /// # Errors
    /// The client may not begin one, or the session that it names has ended.
    pub(crate) async fn greet(
        self: &Arc<Self>,
        hello: &Hello,
        identity: Option<&Identity>,
    ) -> Result<Box<Session>, Refusal> {
        match &hello.resume_token {
            Some(token) => self.resume(token, identity).await,
            None => self.begin(hello, identity).await,
        }
    }

    async fn begin(
        self: &Arc<Self>,
        hello: &Hello,
        identity: Option<&Identity>,
    ) -> Result<Box<Session>, Refusal> {
        if let Some(session) = entry::resume_by_team(self, identity).await? {
            tracing::info!(session = session.held.session_id, "session resumed by its team's token");
            return Ok(session);
        }
        let Entry { team, client_version, limit_s, mode, max_sessions, note } =
            entry::entry(self, hello, identity).await?;
        let official = self.competition.rules.official();
        self.check_reserve().await?;
        let session_id = format!("ses_{}", random_hex(8)?);
        let resume_token = random_hex(16)?;
        let token_hash = sha256_hex(resume_token.as_bytes());
        let row = NewSession {
            session_id: session_id.clone(),
            team: team.clone(),
            client_version,
            limit_s,
            mode,
            token_hash: Some(token_hash.clone()),
        };
        let held = Held::new(session_id.clone(), FIRST_EPOCH);
        // Before the row is in the database: another client then finds the session taken, not ended.
        let inbox = self.registry.insert(&token_hash, &held);
        let inbox =
            inbox.ok_or_else(|| Refusal::new(Code::Internal, "the session's id is in use; try again"))?;
        let begun = self.store.begin_session(&row, max_sessions).await;
        let begun = begun.map_err(store_failed("the session"));
        if !matches!(begun, Ok(true)) {
            self.registry.remove(&held);
            begun?;
            // Another connection of the team may have been first.
            if let Some(session) = entry::resume_by_team(self, identity).await? {
                return Ok(session);
            }
            let state = self.store.competition_state().await.map_err(store_failed("the session"))?;
            if official {
                entry::is_open(state.phase)?;
            }
            let message = "the team has had all its sessions; ask the organizer";
            return Err(Refusal::new(Code::SessionOver, message));
        }
        let ids = SessionIds { held, resume_token, token_hash, team };
        let mut session = Session::new(self, ids, official, Machine::new(limit_s), inbox);
        session.note = note;
        tracing::info!(session = session.held.session_id, team = session.team, "session opened");
        Ok(session)
    }

    async fn resume(
        self: &Arc<Self>,
        token: &str,
        identity: Option<&Identity>,
    ) -> Result<Box<Session>, Refusal> {
        entry::may_resume(self, token, identity).await?;
        let token_hash = sha256_hex(token.as_bytes());
        self.fetch(&token_hash, true).await?;
        let mut session = self.registry.replace(&token_hash).await?;
        session.resume_token = token.to_owned();
        session.go_on().await;
        session.keep_last_observation();
        session.answered.client_is_back();
        tracing::info!(session = session.held.session_id, "session resumed");
        Ok(session)
    }
}
