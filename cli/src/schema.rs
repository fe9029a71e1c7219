//! `palmares schema`.

use clap::ValueEnum;
use palmares_server::schema;
use serde_json::{Map, Value};
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
    /// The channels of hands, as a table in Markdown
    Channels,
    /// The images of cameras, as a table in Markdown
    Images,
}

/// Prints a description.
pub(crate) fn schema(what: What) -> anyhow::Result<()> {
    let json = |all| serde_json::to_string_pretty(&sorted(all));
    let text = match what {
        What::Control => json(schema::control())?,
        What::Watch => json(schema::watch())?,
        What::Openapi => json(schema::openapi())?,
        What::Channels => palmares_senses::document(),
        What::Images => palmares_senses::image_document(),
    };
    let mut out = std::io::stdout().lock();
    writeln!(out, "{}", text.trim_end())?;
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
