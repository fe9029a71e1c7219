//! The competition and its tasks.

use crate::app::App as Host;
use crate::rules::Phase;
use crate::version;
use axum::Json;
use axum::extract::State;
use palmares_protocol::reply::{Competition, Limits, ServerInfo, TaskInfo};
use schemars::JsonSchema;
use serde::Serialize;

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
pub(super) async fn competition(State(host): State<Host>) -> Json<CompetitionAnswer> {
    let rules = &host.competition.rules;
    Json(CompetitionAnswer {
        competition: host.competition.info(),
        server: version::own(),
        limits: host.competition.limits(),
        tasks: host.competition.task_names(),
        hands: host.competition.hands.iter().map(|hand| hand.name.clone()).collect(),
        replay_key: host.archive.as_ref().map(|archive| archive.key().to_string()),
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
pub(super) async fn tasks(State(host): State<Host>) -> Json<Tasks> {
    Json(Tasks { tasks: host.competition.task_infos() })
}
