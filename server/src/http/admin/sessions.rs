//! Pauses, ends and voids sessions, grants them time and takes it back.

use super::request::{AdminRequest, entry, needs_reason, no_verb, not_found};
use crate::competition::rules::CompetitionPhase;
use crate::http::extract::Path;
use crate::http::runs::SessionNow;
use crate::http::state::AppState;
use crate::session::Command;
use axum::Json;
use axum::extract::State;
use palmares_net::transport::problem::Problem;
use palmares_protocol::Code;
use palmares_protocol::text::shortened;
use palmares_store::unix_ms;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An action on a session.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct SessionActionRequest {
    session_id: String,
    /// The reason, for the audit; `void` and `grant` require it.
    #[serde(default)]
    reason: Option<String>,
    /// For `grant`: additional time, s; at most a day. A negative number takes granted time back.
    #[serde(default)]
    seconds: Option<f64>,
}

/// The session after the action.
#[derive(Serialize, JsonSchema)]
pub(in crate::http) struct SessionActionResponse {
    session: SessionNow,
}

/// Largest single grant, s.
const MAX_GRANT_S: f64 = 86_400.0;

/// `pause`, `resume`, `end`, `void`, `grant`. The database comes first, so that the action holds even if the server crashes before the
/// session gets the command.
pub(super) async fn act(
    State(app): State<AppState>,
    Path(verb): Path,
    request: AdminRequest<SessionActionRequest>,
) -> Result<Json<SessionActionResponse>, Problem> {
    let SessionActionRequest { session_id, reason, seconds } = &request.body;
    let none = || not_found(format!("no session `{}`; GET /v1/sessions lists them", shortened(session_id)));
    let before = app.store.session(session_id).await?.ok_or_else(none)?;
    let status = &before.status;
    let note = reason.clone().unwrap_or_default();
    let entry = |action| entry(&request.identity, action, session_id, reason);
    let (done, command) = match verb.as_str() {
        "pause" => {
            let done = app.store.pause_session(session_id, true, &entry("session.pause")).await;
            (done?, Command::Pause)
        }
        "resume" => {
            let done = app.store.pause_session(session_id, false, &entry("session.resume")).await?;
            if let Some(paused) = before.paused_unix_ms.filter(|_| done) {
                app.store.extend_slots_of(&before.team, paused, unix_ms()).await?;
            }
            (done, Command::Resume)
        }
        "end" => {
            let done = app.store.order_end(session_id, &entry("session.end")).await;
            (done?, Command::End { void: false, note })
        }
        "void" => {
            needs_reason(reason)?;
            let done = app.store.void_session(session_id, &entry("session.void")).await;
            (done?, Command::End { void: true, note })
        }
        "grant" => {
            needs_reason(reason)?;
            if app.competition.rules.phase() == CompetitionPhase::Revealed {
                let message = "the secret behind the seeds is public: the competition is over";
                return Err(Problem::new(Code::WrongState, message));
            }
            let seconds = seconds.filter(|s| *s != 0.0 && s.abs() <= MAX_GRANT_S).ok_or_else(|| {
                let message = format!(
                    "seconds: expected at most {MAX_GRANT_S}, or a negative number, which takes granted time back"
                );
                Problem::new(Code::BadRequest, message)
            })?;
            let entry = entry("session.grant");
            let done = match seconds > 0.0 {
                true => app.store.grant_time(session_id, seconds, &entry).await?,
                false => {
                    app.store.take_back_time(session_id, -seconds, &entry).await?.map_err(|granted_s| {
                        let message = format!("seconds = {seconds}: {granted_s} s were granted in all");
                        Problem::new(Code::WrongState, message)
                    })?
                }
            };
            (done, Command::Grant { seconds })
        }
        _ => return Err(no_verb(&verb, "pause, resume, end, void, grant")),
    };
    if !done {
        let message = format!("cannot {verb}: session {} is {status}", shortened(session_id));
        return Err(Problem::new(Code::WrongState, message));
    }
    // Without an open session the database alone is enough.
    match app.sessions.registry.command(session_id, command).await {
        Ok(()) => {}
        Err(refusal) if refusal.code == Code::NotFound && verb == "grant" && *seconds > Some(0.0) => {
            // The session had ended; now it waits for its team again.
            app.sessions.revive(session_id).await?;
        }
        Err(refusal) if refusal.code == Code::NotFound => {}
        Err(refusal) => return Err(Problem(refusal)),
    }
    if verb == "void" {
        app.hub.ranking_changed();
    }
    let session = app.store.session(session_id).await?;
    let session = SessionNow::of(session.ok_or_else(none)?, &app);
    Ok(Json(SessionActionResponse { session }))
}
