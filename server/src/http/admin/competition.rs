//! Opening, closing, revealing.

use super::request::{Asked, entry, no_verb};
use crate::competition::Competition;
use crate::http::extract::Segment;
use crate::problem::Problem;
use crate::rules::Phase;
use crate::store::Store;
use axum::Json;
use axum::extract::State;
use palmares_protocol::Code;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Why.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "CompetitionDeed")]
pub(in crate::http) struct Body {
    /// Kept in the audit.
    #[serde(default)]
    reason: Option<String>,
}

/// How far the competition is.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "CompetitionPhase")]
pub(in crate::http) struct Answer {
    phase: Phase,
}

/// `open`, `close`, `reveal`.
pub(super) async fn enter(
    State(competition): State<Arc<Competition>>,
    State(store): State<Store>,
    Segment(verb): Segment,
    asked: Asked<Body>,
) -> Result<Json<Answer>, Problem> {
    let (to, action) = match verb.as_str() {
        "open" => (Phase::Open, "competition.open"),
        "close" => (Phase::Closed, "competition.close"),
        "reveal" => (Phase::Revealed, "competition.reveal"),
        _ => return Err(no_verb(&verb, "open, close, reveal")),
    };
    if to == Phase::Revealed {
        let open = store.open_sessions().await?;
        if open > 0 {
            let message = format!("{open} sessions are open; end or void them first");
            return Err(Problem::new(Code::WrongState, message));
        }
    }
    let entry = entry(&asked.identity, action, &competition.rules.name, &asked.body.reason);
    competition.rules.enter(&store, to, &entry).await?;
    Ok(Json(Answer { phase: competition.rules.phase() }))
}
