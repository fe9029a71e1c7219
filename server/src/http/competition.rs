//! The competition and its tasks.

use crate::archive::Archive;
use crate::competition::Competition;
use crate::rules::Phase;
use crate::version;
use axum::Json;
use axum::extract::State;
use palmares_protocol::reply::{self, Limits, ServerInfo, TaskInfo};
use schemars::JsonSchema;
use serde::Serialize;
use std::sync::Arc;

/// What is being played here.
#[derive(Serialize, JsonSchema)]
pub(super) struct CompetitionAnswer {
    #[serde(flatten)]
    competition: reply::Competition,
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
pub(super) async fn competition(
    State(archive): State<Option<Arc<Archive>>>,
    State(competition): State<Arc<Competition>>,
) -> Json<CompetitionAnswer> {
    let rules = &competition.rules;
    Json(CompetitionAnswer {
        competition: competition.info(),
        server: version::own(),
        limits: competition.limits(),
        tasks: competition.task_names(),
        hands: competition.hands.iter().map(|hand| hand.name.clone()).collect(),
        replay_key: archive.as_ref().map(|archive| archive.key().to_string()),
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
pub(super) async fn tasks(State(competition): State<Arc<Competition>>) -> Json<Tasks> {
    Json(Tasks { tasks: competition.task_infos() })
}
