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
    std::io::stdout().lock().write_all(text(what)?.as_bytes())?;
    Ok(())
}

fn text(what: What) -> anyhow::Result<String> {
    Ok(serde_json::to_string_pretty(&sorted(server::schema(what)?))? + "\n")
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

#[cfg(all(test, feature = "server"))]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn docs_schema_describes_the_types_of_this_source() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/schema");
        for what in What::value_variants() {
            let name = what.to_possible_value().expect("no variant is hidden").get_name().to_owned();
            let committed = std::fs::read_to_string(folder.join(format!("{name}.json"))).unwrap_or_default();
            let current = text(*what).expect("a description");
            let line = committed.lines().zip(current.lines()).take_while(|(a, b)| a == b).count() + 1;
            let stale = format!("docs/schema/{name}.json:{line} is out of date: run `cargo xtask generate`");
            assert!(committed == current, "{stale}");
        }
    }
}
