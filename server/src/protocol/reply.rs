//! What the server says.

use super::code::{Code, Refusal};
use super::obs::Obs;
use super::request::Mode;
use super::specs::Specs;
use palmares_tasks::{Event, Outcome, Reason};
use schemars::JsonSchema;
use serde::Serialize;

/// A message from the server.
#[derive(Clone, Debug, Serialize, JsonSchema)]
#[serde(tag = "op", rename_all = "snake_case")]
pub(crate) enum Reply {
    /// Reply to `hello`.
    Welcome(Box<Welcome>),
    /// Reply to `reset` and `step`; unasked after every tick of a realtime run.
    Obs(Box<Obs>),
    /// Reply to `act` and `perturb`.
    Ack(Ack),
    /// Reply to `stop`.
    Result(Box<RunResult>),
    /// Reply to `time`.
    Time(TimeReport),
    /// Reply to a request that failed.
    Error(ErrorReply),
    /// Unasked: the session's time is running out.
    Warning(Warning),
}

impl Reply {
    /// The error message of a refusal.
    pub(crate) fn refused(id: Option<u64>, refusal: &Refusal) -> Self {
        Reply::Error(ErrorReply {
            id,
            code: refusal.code,
            message: refusal.message.clone(),
            fatal: refusal.fatal,
            retry_after_s: refusal.retry_after_s,
        })
    }
}

/// `welcome`: what this server offers.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct Welcome {
    /// Of the request.
    pub(crate) id: u64,
    /// Identifies the session.
    pub(crate) session_id: String,
    /// Secret that takes the session up again on a new connection.
    pub(crate) resume_token: String,
    /// Name of the team on the leaderboard.
    pub(crate) team: String,
    /// s; null for a session without a limit.
    pub(crate) session_left_s: Option<f64>,
    /// The competition.
    pub(crate) competition: Competition,
    /// The program.
    pub(crate) server: ServerInfo,
    /// What a client must keep to.
    pub(crate) limits: Limits,
    /// Tasks that can be played.
    pub(crate) tasks: Vec<TaskInfo>,
    /// Hands that can be played with.
    pub(crate) hands: Vec<HandInfo>,
    /// Fields of actions and observations.
    pub(crate) specs: Specs,
    /// The run that goes on, when a session is taken up again; else null.
    pub(crate) run: Option<RunInfo>,
    /// For people: what is odd about the team's name. Absent when nothing is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) note: Option<String>,
}

/// The competition.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct Competition {
    /// For people.
    pub(crate) name: String,
    /// `practice`: no token, own seeds, full state.
    pub(crate) mode: String,
    /// Length of a session, s; null for none.
    pub(crate) session_s: Option<f64>,
    /// What each `reset` that opens a run takes from the session, s.
    pub(crate) reset_cost_s: f64,
}

/// The program.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct ServerInfo {
    /// Version of the program.
    pub(crate) version: String,
    /// Commit it was built from.
    pub(crate) build_hash: String,
}

impl ServerInfo {
    /// This program.
    pub(crate) fn own() -> Self {
        ServerInfo {
            version: env!("CARGO_PKG_VERSION").into(),
            build_hash: env!("PALMARES_BUILD_HASH").into(),
        }
    }
}

/// What a client must keep to.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct Limits {
    /// Largest inbound message.
    pub(crate) message_bytes: usize,
    /// Largest `repeat` of a `step`.
    pub(crate) repeat: u32,
    /// Requests per second that a connection may keep up.
    pub(crate) requests_per_s: f64,
    /// Requests it may send at once beyond that rate.
    pub(crate) requests_burst: f64,
    /// How long a session waits for its client to come back, s.
    pub(crate) resume_grace_s: f64,
    /// Period of the server's pings, s.
    pub(crate) ping_interval_s: f64,
    /// A connection silent for this long, or that does not take a message for this long, is dropped, s.
    pub(crate) ping_timeout_s: f64,
    /// A connection that has not said hello for this long is closed, s.
    pub(crate) hello_timeout_s: f64,
    /// In real time: for so many ticks a silent controller's last action goes on; then the hand holds still.
    pub(crate) hold_ticks: u32,
    /// In real time: observations that wait for a slow client; of more the oldest is dropped.
    pub(crate) outbox_obs: usize,
}

/// A task in short.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct TaskInfo {
    /// For `reset`.
    pub(crate) name: String,
    /// For people.
    pub(crate) description: String,
    /// Length of a tick, s.
    pub(crate) tick_s: f64,
    /// Length of a physics step, s.
    pub(crate) step_s: f64,
    /// Longest run, s of simulated time.
    pub(crate) time_limit_s: f64,
}

/// A hand in short; `GET /v1/hands/{name}` has the rest.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct HandInfo {
    /// For `reset`.
    pub(crate) name: String,
    /// For people.
    pub(crate) description: String,
    /// Names of the motors, in the order of `action.hand`.
    pub(crate) motors: Vec<String>,
    /// Names of the joint coordinates, in the order of `truth.joints`.
    pub(crate) joints: Vec<String>,
}

