//! The server's messages.
//!
//! A field that a later version of v1 added has `#[schemars(default)]`: clients read its default where an earlier
//! server does not send it.

use crate::code::{Code, Refusal};
use crate::obs::Obs;
use crate::request::Mode;
use crate::specs::Specs;
use palmares_models::arm::{Arm, ArmJoint};
use palmares_models::camera::Camera;
use palmares_models::hand::Hand;
use palmares_senses::channels::cameras::ImageInfo;
use palmares_senses::{ChannelInfo, ENCODERS, JOINTS, MOTORS, TAXELS};
use palmares_tasks::task::GoalInfo;
use palmares_tasks::{Event, Fault, Noise, Outcome, Reason, Scenes, Task};
use schemars::JsonSchema;
use serde::Serialize;

/// A message from the server.
#[derive(Clone, Debug, Serialize, JsonSchema)]
#[serde(tag = "op", rename_all = "snake_case")]
pub enum Reply {
    /// Reply to `hello`.
    Welcome(Box<Welcome>),
    /// Reply to `reset` and `step`; in a realtime run, sent after every tick.
    Obs(Box<Obs>),
    /// Reply to `act` and `perturb`.
    Ack(Ack),
    /// Reply to `stop`.
    Result(Box<RunResult>),
    /// Reply to `time`.
    Time(TimeReport),
    /// Reply to a request that failed.
    Error(ErrorReply),
    /// Answers no request: the session's time is running out.
    Warning(Warning),
}

impl Reply {
    /// The error message of a refusal.
    pub fn refused(id: Option<u64>, refusal: &Refusal) -> Self {
        Reply::Error(ErrorReply::of(id, refusal))
    }
}

/// `welcome`: everything that holds for the whole session.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Welcome {
    /// The id of the request.
    pub id: u64,
    /// Identifies the session.
    pub session_id: String,
    /// Secret with which a new connection resumes the session.
    pub resume_token: String,
    /// Name of the team on the leaderboard.
    pub team: String,
    /// Remaining time, s; null for a session without a limit.
    pub session_left_s: Option<f64>,
    /// The competition.
    pub competition: Competition,
    /// The program.
    pub server: ServerInfo,
    /// Limits of requests and connections.
    pub limits: Limits,
    /// Tasks of the server.
    pub tasks: Vec<TaskInfo>,
    /// Hands of the server.
    pub hands: Vec<HandInfo>,
    /// Fields of actions and observations.
    pub specs: Specs,
    /// The open run of a session that is resumed; otherwise null.
    pub run: Option<RunInfo>,
    /// A remark on the team's name, for people; absent if there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// The competition, or the practice, that the server runs.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Competition {
    /// Name, for people.
    pub name: String,
    /// `practice` (no token, own seeds, full state) or `official`.
    pub mode: String,
    /// Length of a session, s; null for none.
    pub session_s: Option<f64>,
    /// Time that each `reset` takes from the session, s.
    #[schemars(default)]
    pub reset_cost_s: f64,
    /// Sensor errors of runs that request none; in a competition, of every run.
    #[schemars(default)]
    pub noise: Noise,
    /// Tasks whose runs must have sensing `sensors`.
    #[schemars(default)]
    pub sensors_only: Vec<String>,
    /// Whether the seed of a run draws the numbers of its hand that are known as ranges.
    #[schemars(default)]
    pub hand_spread: bool,
    /// Whose scene run `k` of a task has, in a competition: one for all teams, or every team's own.
    #[schemars(default)]
    pub scenes: Scenes,
}

/// The program of the server.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ServerInfo {
    /// Version.
    pub version: String,
    /// Commit it was built from.
    pub build_hash: String,
}

/// Limits of requests and connections; those of actions are in `specs`.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Limits {
    /// Largest message of a client, bytes.
    pub message_bytes: usize,
    /// Largest `repeat` of a `step`.
    pub repeat: u32,
    /// Largest rate of requests of a connection, 1/s.
    pub requests_per_s: f64,
    /// Requests that a connection may send at once above that rate.
    pub requests_burst: f64,
    /// Time that a session without a connection waits for its client, s.
    pub resume_grace_s: f64,
    /// Period of the server's pings, s.
    pub ping_interval_s: f64,
    /// A connection that is silent, or does not read a message, for this long is closed, s.
    pub ping_timeout_s: f64,
    /// Largest time between the opening of a connection and `hello`, s.
    pub hello_timeout_s: f64,
    /// Realtime: after this number of ticks without an action, the hand holds still.
    pub hold_ticks: u32,
    /// Realtime: largest number of unread observations; the server drops the oldest of more.
    pub outbox_obs: usize,
}

