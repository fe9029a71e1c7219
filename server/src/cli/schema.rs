//! `palmares schema`.

use crate::http;
use crate::protocol::obs::Obs;
use crate::protocol::reply::{Ack, ErrorReply, Reply, RunResult, TimeReport, Warning, Welcome};
use crate::protocol::request::{Act, Bye, Hello, Perturb, Reset, Step, Stop, Time};
use crate::watch::messages as watch;
use crate::watch::request as asked;
use clap::ValueEnum;
use schemars::{JsonSchema, schema_for};
use serde_json::{Map, Value, json};
use std::io::Write;

/// Which description.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum What {
    /// The messages of the control socket, as JSON Schema
    Control,
    /// The messages of the watch socket, as JSON Schema
    Watch,
    /// The HTTP addresses, as OpenAPI 3.1
    Openapi,
}

fn fields<T: JsonSchema>() -> Value {
    schema_for!(T).to_value()
}

/// Prints a description.
pub(super) fn schema(what: What) -> anyhow::Result<()> {
    let all = match what {
        What::Control => control(),
        What::Watch => spectators(),
        What::Openapi => http::document(),
    };
    let mut out = std::io::stdout().lock();
    writeln!(out, "{}", serde_json::to_string_pretty(&sorted(all))?)?;
    Ok(())
}

/// With fields in the order of their names, however serde_json was built.
fn sorted(value: Value) -> Value {
    match value {
        Value::Object(fields) => {
            let mut fields: Vec<(String, Value)> = fields.into_iter().collect();
            fields.sort_by(|a, b| a.0.cmp(&b.0));
            let fields = fields.into_iter().map(|(name, inner)| (name, sorted(inner)));
            Value::Object(fields.collect::<Map<String, Value>>())
        }
        Value::Array(items) => items.into_iter().map(sorted).collect(),
        value => value,
    }
}

/// The watch socket's messages, in the same form.
fn spectators() -> Value {
    let requests = json!({
        "subscribe": fields::<asked::Subscribe>(),
        "list": fields::<asked::List>(),
        "bye": fields::<asked::WatchBye>(),
    });
    let replies = json!({
        "subscribed": fields::<watch::Subscribed>(),
        "runs": fields::<watch::Runs>(),
        "scene": fields::<watch::WatchScene>(),
        "poses": fields::<watch::Poses>(),
        "score": fields::<watch::Score>(),
        "events": fields::<watch::Events>(),
        "ended": fields::<watch::Ended>(),
        "leaderboard": fields::<watch::Ranking>(),
        "error": fields::<ErrorReply>(),
    });
    json!({"requests": requests, "replies": replies, "reply": fields::<watch::WatchReply>()})
}

/// The control socket's messages: requests without their `op` and `id`, replies each and as the union told apart by
/// `op`.
fn control() -> Value {
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
