//! What a client asks: parsed in two stages, so that an error names the field and what would be right.

use crate::MAX_SAFE_INTEGER;
use crate::action::parse_action;
use crate::code::{Code, Refusal};
use crate::fast;
pub use crate::text::shortened;
use palmares_tasks::{Action, Sensing};
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// A request without its envelope (`op`, `id`).
#[derive(Debug)]
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
        match self {
            Request::Hello(_) => "hello",
            Request::Reset(_) => "reset",
            Request::Step(_) => "step",
            Request::Act(_) => "act",
            Request::Perturb(_) => "perturb",
            Request::Stop(_) => "stop",
            Request::Time(_) => "time",
            Request::Bye(_) => "bye",
        }
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
    /// Practice only: which scene, 0 to 2⁵³ − 1. Left out, the server draws one.
    #[serde(default)]
    pub seed: Option<u64>,
    /// None are defined yet; must be left out or empty.
    #[serde(default)]
    pub options: Map<String, Value>,
}

/// How time passes in a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
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
        match self {
            Mode::Lockstep => "lockstep",
            Mode::Realtime => "realtime",
        }
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
}

/// `step` with its action not yet looked into, which has a code of its own when it is wrong.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawStep {
    tick: u64,
    #[serde(default)]
    action: Option<Value>,
    #[serde(default = "one")]
    repeat: u32,
}

/// `act`: from its next tick on a realtime world follows this action.
#[derive(Clone, Debug, JsonSchema)]
pub struct Act {
    /// Targets; what is left out keeps its last target.
    pub action: Action,
}

/// `act` with its action not yet looked into.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawAct {
    #[serde(default)]
    action: Option<Value>,
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

/// A message with as much of its envelope as could be read.
pub struct Parsed {
    /// The request's id, where there is a valid one.
    pub id: Option<u64>,
    /// The request, or why it is none.
    pub request: Result<Request, Refusal>,
}

/// Reads a request in JSON.
pub fn parse_json(text: &str) -> Parsed {
    if let Some((id, request)) = fast::json(text) {
        return Parsed { id: Some(id), request: Ok(request) };
    }
    match serde_json::from_str(text) {
        Ok(value) => parse_long(value),
        Err(error) => unreadable(format!("not JSON: {error}")),
    }
}

/// Reads a request in MessagePack.
pub fn parse_msgpack(bytes: &[u8]) -> Parsed {
    if let Some((id, request)) = fast::msgpack(bytes) {
        return Parsed { id: Some(id), request: Ok(request) };
    }
    match value_of_msgpack(bytes) {
        Ok(value) => parse_long(value),
        Err(why) => unreadable(format!("not MessagePack: {why}")),
    }
}

fn unreadable(message: String) -> Parsed {
    Parsed { id: None, request: Err(Refusal::new(Code::BadJson, message)) }
}

/// MessagePack as a JSON value; what JSON has no number for becomes null, and is refused as such.
pub(crate) fn value_of_msgpack(bytes: &[u8]) -> Result<Value, String> {
    let mut reader = rmp_serde::Deserializer::new(std::io::Cursor::new(bytes));
    // As deep as the JSON reader goes.
    reader.set_max_depth(128);
    let value = Value::deserialize(&mut reader).map_err(|error| error.to_string())?;
    if reader.position() != bytes.len() as u64 {
        return Err("there is more after the message".into());
    }
    Ok(value)
}

/// Reads a request that is not a plain `step` or `act`, or says what is wrong with it.
pub(crate) fn parse_long(value: Value) -> Parsed {
    let mut fields = match value {
        Value::Object(fields) => fields,
        other => {
            let message = format!("a message is an object with `op` and `id`, not {}", kind_of(&other));
            return Parsed { id: None, request: Err(Refusal::new(Code::BadRequest, message)) };
        }
    };
    let id = match fields.remove("id") {
        Some(Value::Number(number)) => number.as_u64().filter(|&id| id <= MAX_SAFE_INTEGER),
        _ => None,
    };
    let request = if id.is_none() {
        Err(Refusal::new(Code::BadRequest, "id: every request carries a whole number from 0 to 2^53 - 1"))
    } else {
        parse_op(fields)
    };
    Parsed { id, request }
}

fn parse_op(mut fields: Map<String, Value>) -> Result<Request, Refusal> {
    let op = match fields.remove("op") {
        Some(Value::String(op)) => op,
        Some(other) => {
            let message = format!("op: expected a string, not {}", kind_of(&other));
            return Err(Refusal::new(Code::BadRequest, message));
        }
        None => return Err(Refusal::new(Code::BadRequest, "op: missing")),
    };
    match op.as_str() {
        "hello" => Ok(Request::Hello(typed("hello", fields)?)),
        "reset" => parse_reset(fields).map(Request::Reset),
        "step" => parse_step(fields).map(Request::Step),
        "stop" => Ok(Request::Stop(typed("stop", fields)?)),
        "time" => Ok(Request::Time(typed("time", fields)?)),
        "bye" => Ok(Request::Bye(typed("bye", fields)?)),
        "act" => parse_act(fields).map(Request::Act),
        "perturb" => Ok(Request::Perturb(typed("perturb", fields)?)),
        _ => Err(Refusal::new(
            Code::UnknownOp,
            format!(
                "no op `{}`; there are hello, reset, step, act, perturb, stop, time, bye",
                shortened(&op)
            ),
        )),
    }
}

fn parse_reset(fields: Map<String, Value>) -> Result<Reset, Refusal> {
    let reset: Reset = typed("reset", fields)?;
    if reset.seed.is_some_and(|seed| seed > MAX_SAFE_INTEGER) {
        return Err(Refusal::new(Code::BadRequest, "seed: expected a whole number from 0 to 2^53 - 1"));
    }
    if let Some(name) = reset.options.keys().next() {
        let message = format!("options.{}: no options are defined in this version", shortened(name));
        return Err(Refusal::new(Code::BadRequest, message));
    }
    Ok(reset)
}

fn parse_step(fields: Map<String, Value>) -> Result<Step, Refusal> {
    let raw: RawStep = typed("step", fields)?;
    Ok(Step { tick: raw.tick, action: some_action(raw.action)?, repeat: raw.repeat })
}

fn parse_act(fields: Map<String, Value>) -> Result<Act, Refusal> {
    let raw: RawAct = typed("act", fields)?;
    Ok(Act { action: some_action(raw.action)? })
}

fn some_action(action: Option<Value>) -> Result<Action, Refusal> {
    match action {
        Some(action) => parse_action(action),
        None => Err(Refusal::new(Code::BadRequest, "action: missing; {} keeps the last targets")),
    }
}

fn typed<T: DeserializeOwned>(op: &str, fields: Map<String, Value>) -> Result<T, Refusal> {
    serde_path_to_error::deserialize(Value::Object(fields)).map_err(|error| {
        let path = error.path().to_string();
        let why = error.into_inner();
        // At the top level the path is ".", and serde names the field itself.
        let message = if path == "." { format!("{op}: {why}") } else { format!("{path}: {why}") };
        Refusal::new(Code::BadRequest, message)
    })
}

/// What a JSON value is, for messages.
pub(crate) fn kind_of(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "a boolean",
        Value::Number(_) => "a number",
        Value::String(_) => "a string",
        Value::Array(_) => "an array",
        Value::Object(_) => "an object",
    }
}

#[cfg(test)]
mod tests;
