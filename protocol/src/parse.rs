//! Reads requests.
//!
//! `step` and `act`, which come hundreds of times a second, are read directly from the bytes. If that fails, and for
//! all other requests, the bytes become a tree of values, and the same types are read from the tree: it knows the
//! path of a wrong value, so that the error can name it.

use crate::action::ActionFields;
use crate::code::{Code, Refusal};
use crate::encoding::Encoding;
use crate::request::{Act, Request, Reset, Step, one};
use crate::text::shortened;
use palmares_tasks::Action;
use serde::Deserialize;
use serde::de::value::{BorrowedStrDeserializer, MapAccessDeserializer};
use serde::de::{DeserializeOwned, DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, Visitor};
use serde_json::{Map, Value};
use std::fmt;
use std::io::ErrorKind;

/// Largest whole number that every JSON reader holds exactly: 2⁵³ − 1.
pub const MAX_SAFE_INTEGER: u64 = (1 << 53) - 1;

/// The result of reading a message.
pub struct Parsed {
    /// The id of the request, if it is valid.
    pub id: Option<u64>,
    /// The request, or why it is refused.
    pub request: Result<Request, Refusal>,
}

/// The fields of `step`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StepFields {
    tick: u64,
    action: ActionFields,
    #[serde(default = "one")]
    repeat: u32,
    #[serde(default)]
    cameras: Vec<String>,
}

/// The fields of `act`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ActFields {
    action: ActionFields,
    #[serde(default)]
    cameras: Vec<String>,
}

impl Encoding {
    /// Reads a text frame.
    pub fn read_text(self, text: &str) -> Parsed {
        match self {
            Encoding::Json => parse_json(text),
            Encoding::MsgPack => self.refuse_frame("binary"),
        }
    }

    /// Reads a binary frame.
    pub fn read_binary(self, bytes: &[u8]) -> Parsed {
        match self {
            Encoding::Json => self.refuse_frame("text"),
            Encoding::MsgPack => parse_msgpack(bytes),
        }
    }

    fn refuse_frame(self, kind: &str) -> Parsed {
        let message = format!("{} has {kind} frames only", self.subprotocol());
        Parsed { id: None, request: Err(Refusal::new(Code::BadJson, message)) }
    }
}

/// Reads a request in JSON.
fn parse_json(text: &str) -> Parsed {
    if let Some((id, request)) = json(text) {
        return Parsed { id: Some(id), request: Ok(request) };
    }
    match serde_json::from_str(text) {
        Ok(value) => of_tree(value),
        Err(error) => unreadable(format!("not JSON: {error}")),
    }
}

/// Reads a request in MessagePack.
fn parse_msgpack(bytes: &[u8]) -> Parsed {
    if let Some((id, request)) = msgpack(bytes) {
        return Parsed { id: Some(id), request: Ok(request) };
    }
    match value_of_msgpack(bytes) {
        Ok(value) => of_tree(value),
        Err(why) => unreadable(format!("not MessagePack: {why}")),
    }
}

/// The fields that every request has.
#[derive(Deserialize)]
struct Envelope<'a> {
    op: &'a str,
    id: u64,
}

/// Reads a `step` or `act` directly from JSON, with its id.
fn json(text: &str) -> Option<(u64, Request)> {
    let envelope: Envelope<'_> = serde_json::from_str(text).ok()?;
    let mut reader = serde_json::Deserializer::from_str(text);
    let request = envelope.deserialize(&mut reader).ok()?;
    reader.end().ok()?;
    Some(request)
}

/// Reads a `step` or `act` directly from MessagePack, with its id.
fn msgpack(bytes: &[u8]) -> Option<(u64, Request)> {
    let envelope: Envelope<'_> = rmp_serde::from_slice(bytes).ok()?;
    let mut reader = rmp_serde::Deserializer::from_read_ref(bytes);
    let request = envelope.deserialize(&mut reader).ok()?;
    match IgnoredAny::deserialize(&mut reader) {
        // The message ends here.
        Err(rmp_serde::decode::Error::InvalidMarkerRead(end)) if end.kind() == ErrorKind::UnexpectedEof => {
            Some(request)
        }
        _ => None,
    }
}

