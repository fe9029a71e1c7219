//! Uploaded hands, and the decisions on them.

use super::request::{AdminRequest, ListQuery, entry, needs_reason, no_verb, not_found};
use crate::competition::hands::Inspection;
use crate::http::extract::{Path, Query};
use crate::http::state::AppState;
use axum::Json;
use axum::extract::State;
use axum::http::header::{CACHE_CONTROL, CONTENT_DISPOSITION, CONTENT_TYPE};
use axum::response::IntoResponse;
use palmares_models::hand::describe::HandDescription;
use palmares_net::transport::problem::Problem;
use palmares_protocol::Code;
use palmares_protocol::text::shortened;
use palmares_store::HandRow;
use palmares_store::Store;
use palmares_tasks::inspect::FigureRow;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A decision on a hand.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct HandActionRequest {
    hand_id: String,
    /// The reason, for the team and the audit; `reject` requires it.
    #[serde(default)]
    reason: Option<String>,
}

/// The hands of all teams, oldest first.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "AllHands")]
pub(in crate::http) struct List {
    hands: Vec<HandRow>,
    /// Whether there are more, which `limit` left out.
    more: bool,
}

/// The hand after the decision.
#[derive(Serialize, JsonSchema)]
pub(in crate::http) struct HandActionResponse {
    hand: HandRow,
}

/// Hands of a team, a status or a time.
pub(super) async fn list(
    State(store): State<Store>,
    Query(query): Query<ListQuery>,
) -> Result<Json<List>, Problem> {
    let filter = query.filter(&["pending", "approved", "rejected"])?;
    if filter.task.is_some() {
        return Err(Problem::new(Code::BadRequest, "task: a hand belongs to none"));
    }
    if let Some(hand_id) = &filter.after
        && store.hand(hand_id).await?.is_none()
    {
        return Err(Problem::new(Code::BadRequest, format!("after: no hand `{}`", shortened(hand_id))));
    }
    let (hands, more) = store.list_hands(&filter).await?;
    Ok(Json(List { hands, more }))
}

/// A hand for the decision.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "ShownHand")]
pub(in crate::http) struct Shown {
    hand: HandRow,
    /// Its figures, with those of the built-in hands and the competition's limits.
    figures: Vec<FigureRow>,
    /// Overlaps of the hand where it starts, as text.
    in_the_way: Vec<String>,
    /// The full description, for the 3D view.
    description: HandDescription,
}

async fn stored(app: &AppState, id: &str) -> Result<HandRow, Problem> {
    let hand = app.store.hand(id).await?;
    hand.ok_or_else(|| not_found(format!("no hand `{}`; GET /v1/admin/hands lists them", shortened(id))))
}

/// A hand with its figures.
pub(super) async fn show(State(app): State<AppState>, Path(id): Path) -> Result<Json<Shown>, Problem> {
    let hand = stored(&app, &id).await?;
    let Inspection { figures, in_the_way, description } =
        app.competition.own_hands.inspect(&app.compute.background, &hand).await?;
    Ok(Json(Shown { hand, figures, in_the_way, description }))
}

/// A hand's archive, as uploaded.
pub(super) async fn archive(
    State(app): State<AppState>,
    Path(id): Path,
) -> Result<impl IntoResponse, Problem> {
    let hand = stored(&app, &id).await?;
    let bytes = app.competition.own_hands.archive(&hand.sha256).await.map_err(|error| {
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
    Path(verb): Path,
    request: AdminRequest<HandActionRequest>,
) -> Result<Json<HandActionResponse>, Problem> {
    let HandActionRequest { hand_id, reason } = &request.body;
    let (approved, action) = match verb.as_str() {
        "approve" => (true, "hand.approve"),
        "reject" => (false, "hand.reject"),
        _ => return Err(no_verb(&verb, "approve, reject")),
    };
    if !approved {
        needs_reason(reason)?;
    }
    let entry = entry(&request.identity, action, hand_id, reason);
    let decided = store.decide_hand(hand_id, approved, &entry).await;
    let none = || not_found(format!("no hand `{}`; GET /v1/admin/hands lists them", shortened(hand_id)));
    if !decided? {
        return Err(none());
    }
    let hand = store.hand(hand_id).await?;
    Ok(Json(HandActionResponse { hand: hand.ok_or_else(none)? }))
}
