//! The competition and its tasks.

use crate::protocol::reply::{Competition, Limits, ServerInfo, TaskInfo};
use crate::rules::Phase;
use crate::session::Host;
use axum::Json;
use axum::extract::State;
use schemars::JsonSchema;
use serde::Serialize;
use std::sync::Arc;

/// What is being played here.
#[derive(Serialize, JsonSchema)]
pub(super) struct CompetitionAnswer {
    #[serde(flatten)]
    competition: Competition,
    server: ServerInfo,
    limits: Limits,
    tasks: Vec<String>,
    hands: Vec<String>,
    /// Public key that replays are signed with.
    #[serde(skip_serializing_if = "Option::is_none")]
    replay_key: Option<String>,
    /// How far it is; official competitions only.
    #[serde(skip_serializing_if = "Option::is_none")]
    phase: Option<Phase>,
    /// Sessions that a team has.
    #[serde(skip_serializing_if = "Option::is_none")]
    sessions_per_team: Option<u32>,
    /// SHA-256 of the secret that the seeds are made from.
    #[serde(skip_serializing_if = "Option::is_none")]
    seed_secret_sha256: Option<String>,
    /// The secret itself, once it is revealed.
    #[serde(skip_serializing_if = "Option::is_none")]
    seed_secret: Option<String>,
}

/// What is being played here.
pub(super) async fn competition(State(host): State<Arc<Host>>) -> Json<CompetitionAnswer> {
    let rules = &host.rules;
    Json(CompetitionAnswer {
        competition: host.competition(),
        server: ServerInfo::own(),
        limits: host.limits(),
        tasks: host.task_names(),
        hands: host.hands.iter().map(|hand| hand.name.clone()).collect(),
        replay_key: host.replays.as_ref().map(|archive| archive.key().to_string()),
        phase: rules.official().then(|| rules.phase()),
        sessions_per_team: rules.official().then_some(rules.sessions_per_team),
        seed_secret_sha256: rules.secret_sha256(),
        seed_secret: rules.revealed_secret(),
    })
}

/// The tasks.
#[derive(Serialize, JsonSchema)]
pub(super) struct Tasks {
    tasks: Vec<TaskInfo>,
}

/// The tasks.
pub(super) async fn tasks(State(host): State<Arc<Host>>) -> Json<Tasks> {
    Json(Tasks { tasks: host.task_infos() })
}
