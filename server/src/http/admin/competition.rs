//! Opens, closes and ends the competition.

use super::request::{AdminRequest, entry, no_verb};
use crate::competition::Competition;
use crate::http::extract::Path;
use crate::problem::Problem;
use crate::rules::CompetitionPhase;
use crate::store::Store;
use axum::Json;
use axum::extract::State;
use palmares_protocol::Code;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The reason for an action on the competition.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct CompetitionActionRequest {
    /// The reason, for the audit.
    #[serde(default)]
    reason: Option<String>,
}

/// The phase of the competition after the action.
#[derive(Serialize, JsonSchema)]
pub(in crate::http) struct CompetitionActionResponse {
    phase: CompetitionPhase,
}

/// `open`, `close`, `reveal`.
pub(super) async fn enter(
    State(competition): State<Arc<Competition>>,
    State(store): State<Store>,
    Path(verb): Path,
    request: AdminRequest<CompetitionActionRequest>,
) -> Result<Json<CompetitionActionResponse>, Problem> {
    let (to, action) = match verb.as_str() {
        "open" => (CompetitionPhase::Open, "competition.open"),
        "close" => (CompetitionPhase::Closed, "competition.close"),
        "reveal" => (CompetitionPhase::Revealed, "competition.reveal"),
        _ => return Err(no_verb(&verb, "open, close, reveal")),
    };
    if to == CompetitionPhase::Revealed {
        let open = store.open_sessions().await?;
        if open > 0 {
            let message = format!("{open} sessions are open; end or void them first");
            return Err(Problem::new(Code::WrongState, message));
        }
    }
    let entry = entry(&request.identity, action, &competition.rules.name, &request.body.reason);
    competition.rules.enter(&store, to, &entry).await?;
    Ok(Json(CompetitionActionResponse { phase: competition.rules.phase() }))
}
