//! The competition and its tasks.

use super::places::{self, Places, ScheduleSummary};
use crate::competition::Competition;
use crate::competition::rules::CompetitionPhase;
use crate::http::state::AppState;
use axum::Json;
use axum::extract::State;
use palmares_net::process::version;
use palmares_net::transport::problem::Problem;
use palmares_protocol::reply::{self, Limits, ServerInfo, TaskInfo};
use schemars::JsonSchema;
use serde::Serialize;
use std::sync::Arc;

/// The worlds of all hosts of this competition.
#[derive(Serialize, JsonSchema)]
pub(super) struct Worlds {
    /// Number that can compute at once.
    max: usize,
    /// Number of open worlds that are not idle.
    busy: usize,
    /// Lockstep worlds without a request for a while.
    idle: usize,
    /// Number of sessions that were refused a world and wait for one.
    waiting: usize,
}

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
    /// Begin of the pause of all sessions, ms since 1970 UTC; only while they are paused.
    #[serde(skip_serializing_if = "Option::is_none")]
    paused_unix_ms: Option<i64>,
    /// Places for worlds; official competitions only.
    #[serde(skip_serializing_if = "Option::is_none")]
    places: Option<Places>,
    /// The time slots; only with a schedule.
    #[serde(skip_serializing_if = "Option::is_none")]
    schedule: Option<ScheduleSummary>,
    /// Number of sessions of a team.
    #[serde(skip_serializing_if = "Option::is_none")]
    sessions_per_team: Option<u32>,
    /// SHA-256 of the secret from which the seeds are derived.
    #[serde(skip_serializing_if = "Option::is_none")]
    seed_secret_sha256: Option<String>,
    /// The secret, after it was revealed.
    #[serde(skip_serializing_if = "Option::is_none")]
    seed_secret: Option<String>,
    /// The worlds as of now.
    worlds: Worlds,
    /// Runs that wait for their verification; official competitions only.
    #[serde(skip_serializing_if = "Option::is_none")]
    verification: Option<VerificationNow>,
}

/// Runs that wait for their verification.
#[derive(Serialize, JsonSchema)]
pub(super) struct VerificationNow {
    /// Number of runs that wait, or are being verified.
    waiting: i64,
    /// Number of runs that are stuck: without a verdict after three tries or more, or of another engine.
    stuck: i64,
    /// Since when the oldest one waits, ms since 1970 UTC.
    #[serde(skip_serializing_if = "Option::is_none")]
    oldest_unix_ms: Option<i64>,
}

/// The competition of this server.
pub(super) async fn competition(State(app): State<AppState>) -> Result<Json<CompetitionResponse>, Problem> {
    let (competition, archive) = (&app.competition, &app.archive);
    let rules = &competition.rules;
    let worlds = places::all_worlds(&app);
    let (places, schedule) = match rules.official() {
        true => (Some(places::places(&app, &worlds).await?), places::schedule(&app).await?),
        false => (None, None),
    };
    let verification = match rules.official() {
        true => {
            let queue = app.store.verification_queue().await?;
            let (waiting, stuck, oldest_unix_ms) = (queue.waiting, queue.stuck, queue.oldest_unix_ms);
            Some(VerificationNow { waiting, stuck, oldest_unix_ms })
        }
        false => None,
    };
    Ok(Json(CompetitionResponse {
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
        paused_unix_ms: rules.state().paused_unix_ms,
        places,
        schedule,
        sessions_per_team: rules.official().then_some(rules.sessions_per_team),
        seed_secret_sha256: rules.secret_sha256(),
        seed_secret: rules.revealed_secret(),
        worlds: Worlds {
            max: worlds.total,
            busy: worlds.busy,
            idle: worlds.idle,
            waiting: worlds.waiting.len(),
        },
        verification,
    }))
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
