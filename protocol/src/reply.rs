//! The server's messages.
//!
//! A field that a later version of v1 added has `#[schemars(default)]`: clients read its default where an earlier server does
//! not send it.

use crate::code::{Code, Refusal};
use crate::obs::Obs;
use crate::request::Mode;
use crate::specs::Specs;
use palmares_models::camera::Camera;
use palmares_models::hand::Hand;
use palmares_senses::channels::cameras::ImageInfo;
use palmares_senses::{ChannelInfo, ENCODERS, JOINTS, MOTORS, TAXELS};
use palmares_tasks::{Event, Fault, Noise, Outcome, Reason, Task};
use schemars::JsonSchema;
use serde::Serialize;

/// A message from the server.
#[derive(Clone, Debug, Serialize, JsonSchema)]
#[serde(tag = "op", rename_all = "snake_case")]
pub enum Reply {
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
    pub fn refused(id: Option<u64>, refusal: &Refusal) -> Self {
        Reply::Error(ErrorReply::of(id, refusal))
    }
}

/// `welcome`: what this server offers.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Welcome {
    /// Of the request.
    pub id: u64,
    /// Identifies the session.
    pub session_id: String,
    /// Secret that takes the session up again on a new connection.
    pub resume_token: String,
    /// Name of the team on the leaderboard.
    pub team: String,
    /// s; null for a session without a limit.
    pub session_left_s: Option<f64>,
    /// The competition.
    pub competition: Competition,
    /// The program.
    pub server: ServerInfo,
    /// What a client must keep to.
    pub limits: Limits,
    /// Tasks that can be played.
    pub tasks: Vec<TaskInfo>,
    /// Hands that can be played with.
    pub hands: Vec<HandInfo>,
    /// Fields of actions and observations.
    pub specs: Specs,
    /// The run that goes on, when a session is taken up again; else null.
    pub run: Option<RunInfo>,
    /// For people: what is odd about the team's name. Absent when nothing is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// The competition.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Competition {
    /// For people.
    pub name: String,
    /// `practice`: no token, own seeds, full state.
    pub mode: String,
    /// Length of a session, s; null for none.
    pub session_s: Option<f64>,
    /// What each `reset` that opens a run takes from the session, s.
    #[schemars(default)]
    pub reset_cost_s: f64,
    /// How good the sensors of a run are that does not ask for others; in a competition, of every run.
    #[schemars(default)]
    pub noise: Noise,
    /// Tasks that are played with `sensors` only.
    #[schemars(default)]
    pub sensors_only: Vec<String>,
}

/// The program.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ServerInfo {
    /// Version of the program.
    pub version: String,
    /// Commit it was built from.
    pub build_hash: String,
}

/// What a client must keep to.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Limits {
    /// Largest inbound message.
    pub message_bytes: usize,
    /// Largest `repeat` of a `step`.
    pub repeat: u32,
    /// Requests per second that a connection may keep up.
    pub requests_per_s: f64,
    /// Requests it may send at once beyond that rate.
    pub requests_burst: f64,
    /// How long a session waits for its client to come back, s.
    pub resume_grace_s: f64,
    /// Period of the server's pings, s.
    pub ping_interval_s: f64,
    /// A connection silent for this long, or that does not take a message for this long, is dropped, s.
    pub ping_timeout_s: f64,
    /// A connection that has not said hello for this long is closed, s.
    pub hello_timeout_s: f64,
    /// In real time: for so many ticks a silent controller's last action goes on; then the hand holds still.
    pub hold_ticks: u32,
    /// In real time: observations that wait for a slow client; of more the oldest is dropped.
    pub outbox_obs: usize,
}

/// A camera in short.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct CameraInfo {
    /// For `step.cameras`; a hand's is called `hand_…` in a task that has one of the same name.
    pub name: String,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Horizontal field of view, degrees.
    pub fov_deg: f64,
    /// What is nearer gives no reading, m.
    pub near: f64,
    /// What is farther gives no reading, m.
    pub far: f64,
    /// The images that it takes.
    #[schemars(default)]
    pub images: Vec<ImageInfo>,
}

