//! Teams and tokens. A token is shown once, in the answer to the request that made it.

use super::request::{Asked, entry, not_found};
use crate::auth::Auth;
use crate::auth::{self, Role};
use crate::names::{self, printable};
use crate::problem::Problem;
use crate::state::AppState;
use crate::store::Store;
use crate::store::{TeamRow, TokenRow};
use axum::Json;
use axum::extract::State;
use palmares_protocol::text::shortened;
use palmares_protocol::{Code, Refusal};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Which team, and why.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "TeamDeed")]
pub(in crate::http) struct TeamBody {
    team: String,
    /// Kept in the audit.
    #[serde(default)]
    reason: Option<String>,
}

/// A token that is no team's.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "NewToken")]
pub(in crate::http) struct TokenBody {
    /// `organizer` or `viewer`.
    role: String,
    /// Whose it is, for people.
    #[serde(default)]
    label: String,
    /// Kept in the audit.
    #[serde(default)]
    reason: Option<String>,
}

/// Which token, and why.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "TokenDeed")]
pub(in crate::http) struct TokenId {
    token_id: String,
    /// Kept in the audit.
    #[serde(default)]
    reason: Option<String>,
}

/// A token, shown this once.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "IssuedToken")]
pub(in crate::http) struct Issued {
    /// Whose it is, for a team's.
    #[serde(skip_serializing_if = "Option::is_none")]
    team: Option<String>,
    /// `organizer` or `viewer`, for another.
    #[serde(skip_serializing_if = "Option::is_none")]
    role: Option<&'static str>,
    /// Its public half, by which it is revoked.
    token_id: String,
    /// All of it.
    token: String,
}

/// What was taken back.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "RevokedTokens")]
pub(in crate::http) struct Revoked {
    /// Whose tokens, if a team was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    team: Option<String>,
    /// Which token, if one was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    token_id: Option<String>,
    /// How many.
    revoked: usize,
}

/// The teams by name.
#[derive(Serialize, JsonSchema)]
pub(in crate::http) struct Teams {
    teams: Vec<TeamRow>,
}

/// The tokens, without their secrets.
#[derive(Serialize, JsonSchema)]
pub(in crate::http) struct Tokens {
    tokens: Vec<TokenRow>,
}

fn issue_failed(error: &anyhow::Error) -> Problem {
    tracing::error!(error = format!("{error:#}"), "no token");
    Problem(Refusal::new(Code::Internal, "the token could not be made; try again").retry_after(5.0))
}

fn no_team(team: &str) -> Problem {
    not_found(format!("no team `{}`", shortened(team)))
}

/// Adds a team and makes its first token.
pub(super) async fn add(
    State(app): State<AppState>,
    asked: Asked<TeamBody>,
) -> Result<Json<Issued>, Problem> {
    let team = names::team(&asked.body.team).map_err(|error| Problem(error.of("team")))?;
    let add = entry(&asked.identity, "team.add", &team, &asked.body.reason);
    if let Some(other) = app.store.add_team(&team, &add).await? {
        let message = if other == team {
            format!("there is a team `{team}` already; rotate gives it a new token")
        } else {
            format!("`{team}` looks like the team `{}` (UTS 39); choose another name", printable(&other))
        };
        return Err(Problem::new(Code::WrongState, message));
    }
    new_token(&app, &asked.identity, "token.issue", &team, &asked.body.reason).await
}

async fn new_token(
    app: &AppState,
    identity: &auth::Identity,
    action: &str,
    team: &str,
    reason: &Option<String>,
) -> Result<Json<Issued>, Problem> {
    let entry = entry(identity, action, team, reason);
    let issued = auth::issue(&app.store, Role::Team, Some(team), "", true, &entry).await;
    let (token, revoked) = issued.map_err(|error| issue_failed(&error))?;
    app.auth.revoke(revoked);
    let (team, text) = (Some(team.to_owned()), token.reveal());
    Ok(Json(Issued { team, role: None, token_id: token.id, token: text }))
}

/// A new token instead of the old: connections with the old one close.
pub(super) async fn rotate(
    State(app): State<AppState>,
    asked: Asked<TeamBody>,
) -> Result<Json<Issued>, Problem> {
    let team = &asked.body.team;
    if !app.store.has_team(team).await? {
        return Err(no_team(team));
    }
    new_token(&app, &asked.identity, "token.rotate", team, &asked.body.reason).await
}

/// Takes a team's tokens back: its connections close.
pub(super) async fn revoke(
    State(auth): State<Arc<Auth>>,
    State(store): State<Store>,
    asked: Asked<TeamBody>,
) -> Result<Json<Revoked>, Problem> {
    let team = &asked.body.team;
    if !store.has_team(team).await? {
        return Err(no_team(team));
    }
    let entry = entry(&asked.identity, "token.revoke", team, &asked.body.reason);
    let revoked = store.revoke_team(team, &entry).await?;
    let count = revoked.len();
    auth.revoke(revoked);
    Ok(Json(Revoked { team: Some(team.clone()), token_id: None, revoked: count }))
}

/// The teams.
pub(super) async fn list(State(store): State<Store>) -> Result<Json<Teams>, Problem> {
    let teams = store.teams().await?;
    Ok(Json(Teams { teams }))
}

/// Makes a token for an organizer or a viewer.
pub(super) async fn add_token(
    State(store): State<Store>,
    asked: Asked<TokenBody>,
) -> Result<Json<Issued>, Problem> {
    let TokenBody { role, label, reason } = &asked.body;
    let role = match role.as_str() {
        "organizer" => Role::Organizer,
        "viewer" => Role::Viewer,
        _ => {
            let message = "role: expected `organizer` or `viewer`; a team gets its token by team/add";
            return Err(Problem::new(Code::BadRequest, message));
        }
    };
    let label = names::label(label).map_err(|error| Problem(error.of("label")))?;
    let entry = entry(&asked.identity, "token.issue", role.word(), reason);
    let issued = auth::issue(&store, role, None, &label, false, &entry).await;
    let (token, _) = issued.map_err(|error| issue_failed(&error))?;
    let (role, text) = (Some(role.word()), token.reveal());
    Ok(Json(Issued { team: None, role, token_id: token.id, token: text }))
}

/// Takes one token back.
pub(super) async fn revoke_token(
    State(auth): State<Arc<Auth>>,
    State(store): State<Store>,
    asked: Asked<TokenId>,
) -> Result<Json<Revoked>, Problem> {
    let TokenId { token_id, reason } = &asked.body;
    let entry = entry(&asked.identity, "token.revoke", token_id, reason);
    if !store.revoke_token(token_id, &entry).await? {
        let message = format!("no live token `{}`, or the last organizer's", shortened(token_id));
        return Err(not_found(message));
    }
    auth.revoke([token_id.clone()]);
    Ok(Json(Revoked { team: None, token_id: Some(token_id.clone()), revoked: 1 }))
}

/// The tokens, without their secrets.
pub(super) async fn tokens(State(store): State<Store>) -> Result<Json<Tokens>, Problem> {
    let tokens = store.tokens().await?;
    Ok(Json(Tokens { tokens }))
}
