//! `palmares schema`.

use crate::server::{self, Description};
use serde_json::{Map, Value};
use std::io::Write;

/// Prints a description.
pub(crate) fn schema(description: Description) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{}", serde_json::to_string_pretty(&sorted(server::schema(description)?))?)?;
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