impl CameraInfo {
    /// A camera in short.
    pub fn of(camera: &Camera) -> Self {
        let Camera { name, width, height, fov_deg, near, far, .. } = camera;
        CameraInfo {
            name: name.clone(),
            width: *width,
            height: *height,
            fov_deg: *fov_deg,
            near: *near,
            far: *far,
            images: ImageInfo::all(camera),
        }
    }
}

/// A task in short.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TaskInfo {
    /// For `reset`.
    pub name: String,
    /// For people.
    pub description: String,
    /// Length of a tick, s.
    pub tick_s: f64,
    /// Length of a physics step, s.
    pub step_s: f64,
    /// Longest run, s of simulated time.
    pub time_limit_s: f64,
    /// Its cameras.
    #[schemars(default)]
    pub cameras: Vec<CameraInfo>,
    /// SHA-256 of everything that it is, 64 hexadecimal digits.
    #[schemars(default)]
    pub hash: String,
}

impl TaskInfo {
    /// A task in short.
    pub fn of(task: &Task) -> Self {
        TaskInfo {
            name: task.name.clone(),
            description: task.description.clone(),
            tick_s: task.tick_s,
            step_s: task.step_s,
            time_limit_s: task.time_limit_s,
            cameras: task.cameras.iter().map(CameraInfo::of).collect(),
            hash: task.content_hash().to_owned(),
        }
    }
}

/// A hand in short; `GET /v1/hands/{name}` has the rest.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct HandInfo {
    /// For `reset`.
    pub name: String,
    /// For people.
    pub description: String,
    /// Names of the motors, in the order of `action.hand`.
    pub motors: Vec<String>,
    /// Names of the joint coordinates, in the order of `truth.joints`.
    pub joints: Vec<String>,
    /// Names of the joints that have an encoder, in the order of `hand.joints`.
    #[schemars(default)]
    pub encoders: Vec<String>,
    /// Names of the taxels, in the order of `hand.touch`.
    #[schemars(default)]
    pub taxels: Vec<String>,
    /// The channels of `obs.hand` with this hand.
    #[schemars(default)]
    pub channels: Vec<ChannelInfo>,
    /// Its cameras.
    #[schemars(default)]
    pub cameras: Vec<CameraInfo>,
}

impl HandInfo {
    /// A hand in short.
    pub fn of(hand: &Hand) -> Self {
        HandInfo {
            name: hand.name.clone(),
            description: hand.description.clone(),
            motors: (MOTORS.names)(hand),
            joints: (JOINTS.names)(hand),
            encoders: (ENCODERS.names)(hand),
            taxels: (TAXELS.names)(hand),
            channels: ChannelInfo::all(hand),
            cameras: hand.sensors.cameras.iter().map(CameraInfo::of).collect(),
        }
    }
}

/// The session's present run.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct RunInfo {
    /// Identifies the run.
    pub run_id: String,
    /// Its task.
    pub task: String,
    /// Its hand.
    pub hand: String,
    /// How time passes in it.
    #[schemars(default)]
    pub mode: Mode,
    /// The current tick, which the next `step` must name.
    pub tick: u64,
    /// False when the server closed it (time limit, end of the session): `stop` fetches the result.
    pub open: bool,
}

/// `ack`: the action or push was taken.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Ack {
    /// Of the request.
    pub id: u64,
    /// The tick at which it takes effect: the `obs` of this tick is the first to show it.
    pub tick: u64,
}

