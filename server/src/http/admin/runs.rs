//! Lists runs and pairs of similar ones, voids runs, undoes that, and verifies runs again.

use super::request::{AdminRequest, ListQuery, MAX_ROWS, entry, needs_reason, no_verb, not_found};
use crate::http::extract::{Path, Query};
use crate::http::runs::{RunList, SessionNow};
use crate::http::state::AppState;
use crate::session::Command;
use axum::Json;
use axum::extract::State;
use palmares_net::transport::problem::Problem;
use palmares_protocol::Code;
use palmares_protocol::text::shortened;
use palmares_store::{RunRecord, SimilarPair, Store};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An action on a run.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct RunActionRequest {
    run_id: String,
    /// The reason, for the audit; `void` and `unvoid` require it.
    #[serde(default)]
    reason: Option<String>,
}

/// The run after the action, and its session, which may have a refund.
#[derive(Serialize, JsonSchema)]
pub(in crate::http) struct RunActionResponse {
    run: RunRecord,
    session: Option<SessionNow>,
}

/// Runs of a team, a task, a status or a time.
pub(super) async fn list(
    State(store): State<Store>,
    Query(query): Query<ListQuery>,
) -> Result<Json<RunList>, Problem> {
    const STATUS: [&str; 7] =
        ["open", "practice", "provisional", "verified", "rejected", "aborted", "voided"];
    let filter = query.filter(&STATUS)?;
    let unknown = match &filter.after {
        Some(run_id) if store.run(run_id).await?.is_none() => Some(run_id),
        _ => None,
    };
    if let Some(run_id) = unknown {
        return Err(Problem::new(Code::BadRequest, format!("after: no run `{}`", shortened(run_id))));
    }
    let (mut runs, more) = store.list_runs(&filter).await?;
    for run in &mut runs {
        // They can be long; the run itself and the export have them.
        run.events = None;
    }
    Ok(Json(RunList { runs, more }))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SimilarFilter {
    team: Option<String>,
    task: Option<String>,
    limit: Option<u32>,
}

/// Pairs of similar runs, the greatest share first.
#[derive(Serialize, JsonSchema)]
pub(in crate::http) struct SimilarRuns {
    pairs: Vec<SimilarPair>,
    /// Whether there are more, which `limit` left out.
    more: bool,
}

/// Pairs of runs of two teams with the same movements over a long stretch.
pub(super) async fn similar(
    State(store): State<Store>,
    Query(filter): Query<SimilarFilter>,
) -> Result<Json<SimilarRuns>, Problem> {
    let limit = filter.limit.unwrap_or(MAX_ROWS).min(MAX_ROWS);
    let mut pairs = store.similar_pairs(filter.team.as_deref(), filter.task.as_deref(), limit + 1).await?;
    let more = pairs.len() > limit as usize;
    pairs.truncate(limit as usize);
    Ok(Json(SimilarRuns { pairs, more }))
}

/// `void`, `unvoid`, `reverify`.
pub(super) async fn act(
    State(app): State<AppState>,
    Path(verb): Path,
    request: AdminRequest<RunActionRequest>,
) -> Result<Json<RunActionResponse>, Problem> {
    let RunActionRequest { run_id, reason } = &request.body;
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
            let entry = entry(&request.identity, "run.void", run_id, reason);
            let voided = app.store.void_run(run_id, &entry).await?;
            // The session closes an open run, or refunds a finished one; without a session the database refunds it.
            let command =
                Command::VoidRun { run_id: run_id.clone(), note: reason.clone().unwrap_or_default() };
            let session_id = run.session_id.clone().unwrap_or_default();
            let executed = match app.sessions.registry.command(&session_id, command).await {
                Err(refusal) if refusal.code == Code::NotFound => false,
                Err(refusal) => return Err(Problem(refusal)),
                Ok(()) => true,
            };
            if !executed {
                app.sessions.refund(&session_id).await?;
                app.sessions.revive(&session_id).await?;
            }
            if !voided {
                if !(executed && run.status == "open") {
                    return Err(wrong("nothing to void"));
                }
                app.store.record(&entry).await?;
            }
            app.hub.ranking_changed();
        }
        "reverify" => {
            let entry = entry(&request.identity, "run.reverify", run_id, reason);
            if !app.store.reverify(run_id, &entry).await? {
                return Err(wrong("it has no replay to verify"));
            }
            if let Some(archive) = &app.archive {
                archive.wake();
            }
        }
        "unvoid" => {
            needs_reason(reason)?;
            let (actor, reason) = (request.identity.token_id.clone(), reason.clone().unwrap_or_default());
            let session_id = run.session_id.clone().unwrap_or_default();
            let command =
                Command::UnvoidRun { run_id: run_id.clone(), actor: actor.clone(), reason: reason.clone() };
            match app.sessions.registry.command(&session_id, command).await {
                Err(refusal) if refusal.code == Code::NotFound => {
                    app.sessions.unvoid(run_id, &actor, &reason).await?;
                }
                executed => executed?,
            }
            app.hub.ranking_changed();
            if let Some(archive) = &app.archive {
                archive.wake();
            }
        }
        _ => return Err(no_verb(&verb, "void, unvoid, reverify")),
    }
    let session = app.store.session(run.session_id.as_deref().unwrap_or_default()).await;
    let session = session?.map(|row| SessionNow::of(row, &app));
    let run = app.store.run(run_id).await?;
    Ok(Json(RunActionResponse { run: run.ok_or_else(none)?, session }))
}
