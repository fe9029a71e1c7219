//! `palmares schema`.

use crate::protocol::reply::{Ack, ErrorReply, Obs, Reply, RunResult, TimeReport, Warning, Welcome};
use crate::protocol::request::{Act, Bye, Hello, Perturb, Reset, Step, Stop, Time};
use schemars::{JsonSchema, schema_for};
use serde_json::{Value, json};
use std::io::Write;

fn fields<T: JsonSchema>() -> Value {
    schema_for!(T).to_value()
}

/// Prints the JSON Schema of every message: requests without their `op` and `id`, replies each and as the
/// union told apart by `op`.
pub(super) fn schema() -> anyhow::Result<()> {
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
    let all = json!({"requests": requests, "replies": replies, "reply": fields::<Reply>()});
    let mut out = std::io::stdout().lock();
    writeln!(out, "{}", serde_json::to_string_pretty(&all)?)?;
    Ok(())
}