/// A camera of a task or a hand.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct CameraInfo {
    /// Its name in `step.cameras`. A hand's camera has the prefix `hand_` in a task that has a camera of its name.
    pub name: String,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Horizontal field of view, degrees.
    pub fov_deg: f64,
    /// Shortest distance with a reading, m.
    pub near: f64,
    /// Longest distance with a reading, m.
    pub far: f64,
    /// The images that it takes.
    #[schemars(default)]
    pub images: Vec<ImageInfo>,
}

impl CameraInfo {
    /// A camera of a task or a hand.
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

/// Constants of a task.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TaskInfo {
    /// Its name in `reset`.
    pub name: String,
    /// Text for people.
    pub description: String,
    /// Length of a tick, s.
    pub tick_s: f64,
    /// Time step of the integrator, s.
    pub step_s: f64,
    /// Longest run, s of simulated time.
    pub time_limit_s: f64,
    /// Its cameras.
    #[schemars(default)]
    pub cameras: Vec<CameraInfo>,
    /// SHA-256 of the whole task, 64 hexadecimal digits.
    #[schemars(default)]
    pub hash: String,
    /// Its goals with their points and tolerances, in the order in which they are reached.
    #[schemars(default)]
    pub goals: Vec<GoalInfo>,
    /// Joints of the arm that carries the hand, in the order of `base.joints`; empty where the hand flies freely.
    #[schemars(default)]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub arm: Vec<ArmJointInfo>,
}

/// A joint of an arm.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ArmJointInfo {
    /// Its name in the URDF.
    pub name: String,
    /// `rad`, or `m` for a joint that slides.
    pub unit: &'static str,
    /// Least position; null for a joint without end.
    pub minimum: Option<f64>,
    /// Largest position; null for a joint without end.
    pub maximum: Option<f64>,
    /// Largest speed, 1/s.
    pub speed: f64,
}

impl ArmJointInfo {
    /// The joints of an arm.
    fn all(arm: &Arm) -> Vec<Self> {
        let finite = |x: f64| x.is_finite().then_some(x);
        let info = |joint: &ArmJoint| ArmJointInfo {
            name: joint.name.clone(),
            unit: if joint.turns { "rad" } else { "m" },
            minimum: finite(joint.lower),
            maximum: finite(joint.upper),
            speed: joint.speed,
        };
        arm.joints.iter().map(info).collect()
    }
}

impl TaskInfo {
    /// Constants of a task.
    pub fn of(task: &Task) -> Self {
        TaskInfo {
            name: task.name.clone(),
            description: task.description.clone(),
            tick_s: task.tick_s,
            step_s: task.step_s,
            time_limit_s: task.time_limit_s,
            cameras: task.cameras.iter().map(CameraInfo::of).collect(),
            hash: task.content_hash().to_owned(),
            goals: task.rules.goals(),
            arm: task.arm.as_ref().map_or_else(Vec::new, |carrier| ArmJointInfo::all(carrier.arm())),
        }
    }
}

/// Names of a hand's parts; `GET /v1/hands/{name}` returns its geometry.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct HandInfo {
    /// Its name in `reset`.
    pub name: String,
    /// Text for people.
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
    /// The names of a hand's parts.
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

/// The session's open run.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct RunInfo {
    /// Identifies the run.
    pub run_id: String,
    /// Its task.
    pub task: String,
    /// Its hand.
    pub hand: String,
    /// Pace of its world.
    #[schemars(default)]
    pub mode: Mode,
    /// The current tick, which the next `step` must name.
    pub tick: u64,
    /// False if the server closed it (time limit, end of the session): `stop` returns the result.
    pub open: bool,
}

