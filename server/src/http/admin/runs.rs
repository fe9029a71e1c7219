//! Voiding a run and asking for its verification again.

use super::request::{Asked, entry, needs_reason, no_verb, not_found};
use crate::http::extract::Segment;
use crate::http::runs::SessionNow;
use crate::problem::Problem;
use crate::session::Command as Order;
use crate::state::AppState;
use crate::store::RunRecord;
use axum::Json;
use axum::extract::State;
use palmares_protocol::Code;
use palmares_protocol::text::shortened;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which run, and why.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "RunDeed")]
pub(in crate::http) struct Body {
    run_id: String,
    /// Kept in the audit; `void` needs it.
    #[serde(default)]
    reason: Option<String>,
}

/// The run as it is now, and its session, whose time may have been given back.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "DecidedRun")]
pub(in crate::http) struct Answer {
    run: RunRecord,
    session: Option<SessionNow>,
}

/// `void`, `reverify`.
pub(super) async fn act(
    State(app): State<AppState>,
    Segment(verb): Segment,
    asked: Asked<Body>,
) -> Result<Json<Answer>, Problem> {
    let Body { run_id, reason } = &asked.body;
    let run = app.store.run(run_id).await?;
    let none = || not_found(format!("no run `{}`", shortened(run_id)));
    let run = run.ok_or_else(none)?;
    let wrong = |what: &str| {
        let message = format!("run {} is {}: {what}", shortened(run_id), run.status);
        Problem::new(Code::WrongState, message)
    };
    match verb.as_str() {
        "void" => {
            needs_reason(reason)?;
            let entry = entry(&asked.identity, "run.void", run_id, reason);
            let voided = app.store.void_run(run_id, &entry).await?;
            // An open run is closed by its session; a finished one's time is given back by it, or without it.
            let order = Order::VoidRun { run_id: run_id.clone(), note: reason.clone().unwrap_or_default() };
            let session_id = run.session_id.clone().unwrap_or_default();
            let obeyed = match app.sessions.registry.command(&session_id, order).await {
                Err(refusal) if refusal.code == Code::NotFound => false,
                Err(refusal) => return Err(Problem(refusal)),
                Ok(()) => true,
            };
            if !obeyed {
                app.sessions.give_back(&session_id).await?;
                app.sessions.revive(&session_id).await?;
            }
            if !voided {
                if !(obeyed && run.status == "open") {
                    return Err(wrong("nothing to void"));
                }
                app.store.record(&entry).await?;
            }
            app.hub.ranking_changed();
        }
        "reverify" => {
            let entry = entry(&asked.identity, "run.reverify", run_id, reason);
            if !app.store.reverify(run_id, &entry).await? {
                return Err(wrong("it has no replay that could be played again"));
            }
            if let Some(archive) = &app.archive {
                archive.wake();
            }
        }
        _ => return Err(no_verb(&verb, "void, reverify")),
    }
    let session = app.store.session(run.session_id.as_deref().unwrap_or_default()).await;
    let session = session?.map(|row| SessionNow::of(row, &app));
    let run = app.store.run(run_id).await?;
    Ok(Json(Answer { run: run.ok_or_else(none)?, session }))
}
