//! Teams and tokens. A token is shown once, in the answer to the request that made it.

use super::{Asked, deed, not_found, store_failed};
use crate::api::Problem;
use crate::auth::{self, IssueError, Role};
use crate::protocol::request::{ClientInfo, shortened};
use crate::protocol::{Code, Refusal};
use crate::session::Host;
use axum::Json;
use axum::extract::State;
use serde::Deserialize;
use serde_json::{Value, json};
use std::sync::Arc;

type Answer = Result<Json<Value>, Problem>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TeamBody {
    team: String,
    #[serde(default)]
    reason: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TokenBody {
    role: String,
    #[serde(default)]
    label: String,
    #[serde(default)]
    reason: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TokenId {
    token_id: String,
    #[serde(default)]
    reason: Option<String>,
}

fn issue_failed(error: &IssueError) -> Problem {
    tracing::error!(%error, "no token");
    Problem(Refusal::new(Code::Internal, "the token could not be made; try again").retry_after(5.0))
}

fn no_team(team: &str) -> Problem {
    not_found(format!("no team `{}`", shortened(team)))
}

/// Adds a team and makes its first token.
pub(super) async fn add(State(host): State<Arc<Host>>, asked: Asked<TeamBody>) -> Answer {
    let full = ClientInfo::Full { name: asked.body.team.clone(), version: None };
    let (team, _) = full.checked().map_err(|_| {
        let message = "team: expected 1 to 64 characters, none of them a control character";
        Problem(Refusal::new(Code::BadRequest, message))
    })?;
    let add = deed(&asked.identity, "team.add", &team, &asked.body.reason);
    if !host.store.add_team(&team, &add).await.map_err(|error| store_failed(&error))? {
        let message = format!("there is a team `{team}` already; rotate gives it a new token");
        return Err(Problem(Refusal::new(Code::WrongState, message)));
    }
    new_token(&host, &asked.identity, "token.issue", &team, &asked.body.reason).await
}

async fn new_token(
    host: &Host,
    identity: &auth::Identity,
    action: &str,
    team: &str,
    reason: &Option<String>,
) -> Answer {
    let deed = deed(identity, action, team, reason);
    let issued = auth::issue(&host.store, Role::Team, Some(team), "", true, &deed).await;
    let (token, revoked) = issued.map_err(|error| issue_failed(&error))?;
    host.auth.revoke(revoked);
    Ok(Json(json!({"team": team, "token_id": token.id, "token": token.reveal()})))
}

/// A new token instead of the old: connections with the old one close.
pub(super) async fn rotate(State(host): State<Arc<Host>>, asked: Asked<TeamBody>) -> Answer {
    let team = &asked.body.team;
    if !host.store.has_team(team).await.map_err(|error| store_failed(&error))? {
        return Err(no_team(team));
    }
    new_token(&host, &asked.identity, "token.rotate", team, &asked.body.reason).await
}

/// Takes a team's tokens back: its connections close.
pub(super) async fn revoke(State(host): State<Arc<Host>>, asked: Asked<TeamBody>) -> Answer {
    let team = &asked.body.team;
    if !host.store.has_team(team).await.map_err(|error| store_failed(&error))? {
        return Err(no_team(team));
    }
    let deed = deed(&asked.identity, "token.revoke", team, &asked.body.reason);
    let revoked = host.store.revoke_team(team, &deed).await.map_err(|error| store_failed(&error))?;
    let count = revoked.len();
    host.auth.revoke(revoked);
    Ok(Json(json!({"team": team, "revoked": count})))
}

/// The teams.
pub(super) async fn list(State(host): State<Arc<Host>>) -> Answer {
    let teams = host.store.teams().await.map_err(|error| store_failed(&error))?;
    Ok(Json(json!({"teams": teams})))
}

/// Makes a token for an organizer or a viewer.
pub(super) async fn add_token(State(host): State<Arc<Host>>, asked: Asked<TokenBody>) -> Answer {
    let TokenBody { role, label, reason } = &asked.body;
    let role = match role.as_str() {
        "organizer" => Role::Organizer,
        "viewer" => Role::Viewer,
        _ => {
            let message = "role: expected `organizer` or `viewer`; a team gets its token by team/add";
            return Err(Problem(Refusal::new(Code::BadRequest, message)));
        }
    };
    let deed = deed(&asked.identity, "token.issue", role.word(), reason);
    let issued = auth::issue(&host.store, role, None, label, false, &deed).await;
    let (token, _) = issued.map_err(|error| issue_failed(&error))?;
    Ok(Json(json!({"role": role.word(), "token_id": token.id, "token": token.reveal()})))
}

/// Takes one token back.
pub(super) async fn revoke_token(State(host): State<Arc<Host>>, asked: Asked<TokenId>) -> Answer {
    let TokenId { token_id, reason } = &asked.body;
    let deed = deed(&asked.identity, "token.revoke", token_id, reason);
    if !host.store.revoke_token(token_id, &deed).await.map_err(|error| store_failed(&error))? {
        let message = format!("no live token `{}`, or the last organizer's", shortened(token_id));
        return Err(not_found(message));
    }
    host.auth.revoke([token_id.clone()]);
    Ok(Json(json!({"token_id": token_id, "revoked": 1})))
}

/// The tokens, without their secrets.
pub(super) async fn tokens(State(host): State<Arc<Host>>) -> Answer {
    let tokens = host.store.tokens().await.map_err(|error| store_failed(&error))?;
    Ok(Json(json!({"tokens": tokens})))
}
