//! Teams and tokens. A token is shown once, in the response to the request that creates it.

use super::request::{AdminRequest, entry, not_found};
use crate::http::state::AppState;
use axum::Json;
use axum::extract::State;
use palmares_net::auth::Auth;
use palmares_net::auth::{self, Role};
use palmares_net::transport::problem::Problem;
use palmares_protocol::text::shortened;
use palmares_protocol::{Code, Refusal};
use palmares_store::Store;
use palmares_store::names::{self, DistinctNames, printable};
use palmares_store::{TeamRow, TokenRow};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::sync::Arc;

/// An action on a team.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct TeamActionRequest {
    team: String,
    /// The holder of the new token, for people; for `add` and `rotate`. A new token without one has the label of the last.
    #[serde(default)]
    label: Option<String>,
    /// The reason, for the audit.
    #[serde(default)]
    reason: Option<String>,
}

/// Teams to add.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct TeamCheckRequest {
    teams: Vec<NewTeam>,
}

/// A team to add.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct NewTeam {
    team: String,
    /// Label of its token.
    #[serde(default)]
    label: String,
}

/// The teams in the order of the request.
#[derive(Serialize, JsonSchema)]
pub(in crate::http) struct TeamCheckResponse {
    teams: Vec<CheckedTeam>,
}

/// Whether a team can be added.
#[derive(Serialize, JsonSchema)]
pub(in crate::http) struct CheckedTeam {
    /// Its name as it is stored, or as it was sent if it is not valid.
    team: String,
    /// Whether it exists.
    exists: bool,
    /// The reason why it cannot be added.
    problem: Option<String>,
}

/// A new token of an organizer or a viewer.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct NewToken {
    /// `organizer` or `viewer`.
    role: String,
    /// Its holder, for people.
    #[serde(default)]
    label: String,
    /// The reason, for the audit.
    #[serde(default)]
    reason: Option<String>,
}

/// An action on a token.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct TokenActionRequest {
    token_id: String,
    /// The reason, for the audit.
    #[serde(default)]
    reason: Option<String>,
}

/// A new token, shown once.
#[derive(Serialize, JsonSchema)]
pub(in crate::http) struct IssuedToken {
    /// Its team, for a team's token.
    #[serde(skip_serializing_if = "Option::is_none")]
    team: Option<String>,
    /// `organizer` or `viewer`, for other tokens.
    #[serde(skip_serializing_if = "Option::is_none")]
    role: Option<&'static str>,
    /// Its id, by which it is revoked.
    token_id: String,
    /// The whole token.
    token: String,
}

/// The revoked tokens.
#[derive(Serialize, JsonSchema)]
pub(in crate::http) struct RevokedTokens {
    /// The team, if its tokens were revoked.
    #[serde(skip_serializing_if = "Option::is_none")]
    team: Option<String>,
    /// The token, if one was revoked.
    #[serde(skip_serializing_if = "Option::is_none")]
    token_id: Option<String>,
    /// Number of revoked tokens.
    revoked: usize,
}

/// The teams, by name.
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
    tracing::error!(error = format!("{error:#}"), "cannot create a token");
    Problem(Refusal::new(Code::Internal, "the token could not be created; try again").retry_after(5.0))
}

fn no_team(team: &str) -> Problem {
    not_found(format!("no team `{}`", shortened(team)))
}

/// Adds a team and creates its first token.
pub(super) async fn add(
    State(app): State<AppState>,
    request: AdminRequest<TeamActionRequest>,
) -> Result<Json<IssuedToken>, Problem> {
    let team = names::team(&request.body.team).map_err(|error| Problem(error.of("team")))?;
    let label = label(&request.body)?.unwrap_or_default();
    let add = entry(&request.identity, "team.add", &team, &request.body.reason);
    if let Some(other) = app.store.add_team(&team, &add).await? {
        let message = if other == team {
            format!("there is a team `{team}` already; rotate gives it a new token")
        } else {
            format!("`{team}` {}", looks_like(&other))
        };
        return Err(Problem::new(Code::WrongState, message));
    }
    new_token(&app, &request.identity, "token.issue", &team, &label, &request.body.reason).await
}

fn looks_like(other: &str) -> String {
    format!("looks like the team `{}` (UTS 39); choose another name", printable(other))
}

/// The label of a request in the form that is stored.
fn label(body: &TeamActionRequest) -> Result<Option<String>, Problem> {
    let label = body.label.as_deref().map(names::label).transpose();
    label.map_err(|error| Problem(error.of("label")))
}

