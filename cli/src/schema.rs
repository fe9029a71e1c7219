//! `palmares schema`.

use crate::server::{self, Description};
use serde_json::{Map, Value};
use std::io::Write;

/// Prints a schema.
pub(crate) fn schema(description: Description) -> anyhow::Result<()> {
    std::io::stdout().lock().write_all(text(description)?.as_bytes())?;
    Ok(())
}

fn text(description: Description) -> anyhow::Result<String> {
    Ok(serde_json::to_string_pretty(&sorted(server::schema(description)?))? + "\n")
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

#[cfg(all(test, feature = "server"))]
mod tests {
    use super::*;
    use clap::ValueEnum;
    use std::path::Path;

    #[test]
    fn docs_schema_describes_the_types_of_this_source() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/schema");
        for what in Description::value_variants() {
            let name = what.to_possible_value().expect("no variant is hidden").get_name().to_owned();
            let committed = std::fs::read_to_string(folder.join(format!("{name}.json"))).unwrap_or_default();
            let current = text(*what).expect("a description");
            let line = committed.lines().zip(current.lines()).take_while(|(a, b)| a == b).count() + 1;
            let stale = format!("docs/schema/{name}.json:{line} is out of date: run `cargo xtask generate`");
            assert!(committed == current, "{stale}");
        }
    }
}
