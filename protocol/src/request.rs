//! The messages of a client.

use palmares_tasks::{Action, Noise, Sensing};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// A request without its envelope (`op`, `id`).
#[derive(Clone, Debug, PartialEq, strum::IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum Request {
    /// Opens or resumes a session.
    Hello(Hello),
    /// Opens a run.
    Reset(Reset),
    /// Advances the world.
    Step(Step),
    /// Sets the targets of a realtime run.
    Act(Act),
    /// Applies a wrench to the hand.
    Perturb(Perturb),
    /// Closes the run and requests its result.
    Stop(Stop),
    /// Requests the session's clock.
    Time(Time),
    /// Ends the session.
    Bye(Bye),
}

impl Request {
    /// The `op` on the wire.
    pub fn op(&self) -> &'static str {
        self.into()
    }
}

/// `hello`: the first request on every connection.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Hello {
    /// The client program. In practice its name is the team's name on the leaderboard.
    pub client: ClientInfo,
    /// From an earlier `welcome`: resumes that session, within 30 s of the loss of its connection.
    #[serde(default)]
    pub resume_token: Option<String>,
    /// Practice only: length of the session, s; without it, a practice session has no limit.
    #[serde(default)]
    pub session_s: Option<f64>,
}

/// The client program: `"name/version"`, or an object.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a string \"name\" or an object {\"name\": …, \"version\"?: …}")]
pub enum ClientInfo {
    /// `"name"` or `"name/version"`.
    Short(String),
    /// As an object.
    #[serde(rename_all = "snake_case")]
    Full {
        /// 1 to 64 visible characters; see the section Names of the protocol.
        name: String,
        /// Version of the client program.
        #[serde(default)]
        version: Option<String>,
    },
}

impl ClientInfo {
    /// Name and version.
    pub fn parts(&self) -> (&str, Option<&str>) {
        match self {
            // A name may have a slash, too; a version begins with a digit.
            ClientInfo::Short(text) => match text.rsplit_once('/') {
                Some((name, version)) if version.starts_with(|c: char| c.is_ascii_digit()) => {
                    (name, Some(version))
                }
                _ => (text.as_str(), None),
            },
            ClientInfo::Full { name, version } => (name.as_str(), version.as_deref()),
        }
    }
}

/// `reset`: opens a run at tick 0.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Reset {
    /// Name of a task, see `welcome.tasks`.
    pub task: String,
    /// Name of a hand, see `welcome.hands`.
    pub hand: String,
    /// Pace of the world.
    #[serde(default)]
    pub mode: Mode,
    /// Part of the state that the observations have.
    #[serde(default)]
    pub sensing: Sensing,
    /// The errors of the sensors; without it, those of `welcome.competition`, which a competition prescribes.
    #[serde(default)]
    pub noise: Option<Noise>,
    /// Practice only: number of the scene, 0 to 2⁵³ − 1; without it, the server draws one.
    #[serde(default)]
    pub seed: Option<u64>,
    /// Cameras whose images the observation of tick 0 has; see `step`.
    #[serde(default)]
    pub cameras: Vec<String>,
    /// No options are defined; empty.
    #[serde(default)]
    pub options: Map<String, Value>,
}

/// Pace of the world of a run.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema, strum::IntoStaticStr,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Mode {
    /// The world waits for the controller: `step`.
    #[default]
    Lockstep,
    /// The world ticks at wall-clock rate: `act`.
    Realtime,
}

impl Mode {
    /// The word on the wire and in the database.
    pub fn as_str(self) -> &'static str {
        self.into()
    }
}

/// `step`: advances the world by `repeat` ticks under one action.
#[derive(Clone, Debug, PartialEq, JsonSchema)]
pub struct Step {
    /// The current tick: that of the last observation.
    pub tick: u64,
    /// Targets; an omitted field keeps its last target.
    pub action: Action,
    /// Ticks to advance, 1 to `welcome.limits.repeat`. The step is shorter if the run ends.
    #[schemars(default = "one")]
    pub repeat: u32,
    /// Cameras whose images the observation has: `name` for depth, or `name.depth`, `name.rgb`, `name.bodies`.
    #[schemars(default)]
    pub cameras: Vec<String>,
}

/// `act`: sets the action of a realtime run, from the next tick on.
#[derive(Clone, Debug, PartialEq, JsonSchema)]
pub struct Act {
    /// Targets; an omitted field keeps its last target.
    pub action: Action,
    /// Cameras whose images the next observation has; see `step`.
    #[schemars(default)]
    pub cameras: Vec<String>,
}

/// `perturb`: applies a wrench to a link of the hand, from the next tick on. Practice only.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Perturb {
    /// Name of a link of the hand.
    pub link: String,
    /// World frame. The force acts at the origin of the link, and the torque is about it.
    pub wrench: PushWrench,
    /// Duration, s of simulated time.
    pub duration_s: f64,
}

/// Force and torque.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PushWrench {
    /// N
    pub force: [f64; 3],
    /// N·m
    #[serde(default)]
    pub torque: [f64; 3],
}

pub(crate) fn one() -> u32 {
    1
}

/// `stop`: lets the objects settle, counts them and closes the run.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stop {}

/// `time`: requests the session's clock.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Time {}

/// `bye`: ends the session; an open run is stopped and scored first.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bye {}
