//! What clients may send and are sent: JSON Schema of the messages, OpenAPI of the addresses.

use crate::http;
use crate::watch::messages as told;
use crate::watch::request as asked;
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

/// The watch socket's messages, in the same form.
pub fn watch() -> Value {
    let requests = json!({
        "subscribe": fields::<asked::Subscribe>(),
        "list": fields::<asked::List>(),
        "bye": fields::<asked::WatchBye>(),
    });
    let replies = json!({
        "subscribed": fields::<told::Subscribed>(),
        "runs": fields::<told::Runs>(),
        "scene": fields::<told::WatchScene>(),
        "poses": fields::<told::Poses>(),
        "score": fields::<told::Score>(),
        "events": fields::<told::Events>(),
        "ended": fields::<told::Ended>(),
        "clock": fields::<told::Clock>(),
        "verdicts": fields::<told::Verdicts>(),
        "leaderboard": fields::<told::Ranking>(),
        "error": fields::<ErrorReply>(),
    });
    json!({"requests": requests, "replies": replies, "reply": fields::<told::WatchReply>()})
}

/// The control socket's messages: requests without their `op` and `id`, replies each and as the union told apart by
/// `op`.
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
