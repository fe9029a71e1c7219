//! Hands: built in, and uploaded by teams.

use super::coding;
use super::extract::{Path, Query};
use crate::competition::hands::max_archive_bytes;
use crate::http::state::AppState;
use crate::session::practice_team;
use axum::Json;
use axum::body::Body;
use axum::extract::{ConnectInfo, State};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use palmares_models::hand::Hand;
use palmares_net::auth::{Identity, Role, forbidden};
use palmares_net::transport::Caller;
use palmares_net::transport::problem::Problem;
use palmares_protocol::Code;
use palmares_protocol::reply::HandInfo;
use palmares_protocol::text::shortened;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The team query hands are meant, on a practice server.
#[derive(Clone, Deserialize)]
pub(super) struct TeamQuery {
    #[serde(default)]
    team: Option<String>,
}

/// The client's team: by its token, on a practice server also by the query.
pub(super) async fn team(
    app: &AppState,
    headers: &HeaderMap,
    query: TeamQuery,
) -> Result<Option<String>, Problem> {
    let identity = app.auth.identify(&app.store, headers).await?;
    match identity {
        Some(Identity { role: Role::Team, team, .. }) => Ok(team),
        _ if app.competition.rules.official() => Ok(None),
        _ => match query.team {
            Some(name) => Ok(Some(practice_team(&app.store, &name).await?.0)),
            None => Ok(None),
        },
    }
}

#[derive(Serialize, JsonSchema)]
pub(super) struct Hands {
    /// Hands that can be played, as in `welcome`, including the team's own.
    hands: Vec<HandInfo>,
    /// All hands that the team has uploaded, with their status; only for the team.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    own: Vec<palmares_store::HandRow>,
}

/// Short descriptions of the hands.
pub(super) async fn list(
    State(app): State<AppState>,
    Query(query): Query<TeamQuery>,
    headers: HeaderMap,
) -> Result<Json<Hands>, Problem> {
    let team = team(&app, &headers, query).await?;
    let own = match &team {
        Some(team) => app.store.hands(Some(team)).await?,
        None => Vec::new(),
    };
    let hands = app.competition.hand_infos(&app.store, &app.compute.background, team.as_deref()).await?;
    Ok(Json(Hands { hands, own }))
}

/// The full description of a hand.
pub(super) async fn describe(
    State(app): State<AppState>,
    Path(name): Path,
    Query(query): Query<TeamQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let hand = find(&app, &headers, query, &name).await?;
    Ok(coding::json(&headers, &hand.describe()))
}

/// The hand of that name that the client may see: a hand of the server, or one of its team.
pub(super) async fn find(
    app: &AppState,
    headers: &HeaderMap,
    query: TeamQuery,
    name: &str,
) -> Result<Arc<Hand>, Problem> {
    if let Some(hand) = app.competition.hand(name) {
        return Ok(hand.clone());
    }
    if let Some(team) = team(app, headers, query).await? {
        let own =
            app.competition.own_hands.find(&app.store, &app.compute.background, &team, name, false).await;
        if let Some((hand, _)) = own? {
            return Ok(hand);
        }
    }
    let message = format!("no hand `{}`; GET /v1/hands lists them", shortened(name));
    Err(Problem::new(Code::UnknownHand, message))
}

/// Uploads a hand: the body is a ZIP archive of URDF, meshes and hand.toml.
pub(super) async fn submit(
    State(app): State<AppState>,
    Query(query): Query<TeamQuery>,
    ConnectInfo(caller): ConnectInfo<Caller>,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, Problem> {
    // Before the body is read: a refused upload costs no memory.
    let identity = app.auth.identify(&app.store, &headers).await?;
    if app.competition.rules.official() && identity.is_some_and(|identity| identity.role != Role::Team) {
        return Err(Problem(forbidden("a team's token")));
    }
    let team = team(&app, &headers, query).await?.ok_or_else(|| {
        let message = if app.competition.rules.official() {
            "send a team's token as the header `Authorization: Bearer <token>`"
        } else {
            "name the team of the hand: ?team=name"
        };
        let code = if app.competition.rules.official() { Code::NotAuthorized } else { Code::BadRequest };
        Problem::new(code, message)
    })?;
    let received = app.inbound.bodies.read(caller.address, &headers, body, max_archive_bytes()).await?;
    let submitted =
        app.competition.own_hands.submit(&app.store, &app.compute.background, &team, received).await;
    Ok((StatusCode::CREATED, Json(submitted?)).into_response())
}