/// `result`: what a finished run is worth. It stands in the server's database when this is sent.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct RunResult {
    /// Of the request; absent when the server closed the run and tells it unasked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<u64>,
    /// Identifies the run.
    pub run_id: String,
    /// Its task.
    pub task: String,
    /// SHA-256 of everything that the task is, 64 hexadecimal digits.
    #[schemars(default)]
    pub task_hash: String,
    /// Its hand.
    pub hand: String,
    /// How time passed in it.
    #[schemars(default)]
    pub mode: Mode,
    /// `practice`, or `voided` after a fault of the server.
    pub status: String,
    /// Points.
    pub score: f64,
    /// Objects in the goal; where objects are arranged, goals reached.
    pub in_goal: u32,
    /// Objects outside both boxes.
    pub outside: u32,
    /// Why the run ended.
    pub reason: Reason,
    /// What the world failed of; absent when it did not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fault: Option<Fault>,
    /// For people: what that means and what to try; absent when the world did not fail.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
    /// Ticks played.
    pub ticks: u64,
    /// s of simulated time played.
    pub sim_time_s: f64,
    /// In real time: ticks for which no new action had come.
    #[schemars(default)]
    pub missed_ticks: u64,
    /// In real time: ticks that the server began more than half a tick after they were due.
    #[schemars(default)]
    pub late_ticks: u64,
    /// In real time: the latest beginning of a tick, s.
    #[schemars(default)]
    pub late_max_s: f64,
    /// In real time: observations that the client did not take in time.
    #[schemars(default)]
    pub dropped_obs: u64,
    /// Hash of the final state, 16 hexadecimal digits.
    pub state_hash: String,
    /// Everything the referee noted.
    #[schemars(default)]
    pub events: Vec<Event>,
    /// Its replay; absent when the run was not recorded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub replay: Option<ReplayInfo>,
    /// s; null for a session without a limit.
    pub session_left_s: Option<f64>,
}

/// The replay of a run: `GET /v1/runs/{id}/replay`.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ReplayInfo {
    /// SHA-256 of the file, 64 hexadecimal digits.
    pub sha256: String,
    /// Its size.
    pub bytes: u64,
}

impl RunResult {
    /// A result from what the run gave.
    pub fn new(run: RunInfo, task_hash: &str, status: &str, outcome: Outcome) -> Self {
        RunResult {
            id: None,
            run_id: run.run_id,
            task: run.task,
            task_hash: task_hash.into(),
            hand: run.hand,
            mode: run.mode,
            status: status.into(),
            score: outcome.score,
            in_goal: outcome.in_goal,
            outside: outcome.outside,
            reason: outcome.reason,
            fault: outcome.fault,
            note: None,
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
pub struct TimeReport {
    /// Of the request.
    pub id: u64,
    /// What is left, s; null for a session without a limit.
    pub session_left_s: Option<f64>,
    /// Length of the session, s; null for none.
    pub session_s: Option<f64>,
    /// The greater of the next two, s.
    pub elapsed_s: f64,
    /// Wall-clock time since the first reset, pauses left out, s.
    pub wall_s: f64,
    /// Simulated time of all runs, s.
    pub simulated_s: f64,
    /// Time given back for faults of the server, s; the other times are without it.
    #[schemars(default)]
    pub refunded_s: f64,
    /// Whether an organizer has stopped the clock.
    #[schemars(default)]
    pub paused: bool,
    /// The session's run, if any.
    pub run: Option<RunInfo>,
    /// The server's clock, ms since 1970 UTC.
    #[schemars(default)]
    pub server_unix_ms: u64,
}

/// `error`: why a request failed. It changed nothing.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ErrorReply {
    /// Of the request; absent when it could not be read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<u64>,
    /// For programs.
    pub code: Code,
    /// For people.
    pub message: String,
    /// The connection closes after this.
    pub fatal: bool,
    /// When asking again makes sense, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub retry_after_s: Option<f64>,
    /// What the world of the run failed of, when that is why; absent otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fault: Option<Fault>,
}

impl ErrorReply {
    /// The error message of a refusal.
    pub fn of(id: Option<u64>, refusal: &Refusal) -> Self {
        ErrorReply {
            id,
            code: refusal.code,
            message: refusal.message.clone(),
            fatal: refusal.fatal,
            retry_after_s: refusal.retry_after_s,
            fault: refusal.fault,
        }
    }
}

/// `warning`: the session's time is running out. Sent unasked at 300, 60 and 10 s.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Warning {
    /// Which of the marks was passed, s.
    pub mark_s: u32,
    /// What is left, s.
    pub session_left_s: f64,
}
