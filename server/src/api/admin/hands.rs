//! Deciding on teams' own hands.

use super::{Asked, deed, needs_reason, no_verb, not_found, store_failed};
use crate::api::Problem;
use crate::protocol::request::shortened;
use crate::session::Host;
use axum::Json;
use axum::extract::{Path, State};
use serde::Deserialize;
use serde_json::{Value, json};
use std::sync::Arc;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Body {
    hand_id: String,
    #[serde(default)]
    reason: Option<String>,
}

/// All teams' hands.
pub(super) async fn list(State(host): State<Arc<Host>>) -> Result<Json<Value>, Problem> {
    let hands = host.store.hands(None).await.map_err(|error| store_failed(&error))?;
    Ok(Json(json!({"hands": hands})))
}

/// `approve`, `reject`.
pub(super) async fn decide(
    State(host): State<Arc<Host>>,
    Path(verb): Path<String>,
    asked: Asked<Body>,
) -> Result<Json<Value>, Problem> {
    let Body { hand_id, reason } = &asked.body;
    let (approved, action) = match verb.as_str() {
        "approve" => (true, "hand.approve"),
        "reject" => (false, "hand.reject"),
        _ => return Err(no_verb(&verb, "approve, reject")),
    };
    if !approved {
        needs_reason(reason)?;
    }
    let deed = deed(&asked.identity, action, hand_id, reason);
    let decided = host.store.decide_hand(hand_id, approved, &deed).await;
    if !decided.map_err(|error| store_failed(&error))? {
        return Err(not_found(format!("no hand `{}`", shortened(hand_id))));
    }
    let hand = host.store.hand(hand_id).await.map_err(|error| store_failed(&error))?;
    Ok(Json(json!({"hand": hand})))
}
