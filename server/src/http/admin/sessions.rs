//! Holding, ending, voiding a session, and giving it time.

use super::request::{Asked, entry, needs_reason, no_verb, not_found};
use crate::http::extract::Segment;
use crate::http::runs::SessionNow;
use crate::problem::Problem;
use crate::rules::Phase;
use crate::session::Command as Order;
use crate::state::AppState;
use axum::Json;
use axum::extract::State;
use palmares_protocol::Code;
use palmares_protocol::text::shortened;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which session, why, and for `grant` how much.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "SessionDeed")]
pub(in crate::http) struct Body {
    session_id: String,
    /// Kept in the audit; `void` and `grant` need it.
    #[serde(default)]
    reason: Option<String>,
    /// For `grant`: more than 0 and at most a day.
    #[serde(default)]
    seconds: Option<f64>,
}

/// The session as it is now.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "DecidedSession")]
pub(in crate::http) struct Answer {
    session: SessionNow,
}

/// Most time that is given at once, s.
const MOST_S: f64 = 86_400.0;

/// `pause`, `resume`, `end`, `void`, `grant`. The database first: what is written there holds also when the server
/// dies before the session hears of it.
pub(super) async fn act(
    State(app): State<AppState>,
    Segment(verb): Segment,
    asked: Asked<Body>,
) -> Result<Json<Answer>, Problem> {
    let Body { session_id, reason, seconds } = &asked.body;
    let none = || not_found(format!("no session `{}`; GET /v1/sessions lists them", shortened(session_id)));
    if app.store.session(session_id).await?.is_none() {
        return Err(none());
    }
    let note = reason.clone().unwrap_or_default();
    let entry = |action| entry(&asked.identity, action, session_id, reason);
    let (done, order) = match verb.as_str() {
        "pause" => {
            let done = app.store.pause_session(session_id, true, &entry("session.pause")).await;
            (done?, Order::Pause)
        }
        "resume" => {
            let done = app.store.pause_session(session_id, false, &entry("session.resume")).await;
            (done?, Order::Resume)
        }
        "end" => {
            let done = app.store.order_end(session_id, &entry("session.end")).await;
            (done?, Order::End { void: false, note })
        }
        "void" => {
            needs_reason(reason)?;
            let done = app.store.void_session(session_id, &entry("session.void")).await;
            (done?, Order::End { void: true, note })
        }
        "grant" => {
            needs_reason(reason)?;
            if app.competition.rules.phase() == Phase::Revealed {
                let message = "the secret behind the seeds is public: the competition is over";
                return Err(Problem::new(Code::WrongState, message));
            }
            let seconds = seconds.filter(|s| *s > 0.0 && *s <= MOST_S).ok_or_else(|| {
                let message = format!("seconds: expected more than 0 and at most {MOST_S}");
                Problem::new(Code::BadRequest, message)
            })?;
            let done = app.store.grant_time(session_id, seconds, &entry("session.grant")).await;
            (done?, Order::Grant { seconds })
        }
        _ => return Err(no_verb(&verb, "pause, resume, end, void, grant")),
    };
    if !done {
        let message = format!("session {} is not in a state for {verb}", shortened(session_id));
        return Err(Problem::new(Code::WrongState, message));
    }
    // A session that nobody holds any more has nothing to obey; the database has it all.
    match app.sessions.registry.command(session_id, order).await {
        Ok(()) => {}
        Err(refusal) if refusal.code == Code::NotFound && verb == "grant" => {
            // Its time was spent and it is gone; now it waits for its team again.
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
    Ok(Json(Answer { session }))
}
