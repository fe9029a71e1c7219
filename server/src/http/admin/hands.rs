//! Looking at teams' own hands, and deciding on them.

use super::request::{Asked, entry, needs_reason, no_verb, not_found};
use crate::hands::Inspection;
use crate::http::extract::Segment;
use crate::problem::Problem;
use crate::state::AppState;
use crate::store::HandRow;
use crate::store::Store;
use axum::Json;
use axum::extract::State;
use axum::http::header::{CACHE_CONTROL, CONTENT_DISPOSITION, CONTENT_TYPE};
use axum::response::IntoResponse;
use palmares_models::hand::describe::HandDescription;
use palmares_protocol::Code;
use palmares_protocol::text::shortened;
use palmares_tasks::inspect::FigureRow;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which hand, and why.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "HandDeed")]
pub(in crate::http) struct Body {
    hand_id: String,
    /// Told to the team and kept in the audit; `reject` needs it.
    #[serde(default)]
    reason: Option<String>,
}

/// All teams' hands, the oldest first.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "AllHands")]
pub(in crate::http) struct List {
    hands: Vec<HandRow>,
}

/// The hand as it is now.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "DecidedHand")]
pub(in crate::http) struct Decided {
    hand: HandRow,
}

/// All teams' hands.
pub(super) async fn list(State(store): State<Store>) -> Result<Json<List>, Problem> {
    let hands = store.hands(None).await?;
    Ok(Json(List { hands }))
}

/// A hand to look at before deciding.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "ShownHand")]
pub(in crate::http) struct Shown {
    hand: HandRow,
    /// Beside the hands of the program and the competition's limits.
    figures: Vec<FigureRow>,
    /// What the hand would touch where it starts, in words.
    in_the_way: Vec<String>,
    /// The hand in full: what an organizer turns and closes before deciding.
    description: HandDescription,
}

async fn stored(app: &AppState, id: &str) -> Result<HandRow, Problem> {
    let hand = app.store.hand(id).await?;
    hand.ok_or_else(|| not_found(format!("no hand `{}`; GET /v1/admin/hands lists them", shortened(id))))
}

/// A hand with its figures.
pub(super) async fn show(State(app): State<AppState>, Segment(id): Segment) -> Result<Json<Shown>, Problem> {
    let hand = stored(&app, &id).await?;
    let Inspection { figures, in_the_way, description } =
        app.competition.own_hands.inspect(&app.compute.background, &hand).await?;
    Ok(Json(Shown { hand, figures, in_the_way, description }))
}

/// A hand's archive, as it was sent in.
pub(super) async fn archive(
    State(app): State<AppState>,
    Segment(id): Segment,
) -> Result<impl IntoResponse, Problem> {
    let hand = stored(&app, &id).await?;
    let sha256 = hand.sha256.clone();
    let read = tokio::task::spawn_blocking(move || app.competition.own_hands.archive(&sha256)).await;
    let bytes = read.map_err(std::io::Error::other).and_then(|bytes| bytes).map_err(|error| {
        tracing::error!(%error, hand = hand.hand_id, "an archive cannot be read");
        Problem::new(Code::Internal, "the archive cannot be read")
    })?;
    let headers = [
        (CONTENT_TYPE, "application/zip".to_owned()),
        (CONTENT_DISPOSITION, format!("attachment; filename=\"{}.zip\"", hand.hand_id)),
        (CACHE_CONTROL, "no-store".to_owned()),
    ];
    Ok((headers, bytes))
}

/// `approve`, `reject`.
pub(super) async fn decide(
    State(store): State<Store>,
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
    let entry = entry(&asked.identity, action, hand_id, reason);
    let decided = store.decide_hand(hand_id, approved, &entry).await;
    let none = || not_found(format!("no hand `{}`; GET /v1/admin/hands lists them", shortened(hand_id)));
    if !decided? {
        return Err(none());
    }
    let hand = store.hand(hand_id).await?;
    Ok(Json(Decided { hand: hand.ok_or_else(none)? }))
}
