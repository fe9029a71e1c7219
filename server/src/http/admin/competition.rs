//! Commands on the whole competition: its phases, and pause, resume and end of all sessions.

use super::request::{AdminRequest, entry, no_verb};
use crate::competition::rules::CompetitionPhase;
use crate::http::extract::Path;
use crate::http::runs::SessionNow;
use crate::http::state::AppState;
use axum::Json;
use axum::extract::State;
use palmares_net::transport::problem::Problem;
use palmares_protocol::Code;
use palmares_store::CompetitionChange;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The reason for an action on the competition.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct CompetitionActionRequest {
    /// The reason, for the audit.
    #[serde(default)]
    reason: Option<String>,
}

/// The competition after the action.
#[derive(Serialize, JsonSchema)]
pub(in crate::http) struct CompetitionActionResponse {
    phase: CompetitionPhase,
    /// Begin of the pause of all sessions, ms since 1970 UTC; only while they are paused.
    #[serde(skip_serializing_if = "Option::is_none")]
    paused_unix_ms: Option<i64>,
    /// Number of open sessions.
    open_sessions: i64,
}

/// `open`, `close`, `reveal`, `pause`, `resume`, `end`. The database comes first: it counts for all hosts, and after a restart.
pub(super) async fn act(
    State(app): State<AppState>,
    Path(verb): Path,
    request: AdminRequest<CompetitionActionRequest>,
) -> Result<Json<CompetitionActionResponse>, Problem> {
    use CompetitionChange::{EndSessions, Enter, Pause, Resume};
    let (change, action) = match verb.as_str() {
        "open" => (Enter(CompetitionPhase::Open), "competition.open"),
        "close" => (Enter(CompetitionPhase::Closed), "competition.close"),
        "reveal" => (Enter(CompetitionPhase::Revealed), "competition.reveal"),
        "pause" => (Pause, "competition.pause"),
        "resume" => (Resume, "competition.resume"),
        "end" => (EndSessions, "competition.end"),
        _ => return Err(no_verb(&verb, "open, close, reveal, pause, resume, end")),
    };
    let rules = &app.competition.rules;
    if change == Enter(CompetitionPhase::Revealed)
        && let Some(why) = in_the_way_of_reveal(&app).await?
    {
        return Err(Problem::new(Code::WrongState, why));
    }
    let entry = entry(&request.identity, action, &rules.name, &request.body.reason);
    rules.change(&app.store, change, &entry).await?;
    app.sessions.follow_competition().await?;
    Ok(Json(CompetitionActionResponse {
        phase: rules.phase(),
        paused_unix_ms: rules.state().paused_unix_ms,
        open_sessions: app.store.open_sessions().await?,
    }))
}

/// Most sessions or runs that a refusal names.
const NAMED: usize = 20;

/// The open sessions that prevent `reveal`, with the command that ends them; None without one.
async fn in_the_way_of_reveal(app: &AppState) -> Result<Option<String>, Problem> {
    let open = app.store.open_official_sessions().await?;
    let open: Vec<SessionNow> = open.into_iter().map(|row| SessionNow::of(row, app)).collect();
    if open.is_empty() {
        return Ok(None);
    }
    let close = match app.competition.rules.phase() {
        CompetitionPhase::Open => "the competition is open, and ",
        _ => "",
    };
    let mut text = format!(
        "{close}{}: {}. `palmares admin end` ends them all and scores their runs",
        counted(open.len(), "session is open", "sessions are open"),
        named(open.iter().map(SessionNow::in_words))
    );
    let provisional = app.store.provisional_runs().await?;
    if !provisional.is_empty() {
        text += &format!(
            ". {}, which does not prevent `reveal`: {}",
            counted(provisional.len(), "run is still provisional", "runs are still provisional"),
            named(provisional.iter().map(|run| format!("{} ({}, {})", run.run_id, run.team, run.task)))
        );
    }
    Ok(Some(text))
}

fn counted(number: usize, one: &str, many: &str) -> String {
    format!("{number} {}", if number == 1 { one } else { many })
}

/// The first names of a list, and the number of the others.
fn named(names: impl ExactSizeIterator<Item = String>) -> String {
    let others = names.len().saturating_sub(NAMED);
    let mut text = names.take(NAMED).collect::<Vec<_>>().join(", ");
    if others > 0 {
        text += &format!(", and {others} more");
    }
    text
}
