//! What a client asks.

use palmares_tasks::{Action, Noise, Sensing};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// A request without its envelope (`op`, `id`).
#[derive(Debug, strum::IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum Request {
    /// Greets the server: opens a session or takes one up again.
    Hello(Hello),
    /// Opens a run.
    Reset(Reset),
    /// Advances the world.
    Step(Step),
    /// Tells a realtime world what to do next.
    Act(Act),
    /// Pushes the hand.
    Perturb(Perturb),
    /// Closes the run and asks for its result.
    Stop(Stop),
    /// Asks for the session's clock.
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
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Hello {
    /// Who is asking. In practice its name is the team's name on the leaderboard.
    pub client: ClientInfo,
    /// From an earlier `welcome`: takes that session up again, within 30 s of losing the connection.
    #[serde(default)]
    pub resume_token: Option<String>,
    /// Practice only: length of the session in s. Without it a practice session has no limit.
    #[serde(default)]
    pub session_s: Option<f64>,
}

/// Who is asking: `"name/version"`, or an object.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a string \"name\" or an object {\"name\": …, \"version\"?: …}")]
pub enum ClientInfo {
    /// `"name"` or `"name/version"`.
    Short(String),
    /// In full.
    #[serde(rename_all = "snake_case")]
    Full {
        /// 1 to 64 characters that can be seen: see the section Names of the protocol.
        name: String,
        /// Version of the client program.
        #[serde(default)]
        version: Option<String>,
    },
}

impl ClientInfo {
    /// Name and version as they were sent.
    pub fn parts(&self) -> (&str, Option<&str>) {
        match self {
            // A slash may also stand in a name; a version begins with a digit.
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
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Reset {
    /// Name of a task, see `welcome.tasks`.
    pub task: String,
    /// Name of a hand, see `welcome.hands`.
    pub hand: String,
    /// How time passes.
    #[serde(default)]
    pub mode: Mode,
    /// How much `obs` shows.
    #[serde(default)]
    pub sensing: Sensing,
    /// How good the sensors are; in a competition the organizer says. Left out: as the competition has it.
    #[serde(default)]
    pub noise: Option<Noise>,
    /// Practice only: which scene, 0 to 2⁵³ − 1. Left out, the server draws one.
    #[serde(default)]
    pub seed: Option<u64>,
    /// Cameras to look through at tick 0; see `step`.
    #[serde(default)]
    pub cameras: Vec<String>,
    /// None are defined yet; must be left out or empty.
    #[serde(default)]
    pub options: Map<String, Value>,
}

/// How time passes in a run.
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
#[derive(Clone, Debug, JsonSchema)]
pub struct Step {
    /// The current tick: that of the last `obs`.
    pub tick: u64,
    /// Targets; what is left out keeps its last target.
    pub action: Action,
    /// Ticks to advance, 1 to `welcome.limits.repeat`; 1 when left out. Ends early when the run is over.
    #[schemars(default = "one")]
    pub repeat: u32,
    /// Cameras whose pictures the observation shall have: `name` for depth, or `name.depth`, `name.rgb`, `name.bodies`.
    #[schemars(default)]
    pub cameras: Vec<String>,
}

/// `act`: from its next tick on a realtime world follows this action.
#[derive(Clone, Debug, JsonSchema)]
pub struct Act {
    /// Targets; what is left out keeps its last target.
    pub action: Action,
    /// Cameras whose pictures the next observation shall have; see `step`.
    #[schemars(default)]
    pub cameras: Vec<String>,
}

/// `perturb`: practice only. A wrench acts on a link of the hand from the next tick on.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Perturb {
    /// Name of a link of the hand.
    pub link: String,
    /// World frame; the torque is about the link's origin, where the force acts.
    pub wrench: PushWrench,
    /// For how long, s of simulated time.
    pub duration_s: f64,
}

/// Force and torque.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PushWrench {
    /// N
    pub force: [f64; 3],
    /// N·m; none when left out.
    #[serde(default)]
    pub torque: [f64; 3],
}

pub(crate) fn one() -> u32 {
    1
}

/// `stop`: lets the objects settle, counts, closes the run.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stop {}

/// `time`: how the session's clock stands.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Time {}

/// `bye`: ends the session; an open run is stopped and scored first.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bye {}