/// Checks teams before they are added; changes nothing.
pub(super) async fn check(
    State(store): State<Store>,
    request: AdminRequest<TeamCheckRequest>,
) -> Result<Json<TeamCheckResponse>, Problem> {
    let had: BTreeSet<String> = store.teams().await?.into_iter().map(|row| row.team).collect();
    let (mut distinct, mut checked) = (DistinctNames::default(), BTreeSet::new());
    for team in &had {
        distinct.add(team);
    }
    let mut one = |new: NewTeam| {
        let team = match names::team(&new.team) {
            Ok(team) => team,
            Err(error) => {
                return CheckedTeam {
                    team: new.team,
                    exists: false,
                    problem: Some(format!("name: {error}")),
                };
            }
        };
        let (exists, first) = (had.contains(&team), checked.insert(team.clone()));
        let other = if exists { None } else { distinct.add(&team) };
        let problem = match (names::label(&new.label), first, other) {
            (Err(error), ..) => Some(format!("label: {error}")),
            (_, false, _) => Some("it is there twice".to_owned()),
            (.., Some(other)) => Some(looks_like(other)),
            (_, true, None) => None,
        };
        CheckedTeam { team, exists, problem }
    };
    let teams = request.body.teams.into_iter().map(&mut one).collect();
    Ok(Json(TeamCheckResponse { teams }))
}

async fn new_token(
    app: &AppState,
    identity: &auth::Identity,
    action: &str,
    team: &str,
    label: &str,
    reason: &Option<String>,
) -> Result<Json<IssuedToken>, Problem> {
    let entry = entry(identity, action, team, reason);
    let issued = auth::issue(&app.store, Role::Team, Some(team), label, true, &entry).await;
    let (token, revoked) = issued.map_err(|error| issue_failed(&error))?;
    app.auth.revoke(revoked);
    let (team, text) = (Some(team.to_owned()), token.reveal());
    Ok(Json(IssuedToken { team, role: None, token_id: token.id, token: text }))
}

/// Replaces a team's token; connections with the old one close.
pub(super) async fn rotate(
    State(app): State<AppState>,
    request: AdminRequest<TeamActionRequest>,
) -> Result<Json<IssuedToken>, Problem> {
    let team = &request.body.team;
    if !app.store.has_team(team).await? {
        return Err(no_team(team));
    }
    let label = match label(&request.body)? {
        Some(label) => label,
        None => app.store.team_label(team).await?.unwrap_or_default(),
    };
    new_token(&app, &request.identity, "token.rotate", team, &label, &request.body.reason).await
}

/// Revokes a team's tokens; its connections close.
pub(super) async fn revoke(
    State(auth): State<Arc<Auth>>,
    State(store): State<Store>,
    request: AdminRequest<TeamActionRequest>,
) -> Result<Json<RevokedTokens>, Problem> {
    let team = &request.body.team;
    if !store.has_team(team).await? {
        return Err(no_team(team));
    }
    let entry = entry(&request.identity, "token.revoke", team, &request.body.reason);
    let revoked = store.revoke_team(team, &entry).await?;
    let count = revoked.len();
    auth.revoke(revoked);
    Ok(Json(RevokedTokens { team: Some(team.clone()), token_id: None, revoked: count }))
}

/// The teams.
pub(super) async fn list(State(store): State<Store>) -> Result<Json<Teams>, Problem> {
    let teams = store.teams().await?;
    Ok(Json(Teams { teams }))
}

/// Creates a token for an organizer or a viewer.
pub(super) async fn add_token(
    State(store): State<Store>,
    request: AdminRequest<NewToken>,
) -> Result<Json<IssuedToken>, Problem> {
    let NewToken { role, label, reason } = &request.body;
    let role = match role.as_str() {
        "organizer" => Role::Organizer,
        "viewer" => Role::Viewer,
        _ => {
            let message = "role: expected `organizer` or `viewer`; a team gets its token from team/add";
            return Err(Problem::new(Code::BadRequest, message));
        }
    };
    let label = names::label(label).map_err(|error| Problem(error.of("label")))?;
    let entry = entry(&request.identity, "token.issue", role.word(), reason);
    let issued = auth::issue(&store, role, None, &label, false, &entry).await;
    let (token, _) = issued.map_err(|error| issue_failed(&error))?;
    let (role, text) = (Some(role.word()), token.reveal());
    Ok(Json(IssuedToken { team: None, role, token_id: token.id, token: text }))
}

/// Revokes one token.
pub(super) async fn revoke_token(
    State(auth): State<Arc<Auth>>,
    State(store): State<Store>,
    request: AdminRequest<TokenActionRequest>,
) -> Result<Json<RevokedTokens>, Problem> {
    let TokenActionRequest { token_id, reason } = &request.body;
    let entry = entry(&request.identity, "token.revoke", token_id, reason);
    if !store.revoke_token(token_id, &entry).await? {
        let message = format!("token `{}` is unknown, revoked, or the last organizer's", shortened(token_id));
        return Err(not_found(message));
    }
    auth.revoke([token_id.clone()]);
    Ok(Json(RevokedTokens { team: None, token_id: Some(token_id.clone()), revoked: 1 }))
}

/// The tokens, without their secrets.
pub(super) async fn tokens(State(store): State<Store>) -> Result<Json<Tokens>, Problem> {
    let tokens = store.tokens().await?;
    Ok(Json(Tokens { tokens }))
}
