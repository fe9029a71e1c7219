//! The requests of the watch socket.

use super::sample::Overlays;
use palmares_protocol::text::shortened;
use palmares_protocol::{Code, MAX_SAFE_INTEGER, Refusal};
use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

/// A request without its envelope (`op`, `id`).
#[derive(Debug, PartialEq)]
pub(super) enum Request {
    /// Selects the runs to show.
    Subscribe(Target, Option<Overlays>),
    /// Lists the open runs.
    List,
    /// Ends the connection.
    Bye,
}

/// The runs to show.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Target {
    /// The runs of a session, one after the other.
    Session(String),
    /// One run.
    Run(String),
    /// The most interesting run: official runs before practice, then runs with an event in the last 10 s, then the one that
    /// moved last.
    Featured,
    /// No run: only rankings and announcements.
    Leaderboard,
}

/// `subscribe`: the runs to show. Exactly one of `session_id`, `run_id`, `featured`, `leaderboard` is set. A second `subscribe`
/// replaces the first.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Subscribe {
    /// The runs of a session, one after the other.
    session_id: Option<String>,
    /// One run.
    run_id: Option<String>,
    /// `true`: the most interesting run: official runs before practice, then runs with an event in the last 10 s, then the one
    /// that moved last. When it ends, the next one is chosen.
    featured: Option<bool>,
    /// `true`: no run, only the ranking and announcements.
    leaderboard: Option<bool>,
    /// Data to send in addition to the poses. With this field, empty or not, `clock` is sent once a second.
    overlays: Option<Vec<Overlay>>,
}

/// Data that can be sent in addition to the poses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum Overlay {
    /// Motors, tendons, joints, and the predicted equilibrium of the hand.
    Telemetry,
    /// Contacts.
    Contacts,
    /// Reason why objects count or do not.
    Verdicts,
}

/// `list`: lists the open runs.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct List {}

/// `bye`: ends the connection.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct WatchBye {}

impl Subscribe {
    fn overlays(&self) -> Option<Overlays> {
        let named = self.overlays.as_ref()?;
        let wants = |overlay| named.contains(&overlay);
        Some(Overlays {
            telemetry: wants(Overlay::Telemetry),
            contacts: wants(Overlay::Contacts),
            verdicts: wants(Overlay::Verdicts),
        })
    }

    fn target(self) -> Result<Target, Refusal> {
        match (self.session_id, self.run_id, self.featured, self.leaderboard) {
            (Some(id), None, None, None) => Ok(Target::Session(id)),
            (None, Some(id), None, None) => Ok(Target::Run(id)),
            (None, None, Some(true), None) => Ok(Target::Featured),
            (None, None, None, Some(true)) => Ok(Target::Leaderboard),
            _ => {
                let message = "subscribe: expected exactly one of \"session_id\": …, \"run_id\": …, \"featured\": true, \
                               \"leaderboard\": true";
                Err(Refusal::new(Code::BadRequest, message))
            }
        }
    }
}

/// Reads one text frame: the request's id, if valid, and the request or its refusal.
pub(super) fn parse(text: &str) -> (Option<u64>, Result<Request, Refusal>) {
    let mut fields = match serde_json::from_str::<Value>(text) {
        Ok(Value::Object(fields)) => fields,
        Ok(_) => {
            let message = "a message is a JSON object with `op` and `id`";
            return (None, Err(Refusal::new(Code::BadRequest, message)));
        }
        Err(error) => return (None, Err(Refusal::new(Code::BadJson, format!("not JSON: {error}")))),
    };
    let id = fields.remove("id").and_then(|id| id.as_u64()).filter(|&id| id <= MAX_SAFE_INTEGER);
    if id.is_none() {
        let message = "id: every request carries a whole number from 0 to 2^53 - 1";
        return (None, Err(Refusal::new(Code::BadRequest, message)));
    }
    (id, parse_op(fields))
}

fn parse_op(mut fields: Map<String, Value>) -> Result<Request, Refusal> {
    let Some(Value::String(op)) = fields.remove("op") else {
        return Err(Refusal::new(Code::BadRequest, "op: expected a string: subscribe, list or bye"));
    };
    match op.as_str() {
        "subscribe" => {
            let subscribe = typed::<Subscribe>("subscribe", fields)?;
            let overlays = subscribe.overlays();
            Ok(Request::Subscribe(subscribe.target()?, overlays))
        }
        "list" => typed::<List>("list", fields).map(|_| Request::List),
        "bye" => typed::<WatchBye>("bye", fields).map(|_| Request::Bye),
        _ => {
            let message =
                format!("no op `{}` on this socket; there are subscribe, list, bye", shortened(&op));
            Err(Refusal::new(Code::UnknownOp, message))
        }
    }
}

fn typed<T: DeserializeOwned>(op: &str, fields: Map<String, Value>) -> Result<T, Refusal> {
    serde_path_to_error::deserialize(Value::Object(fields)).map_err(|error| {
        let path = error.path().to_string();
        let why = error.into_inner();
        let message = if path == "." { format!("{op}: {why}") } else { format!("{path}: {why}") };
        Refusal::new(Code::BadRequest, message)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_target_is_watched() {
        let run = parse(r#"{"op":"subscribe","id":3,"run_id":"run_1"}"#);
        assert_eq!(run, (Some(3), Ok(Request::Subscribe(Target::Run("run_1".into()), None))));
        let featured = parse(r#"{"op":"subscribe","id":4,"featured":true}"#);
        assert_eq!(featured, (Some(4), Ok(Request::Subscribe(Target::Featured, None))));
        let leaderboard = parse(r#"{"op":"subscribe","id":4,"leaderboard":true}"#);
        assert_eq!(leaderboard, (Some(4), Ok(Request::Subscribe(Target::Leaderboard, None))));
        let with = parse(r#"{"op":"subscribe","id":4,"featured":true,"overlays":["verdicts","telemetry"]}"#);
        let overlays = Overlays { contacts: false, ..Overlays::ALL };
        assert_eq!(with, (Some(4), Ok(Request::Subscribe(Target::Featured, Some(overlays)))));
        for wrong in [
            r#"{"op":"subscribe","id":3}"#,
            r#"{"op":"subscribe","id":3,"featured":false}"#,
            r#"{"op":"subscribe","id":3,"run_id":"a","session_id":"b"}"#,
            r#"{"op":"subscribe","id":3,"featured":true,"leaderboard":true}"#,
            r#"{"op":"subscribe","id":3,"run":"a"}"#,
            r#"{"op":"subscribe","id":3,"run_id":7}"#,
            r#"{"op":"subscribe","id":3,"featured":true,"overlays":["seeds"]}"#,
            r#"{"op":"list","id":3,"all":true}"#,
            r#"{"op":7,"id":3}"#,
        ] {
            let (id, request) = parse(wrong);
            assert_eq!(
                (id, request.map_err(|refusal| refusal.code)),
                (Some(3), Err(Code::BadRequest)),
                "{wrong}"
            );
        }
        assert_eq!(parse(r#"{"op":"step","id":3}"#).1.map_err(|refusal| refusal.code), Err(Code::UnknownOp));
        assert_eq!(parse("{").1.map_err(|refusal| refusal.code), Err(Code::BadJson));
    }
}
