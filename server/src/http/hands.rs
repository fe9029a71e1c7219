//! Hands: those that come with the program, and those that teams send in.

use super::extract::{Asking, Segment};
use crate::auth::{Identity, Role, forbidden};
use crate::hands::largest;
use crate::problem::Problem;
use crate::session::practice_team;
use crate::state::AppState;
use crate::transport::Caller;
use axum::Json;
use axum::body::Body;
use axum::extract::{ConnectInfo, State};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use palmares_models::hand::Hand;
use palmares_models::hand::describe::HandDescription;
use palmares_protocol::Code;
use palmares_protocol::reply::HandInfo;
use palmares_protocol::text::shortened;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Whose hands, on a practice server.
#[derive(Clone, Deserialize)]
pub(super) struct Whose {
    #[serde(default)]
    team: Option<String>,
}

/// The team that asks: by its token, on a practice server also by its name.
pub(super) async fn team(
    app: &AppState,
    headers: &HeaderMap,
    whose: Whose,
) -> Result<Option<String>, Problem> {
    let identity = app.auth.identify(&app.store, headers).await?;
    match identity {
        Some(Identity { role: Role::Team, team, .. }) => Ok(team),
        _ if app.competition.rules.official() => Ok(None),
        _ => match whose.team {
            Some(name) => Ok(Some(practice_team(&app.store, &name).await?.0)),
            None => Ok(None),
        },
    }
}

#[derive(Serialize, JsonSchema)]
pub(super) struct Hands {
    /// Those that can be played, as in `welcome`: with the team's own when the team asks.
    hands: Vec<HandInfo>,
    /// All that the team sent in, with their state; only for the team.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    own: Vec<crate::store::HandRow>,
}

/// The hands in short.
pub(super) async fn list(
    State(app): State<AppState>,
    Asking(whose): Asking<Whose>,
    headers: HeaderMap,
) -> Result<Json<Hands>, Problem> {
    let team = team(&app, &headers, whose).await?;
    let own = match &team {
        Some(team) => app.store.hands(Some(team)).await?,
        None => Vec::new(),
    };
    let hands = app.competition.hand_infos(&app.store, &app.compute.background, team.as_deref()).await?;
    Ok(Json(Hands { hands, own }))
}

/// A hand in full.
pub(super) async fn describe(
    State(app): State<AppState>,
    Segment(name): Segment,
    Asking(whose): Asking<Whose>,
    headers: HeaderMap,
) -> Result<Json<HandDescription>, Problem> {
    Ok(Json(find(&app, &headers, whose, &name).await?.describe()))
}

/// The hand of that name, for whoever asks: everybody's, or its team's own.
pub(super) async fn find(
    app: &AppState,
    headers: &HeaderMap,
    whose: Whose,
    name: &str,
) -> Result<Arc<Hand>, Problem> {
    if let Some(hand) = app.competition.hand(name) {
        return Ok(hand.clone());
    }
    if let Some(team) = team(app, headers, whose).await? {
        let own =
            app.competition.own_hands.find(&app.store, &app.compute.background, &team, name, false).await;
        if let Some((hand, _)) = own? {
            return Ok(hand);
        }
    }
    let message = format!("no hand `{}`; GET /v1/hands lists them", shortened(name));
    Err(Problem::new(Code::UnknownHand, message))
}

/// Takes a hand in: the body is a ZIP archive of URDF, meshes and hand.toml.
pub(super) async fn submit(
    State(app): State<AppState>,
    Asking(whose): Asking<Whose>,
    ConnectInfo(caller): ConnectInfo<Caller>,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, Problem> {
    // Before a byte of the body is read: who may not send it in sends it for nothing.
    let identity = app.auth.identify(&app.store, &headers).await?;
    if app.competition.rules.official() && identity.is_some_and(|identity| identity.role != Role::Team) {
        return Err(Problem(forbidden("a team's token")));
    }
    let team = team(&app, &headers, whose).await?.ok_or_else(|| {
        let message = if app.competition.rules.official() {
            "send a team's token as the header `Authorization: Bearer <token>`"
        } else {
            "say whose hand it is: ?team=name"
        };
        let code = if app.competition.rules.official() { Code::NotAuthorized } else { Code::BadRequest };
        Problem::new(code, message)
    })?;
    let received = app.inbound.bodies.read(caller.address, &headers, body, largest()).await?;
    let submitted =
        app.competition.own_hands.submit(&app.store, &app.compute.background, &team, received).await;
    Ok((StatusCode::CREATED, Json(submitted?)).into_response())
}