/// The session's present run.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct RunInfo {
    /// Identifies the run.
    pub(crate) run_id: String,
    /// Its task.
    pub(crate) task: String,
    /// Its hand.
    pub(crate) hand: String,
    /// How time passes in it.
    pub(crate) mode: Mode,
    /// The current tick, which the next `step` must name.
    pub(crate) tick: u64,
    /// False when the server closed it (time limit, end of the session): `stop` fetches the result.
    pub(crate) open: bool,
}

/// `ack`: the action or push was taken.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct Ack {
    /// Of the request.
    pub(crate) id: u64,
    /// The tick at which it takes effect: the `obs` of this tick is the first to show it.
    pub(crate) tick: u64,
}

/// `result`: what a finished run is worth. It stands in the server's database when this is sent.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct RunResult {
    /// Of the request; absent when the server closed the run and tells it unasked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) id: Option<u64>,
    /// Identifies the run.
    pub(crate) run_id: String,
    /// Its task.
    pub(crate) task: String,
    /// Its hand.
    pub(crate) hand: String,
    /// How time passed in it.
    pub(crate) mode: Mode,
    /// `practice`, or `voided` after a fault of the server.
    pub(crate) status: String,
    /// Points.
    pub(crate) score: f64,
    /// Objects in the goal.
    pub(crate) in_goal: u32,
    /// Objects outside both boxes.
    pub(crate) outside: u32,
    /// Why the run ended.
    pub(crate) reason: Reason,
    /// Ticks played.
    pub(crate) ticks: u64,
    /// s of simulated time played.
    pub(crate) sim_time_s: f64,
    /// In real time: ticks for which no new action had come.
    pub(crate) missed_ticks: u64,
    /// In real time: ticks that the server began more than half a tick after they were due.
    pub(crate) late_ticks: u64,
    /// In real time: the latest beginning of a tick, s.
    pub(crate) late_max_s: f64,
    /// In real time: observations that the client did not take in time.
    pub(crate) dropped_obs: u64,
    /// Hash of the final state, 16 hexadecimal digits.
    pub(crate) state_hash: String,
    /// Everything the referee noted.
    pub(crate) events: Vec<Event>,
    /// Its replay; absent when the run was not recorded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) replay: Option<ReplayInfo>,
    /// s; null for a session without a limit.
    pub(crate) session_left_s: Option<f64>,
}

/// The replay of a run: `GET /v1/runs/{id}/replay`.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct ReplayInfo {
    /// SHA-256 of the file, 64 hexadecimal digits.
    pub(crate) sha256: String,
    /// Its size.
    pub(crate) bytes: u64,
}

impl RunResult {
    /// A result from what the run gave.
    pub(crate) fn new(run: RunInfo, status: &str, outcome: Outcome) -> Self {
        RunResult {
            id: None,
            run_id: run.run_id,
            task: run.task,
            hand: run.hand,
            mode: run.mode,
            status: status.into(),
            score: outcome.score,
            in_goal: outcome.in_goal,
            outside: outcome.outside,
            reason: outcome.reason,
            ticks: outcome.ticks,
            sim_time_s: outcome.sim_time_s,
            replay: None,
            missed_ticks: 0,
            late_ticks: 0,
            late_max_s: 0.0,
            dropped_obs: 0,
            state_hash: outcome.state_hash,
            events: outcome.events,
            session_left_s: None,
        }
    }
}

/// `time`: how the session's clock stands.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct TimeReport {
    /// Of the request.
    pub(crate) id: u64,
    /// What is left, s; null for a session without a limit.
    pub(crate) session_left_s: Option<f64>,
    /// Length of the session, s; null for none.
    pub(crate) session_s: Option<f64>,
    /// The greater of the next two, s.
    pub(crate) elapsed_s: f64,
    /// Wall-clock time since the first reset, pauses left out, s.
    pub(crate) wall_s: f64,
    /// Simulated time of all runs, s.
    pub(crate) simulated_s: f64,
    /// Time given back for faults of the server, s; the other times are without it.
    pub(crate) refunded_s: f64,
    /// Whether an organizer has stopped the clock.
    pub(crate) paused: bool,
    /// The session's run, if any.
    pub(crate) run: Option<RunInfo>,
    /// The server's clock, ms since 1970 UTC.
    pub(crate) server_unix_ms: u64,
}

/// `error`: why a request failed. It changed nothing.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct ErrorReply {
    /// Of the request; absent when it could not be read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) id: Option<u64>,
    /// For programs.
    pub(crate) code: Code,
    /// For people.
    pub(crate) message: String,
    /// The connection closes after this.
    pub(crate) fatal: bool,
    /// When asking again makes sense, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) retry_after_s: Option<f64>,
}

/// `warning`: the session's time is running out. Sent unasked at 300, 60 and 10 s.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct Warning {
    /// Which of the marks was passed, s.
    pub(crate) mark_s: u32,
    /// What is left, s.
    pub(crate) session_left_s: f64,
}