/// Reads the message a second time, when its `op` is known.
impl<'de> DeserializeSeed<'de> for Envelope<'_> {
    type Value = (u64, Request);

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for Envelope<'_> {
    type Value = (u64, Request);

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a step or an act")
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
        let fields = MapAccessDeserializer::new(WithoutEnvelope(map));
        let request = match self.op {
            "step" => {
                let StepFields { tick, action: ActionFields(action), repeat, cameras } =
                    Deserialize::deserialize(fields)?;
                Request::Step(Step { tick, action, repeat, cameras })
            }
            "act" => {
                let ActFields { action: ActionFields(action), cameras } = Deserialize::deserialize(fields)?;
                Request::Act(Act { action, cameras })
            }
            _ => return Err(A::Error::custom("another op")),
        };
        if self.id > MAX_SAFE_INTEGER {
            return Err(A::Error::custom("id"));
        }
        Ok((self.id, request))
    }
}

/// The fields of a message without `op` and `id`.
struct WithoutEnvelope<A>(A);

impl<'de, A: MapAccess<'de>> MapAccess<'de> for WithoutEnvelope<A> {
    type Error = A::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, A::Error> {
        loop {
            match self.0.next_key()? {
                Some("op" | "id") => self.0.next_value::<IgnoredAny>().map(drop)?,
                Some(name) => return seed.deserialize(BorrowedStrDeserializer::new(name)).map(Some),
                None => return Ok(None),
            }
        }
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, A::Error> {
        self.0.next_value_seed(seed)
    }
}

fn unreadable(message: String) -> Parsed {
    Parsed { id: None, request: Err(Refusal::new(Code::BadJson, message)) }
}

/// MessagePack as a JSON value. Numbers that JSON lacks become null, which is refused.
fn value_of_msgpack(bytes: &[u8]) -> Result<Value, String> {
    let mut reader = rmp_serde::Deserializer::new(std::io::Cursor::new(bytes));
    // The depth limit of the JSON reader.
    reader.set_max_depth(128);
    let value = Value::deserialize(&mut reader).map_err(|error| error.to_string())?;
    if reader.position() != bytes.len() as u64 {
        return Err("there are bytes after the message".into());
    }
    Ok(value)
}

/// Reads a request from a tree of values.
fn of_tree(value: Value) -> Parsed {
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

fn parse_step(mut fields: Map<String, Value>) -> Result<Step, Refusal> {
    let action = take_action(&mut fields);
    let StepFields { tick, repeat, cameras, .. } = typed("step", fields)?;
    Ok(Step { tick, action: parse_action(action)?, repeat, cameras })
}

fn parse_act(mut fields: Map<String, Value>) -> Result<Act, Refusal> {
    let action = take_action(&mut fields);
    let ActFields { cameras, .. } = typed("act", fields)?;
    Ok(Act { action: parse_action(action)?, cameras })
}

/// Takes the action and leaves an empty one: it is read after the other fields, and its errors have a code of their
/// own.
fn take_action(fields: &mut Map<String, Value>) -> Option<Value> {
    fields.insert("action".into(), Map::new().into()).filter(|action| !action.is_null())
}

fn parse_action(action: Option<Value>) -> Result<Action, Refusal> {
    let Some(action) = action else {
        return Err(Refusal::new(Code::BadRequest, "action: missing; {} keeps the last targets"));
    };
    match located(action) {
        Ok(ActionFields(action)) => Ok(action),
        Err((None, why)) => Err(Refusal::new(Code::BadAction, format!("action: {why}"))),
        Err((Some(path), why)) => Err(Refusal::new(Code::BadAction, format!("action.{path}: {why}"))),
    }
}

fn typed<T: DeserializeOwned>(op: &str, fields: Map<String, Value>) -> Result<T, Refusal> {
    located(Value::Object(fields)).map_err(|(path, why)| {
        // At the top level serde names the field itself.
        Refusal::new(Code::BadRequest, format!("{}: {why}", path.as_deref().unwrap_or(op)))
    })
}

/// Reads a tree; an error has a path, unless the root is wrong, and a message.
fn located<T: DeserializeOwned>(tree: Value) -> Result<T, (Option<String>, String)> {
    serde_path_to_error::deserialize(tree).map_err(|error| {
        let path = Some(error.path().to_string()).filter(|path| path != ".");
        (path, error.into_inner().to_string())
    })
}

/// The kind of a JSON value, for error messages.
fn kind_of(value: &Value) -> &'static str {
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
