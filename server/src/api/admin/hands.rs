//! Deciding on teams' own hands.

use super::{Asked, deed, needs_reason, no_verb, not_found, store_failed};
use crate::api::Problem;
use crate::api::parts::Segment;
use crate::protocol::request::shortened;
use crate::session::Host;
use crate::store::HandRow;
use axum::Json;
use axum::extract::State;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Which hand, and why.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "HandDeed")]
pub(in crate::api) struct Body {
    hand_id: String,
    /// Told to the team and kept in the audit; `reject` needs it.
    #[serde(default)]
    reason: Option<String>,
}

/// All teams' hands, the oldest first.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "AllHands")]
pub(in crate::api) struct List {
    hands: Vec<HandRow>,
}

/// The hand as it is now.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "DecidedHand")]
pub(in crate::api) struct Decided {
    hand: HandRow,
}

/// All teams' hands.
pub(super) async fn list(State(host): State<Arc<Host>>) -> Result<Json<List>, Problem> {
    let hands = host.store.hands(None).await.map_err(|error| store_failed(&error))?;
    Ok(Json(List { hands }))
}

/// `approve`, `reject`.
pub(super) async fn decide(
    State(host): State<Arc<Host>>,
    Segment(verb): Segment,
    asked: Asked<Body>,
) -> Result<Json<Decided>, Problem> {
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
    let none = || not_found(format!("no hand `{}`; GET /v1/admin/hands lists them", shortened(hand_id)));
    if !decided.map_err(|error| store_failed(&error))? {
        return Err(none());
    }
    let hand = host.store.hand(hand_id).await.map_err(|error| store_failed(&error))?;
    Ok(Json(Decided { hand: hand.ok_or_else(none)? }))
}
