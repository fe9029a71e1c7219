//! The messages of the watch socket to spectators. None carries a seed.

use palmares_models::hand::describe::HandDescription;
use palmares_protocol::reply::ErrorReply;
use palmares_senses::ChannelInfo;
use palmares_store::{Announcement, LeaderboardRow};
use palmares_tasks::referee::ObjectStatus;
use palmares_tasks::run::{Contact, Telemetry};
use palmares_tasks::scene::{Region, ScenePart};
use palmares_tasks::{Event, Fault, Outcome, Reason};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A message to a spectator.
#[derive(Clone, Debug, Serialize, JsonSchema)]
#[serde(tag = "op", rename_all = "snake_case")]
pub(crate) enum WatchReply {
    /// Reply to `subscribe`.
    Subscribed(Subscribed),
    /// Reply to `list`.
    Runs(Runs),
    /// Everything to draw of a run that is shown from now on.
    Scene(Box<WatchScene>),
    /// Poses of all moving bodies, at most 30 times a second.
    Poses(Poses),
    /// The score has changed.
    Score(Score),
    /// Events of the referee.
    Events(Events),
    /// The run has ended.
    Ended(Ended),
    /// The session's clock, once a second.
    Clock(Clock),
    /// Reason why objects count or do not, when it has changed.
    Verdicts(Verdicts),
    /// The ranking: first, and whenever a result is stored.
    Leaderboard(Ranking),
    /// An organizer's announcement: the newest first, and each new one.
    Announcement(Announcement),
    /// Reply to a request that failed, or why the socket closes.
    Error(ErrorReply),
}

/// `subscribed`: the run that is shown from now on.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct Subscribed {
    /// Id of the request.
    pub(crate) id: u64,
    /// The run that is shown now; null when none is open. The next one is shown when it opens.
    pub(crate) run_id: Option<String>,
}

/// `runs`: the runs that can be watched now.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct Runs {
    /// Id of the request.
    pub(crate) id: u64,
    /// Open runs.
    pub(crate) runs: Vec<WatchRun>,
}

/// An open run, without what spectators must not know.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub(crate) struct WatchRun {
    /// Identifies the run.
    pub(crate) run_id: String,
    /// Identifies its session.
    pub(crate) session_id: String,
    /// Team that plays.
    pub(crate) team: String,
    /// Name of the task.
    pub(crate) task: String,
    /// Name of the hand.
    pub(crate) hand: String,
    /// Whether it counts in a competition.
    pub(crate) official: bool,
    /// Length of a tick, s.
    pub(crate) tick_s: f64,
    /// Longest run, s of simulated time.
    pub(crate) time_limit_s: f64,
}

/// `scene`: everything to draw.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct WatchScene {
    /// The run that is shown.
    pub(crate) run: WatchRun,
    /// Objects, furniture and the hand's links.
    pub(crate) bodies: Vec<WatchBody>,
    /// Ids of the bodies that move, in the order of `poses.poses`.
    pub(crate) moving: Vec<usize>,
    /// Named regions of the task's rules.
    pub(crate) regions: Vec<Region>,
    /// Names of the task's goals in their order; absent where objects are counted instead.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) goals: Vec<String>,
    /// The hand's full description, as in `GET /v1/hands/{name}`. Left out for an uploaded hand, unless the viewer is of its
    /// team or an organizer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) hand: Option<Box<HandDescription>>,
    /// The channels of `telemetry.readings`, one after the other; with `hand` only.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) readings: Vec<ChannelInfo>,
}

/// Kind of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum BodyKind {
    /// An object to grasp; it moves.
    Object,
    /// A fixed body.
    Furniture,
    /// A link of the hand; it moves.
    Hand,
}

/// A body and its shapes.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct WatchBody {
    /// Identifies the body within the run.
    pub(crate) id: usize,
    /// Name for people.
    pub(crate) name: String,
    /// Its kind.
    pub(crate) kind: BodyKind,
    /// Position at tick 0, m.
    pub(crate) position: [f64; 3],
    /// Orientation at tick 0: x, y, z, w.
    pub(crate) quat_xyzw: [f64; 4],
    /// Convex parts in the body frame.
    pub(crate) parts: Vec<ScenePart>,
    /// sRGB, 0 to 1.
    pub(crate) color: [f64; 3],
}

/// `poses`: poses of all moving bodies.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct Poses {
    /// The run.
    pub(crate) run_id: String,
    /// Ticks since reset.
    pub(crate) tick: u64,
    /// s since reset.
    pub(crate) sim_time_s: f64,
    /// For every body of `scene.moving`: position x, y, z in m, orientation x, y, z, w. In single precision.
    pub(crate) poses: Vec<[f32; 7]>,
    /// Internal state of the hand, for viewers with the overlay `telemetry`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) telemetry: Option<Telemetry>,
    /// Every touching contact, for viewers with the overlay `contacts`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) contacts: Option<Vec<Contact>>,
}

/// `clock`: the session's clock, once a second.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct Clock {
    /// The run.
    pub(crate) run_id: String,
    /// Time left in the session, s; null when it has no limit.
    pub(crate) session_left_s: Option<f64>,
    /// Time that the session has spent, s; null when its clock is not known.
    pub(crate) elapsed_s: Option<f64>,
    /// Whether an organizer has stopped the session's clock.
    pub(crate) paused: Option<bool>,
    /// Simulated time per time in the last second; null in the first message.
    pub(crate) real_time_factor: Option<f64>,
    /// Largest delay of a tick in the last second, s; null in a lockstep run.
    pub(crate) late_s: Option<f64>,
}

/// `verdicts`: why objects count or do not, at most twice a second when it has changed.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct Verdicts {
    /// The run.
    pub(crate) run_id: String,
    /// Ticks since reset.
    pub(crate) tick: u64,
    /// In scene order.
    pub(crate) objects: Vec<ObjectStatus>,
}

/// `score`: the run's score if it ended now.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct Score {
    /// The run.
    pub(crate) run_id: String,
    /// Ticks since reset.
    pub(crate) tick: u64,
    /// Points.
    pub(crate) score: f64,
}

/// `events`: events of the referee.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct Events {
    /// The run.
    pub(crate) run_id: String,
    /// Events in order of time.
    pub(crate) events: Vec<Event>,
}

/// `ended`: the run is over. The next one of the session is shown when it opens.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct Ended {
    /// The run.
    pub(crate) run_id: String,
    /// Its outcome; null when the world failed.
    pub(crate) outcome: Option<Final>,
    /// Reason why the world failed; absent when it did not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) fault: Option<Fault>,
}

/// The outcome of a run.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct Final {
    /// Points.
    pub(crate) score: f64,
    /// Objects in the goal; where the scene has goals, goals reached.
    pub(crate) in_goal: u32,
    /// Objects outside.
    pub(crate) outside: u32,
    /// Reason why it ended.
    pub(crate) reason: Reason,
    /// Ticks played.
    pub(crate) ticks: u64,
    /// s of simulated time played.
    pub(crate) sim_time_s: f64,
}

impl Final {
    /// The part of an outcome that spectators get.
    pub(crate) fn of(outcome: &Outcome) -> Self {
        Final {
            score: outcome.score,
            in_goal: outcome.in_goal,
            outside: outcome.outside,
            reason: outcome.reason,
            ticks: outcome.ticks,
            sim_time_s: outcome.sim_time_s,
        }
    }
}

/// `leaderboard`: the ranking.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct Ranking {
    /// Best first.
    pub(crate) rows: Vec<LeaderboardRow>,
}
