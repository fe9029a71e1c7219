//! `palmares schema`.

use crate::server;
use clap::ValueEnum;
use serde_json::{Map, Value};
use std::io::Write;

/// A schema.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum What {
    /// The messages of the control socket, as JSON Schema
    Control,
    /// The messages of the watch socket, as JSON Schema
    Watch,
    /// The HTTP addresses, as OpenAPI 3.1
    Openapi,
}

/// Prints a schema.
pub(crate) fn schema(what: What) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{}", serde_json::to_string_pretty(&sorted(server::schema(what)?))?)?;
    Ok(())
}

/// Sorts fields by name, independent of the features of serde_json.
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