/// `ack`: the action or push is accepted.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Ack {
    /// The id of the request.
    pub id: u64,
    /// The tick at which it takes effect: the observation of this tick is the first with its effect.
    pub tick: u64,
}

/// `result`: the outcome of a finished run. The server has stored it before it sends it.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct RunResult {
    /// The id of the request; absent if the server closed the run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<u64>,
    /// Identifies the run.
    pub run_id: String,
    /// Its task.
    pub task: String,
    /// SHA-256 of the whole task, 64 hexadecimal digits.
    #[schemars(default)]
    pub task_hash: String,
    /// Its hand.
    pub hand: String,
    /// Pace of its world.
    #[schemars(default)]
    pub mode: Mode,
    /// `practice`; `training` for a run with training options; in a competition `provisional`; `aborted` if it ended
    /// at tick 0; `voided` after a fault of the server or by a decision of the organizer.
    pub status: String,
    /// Points.
    pub score: f64,
    /// Objects in the goal; where objects are arranged, goals reached.
    pub in_goal: u32,
    /// Objects outside both boxes.
    pub outside: u32,
    /// Reason why the run ended.
    pub reason: Reason,
    /// The fault of its world; absent if there was none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fault: Option<Fault>,
    /// Meaning of the fault and advice, for display; absent without a fault.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
    /// Number of ticks.
    pub ticks: u64,
    /// Simulated time, s.
    pub sim_time_s: f64,
    /// Realtime: ticks without a new action.
    #[schemars(default)]
    pub missed_ticks: u64,
    /// Realtime: ticks that the server began more than half a tick after they were due.
    #[schemars(default)]
    pub late_ticks: u64,
    /// Realtime: longest such delay, s.
    #[schemars(default)]
    pub late_max_s: f64,
    /// Realtime: observations that the server dropped because the client did not read them in time.
    #[schemars(default)]
    pub dropped_obs: u64,
    /// Hash of the final state, 16 hexadecimal digits.
    pub state_hash: String,
    /// All events of the referee.
    #[schemars(default)]
    pub events: Vec<Event>,
    /// Its replay; absent if the run was not recorded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub replay: Option<ReplayInfo>,
    /// Remaining time, s; null for a session without a limit.
    pub session_left_s: Option<f64>,
}

/// The replay of a run: `GET /v1/runs/{id}/replay`.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ReplayInfo {
    /// SHA-256 of the file, 64 hexadecimal digits.
    pub sha256: String,
    /// Size of the file.
    pub bytes: u64,
}

impl RunResult {
    /// The result of a run.
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

/// `time`: the session's clock.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TimeReport {
    /// The id of the request.
    pub id: u64,
    /// Remaining time, s; null for a session without a limit.
    pub session_left_s: Option<f64>,
    /// Length of the session, s; null for none.
    pub session_s: Option<f64>,
    /// The greater of `wall_s` and `simulated_s`, s.
    pub elapsed_s: f64,
    /// Wall-clock time since the first reset, without pauses, s.
    pub wall_s: f64,
    /// Simulated time of all runs, s.
    pub simulated_s: f64,
    /// Time that was refunded for faults of the server, s; it is not part of the other times.
    #[schemars(default)]
    pub refunded_s: f64,
    /// Whether an organizer pauses the session.
    #[schemars(default)]
    pub paused: bool,
    /// The session's open run, if any.
    pub run: Option<RunInfo>,
    /// The server's clock, ms since 1970 UTC.
    #[schemars(default)]
    pub server_unix_ms: u64,
}

/// `error`: why a request failed. A request that fails changes nothing.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ErrorReply {
    /// The id of the request; absent if it could not be read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<u64>,
    /// The kind of the error, for programs.
    pub code: Code,
    /// The problem, and the valid values.
    pub message: String,
    /// Whether the connection closes after this error.
    pub fatal: bool,
    /// Time after which to try again, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub retry_after_s: Option<f64>,
    /// The fault of the run's world, if it is the reason; otherwise absent.
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

/// `warning`: the session's time is running out. It comes when 300, 60 and 10 s are left.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Warning {
    /// The mark that was passed: 300, 60 or 10 s.
    pub mark_s: u32,
    /// Remaining time, s.
    pub session_left_s: f64,
}
