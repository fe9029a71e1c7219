//! Descriptions for clients: JSON Schema of the messages, OpenAPI of the HTTP addresses.

use crate::http;
use crate::watch::{messages, request};
use palmares_protocol::obs::Obs;
use palmares_protocol::reply::{Ack, ErrorReply, Reply, RunResult, TimeReport, Warning, Welcome};
use palmares_protocol::request::{Act, Bye, Hello, Perturb, Reset, Step, Stop, Time};
use schemars::{JsonSchema, schema_for};
use serde_json::{Value, json};

fn fields<T: JsonSchema>() -> Value {
    schema_for!(T).to_value()
}

/// The HTTP addresses.
pub fn openapi() -> Value {
    http::document()
}

/// The watch socket's messages, in the form of [`control`].
pub fn watch() -> Value {
    let requests = json!({
        "subscribe": fields::<request::Subscribe>(),
        "list": fields::<request::List>(),
        "bye": fields::<request::WatchBye>(),
    });
    let replies = json!({
        "subscribed": fields::<messages::Subscribed>(),
        "runs": fields::<messages::Runs>(),
        "scene": fields::<messages::WatchScene>(),
        "poses": fields::<messages::Poses>(),
        "score": fields::<messages::Score>(),
        "events": fields::<messages::Events>(),
        "ended": fields::<messages::Ended>(),
        "clock": fields::<messages::Clock>(),
        "verdicts": fields::<messages::Verdicts>(),
        "leaderboard": fields::<messages::Ranking>(),
        "error": fields::<ErrorReply>(),
    });
    json!({"requests": requests, "replies": replies, "reply": fields::<messages::WatchReply>()})
}

/// The control socket's messages: requests without their `op` and `id`; each reply, and the union of all by `op`.
pub fn control() -> Value {
    let requests = json!({
        "hello": fields::<Hello>(),
        "reset": fields::<Reset>(),
        "step": fields::<Step>(),
        "act": fields::<Act>(),
        "perturb": fields::<Perturb>(),
        "stop": fields::<Stop>(),
        "time": fields::<Time>(),
        "bye": fields::<Bye>(),
    });
    let replies = json!({
        "welcome": fields::<Welcome>(),
        "obs": fields::<Obs>(),
        "ack": fields::<Ack>(),
        "result": fields::<RunResult>(),
        "time": fields::<TimeReport>(),
        "error": fields::<ErrorReply>(),
        "warning": fields::<Warning>(),
    });
    json!({"requests": requests, "replies": replies, "reply": fields::<Reply>()})
}
