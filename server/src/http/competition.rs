//! The competition and its tasks.

use crate::archive::Archive;
use crate::competition::Competition;
use crate::rules::CompetitionPhase;
use crate::version;
use axum::Json;
use axum::extract::State;
use palmares_protocol::reply::{self, Limits, ServerInfo, TaskInfo};
use schemars::JsonSchema;
use serde::Serialize;
use std::sync::Arc;

/// The competition of this server.
#[derive(Serialize, JsonSchema)]
pub(super) struct CompetitionResponse {
    #[serde(flatten)]
    competition: reply::Competition,
    server: ServerInfo,
    limits: Limits,
    tasks: Vec<String>,
    hands: Vec<String>,
    /// Public key of the signatures on replays.
    #[serde(skip_serializing_if = "Option::is_none")]
    replay_key: Option<String>,
    /// Public keys that signed earlier replays; left out if there are none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    earlier_replay_keys: Vec<String>,
    /// Its phase; official competitions only.
    #[serde(skip_serializing_if = "Option::is_none")]
    phase: Option<CompetitionPhase>,
    /// Number of sessions of a team.
    #[serde(skip_serializing_if = "Option::is_none")]
    sessions_per_team: Option<u32>,
    /// SHA-256 of the secret from which the seeds are derived.
    #[serde(skip_serializing_if = "Option::is_none")]
    seed_secret_sha256: Option<String>,
    /// The secret, after it was revealed.
    #[serde(skip_serializing_if = "Option::is_none")]
    seed_secret: Option<String>,
}

/// The competition of this server.
pub(super) async fn competition(
    State(archive): State<Option<Arc<Archive>>>,
    State(competition): State<Arc<Competition>>,
) -> Json<CompetitionResponse> {
    let rules = &competition.rules;
    Json(CompetitionResponse {
        competition: competition.info(),
        server: version::own(),
        limits: competition.limits(),
        tasks: competition.task_names(),
        hands: competition.hands.iter().map(|hand| hand.name.clone()).collect(),
        replay_key: archive.as_ref().map(|archive| archive.key().to_string()),
        earlier_replay_keys: archive.as_ref().map_or_else(Vec::new, |archive| {
            archive.earlier_keys().iter().map(ToString::to_string).collect()
        }),
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
