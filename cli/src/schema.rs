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
    let mut text = String::new();
    write(&sorted(server::schema(description)?), 0, &mut text)?;
    Ok(text + "\n")
}

/// Levels that have lines of their own. Below them a part of a message has one line.
const LEVELS: usize = 4;

/// Writes a value as JSON, in few lines whose changes still say which part of which message they are.
fn write(value: &Value, level: usize, text: &mut String) -> serde_json::Result<()> {
    let parts: Vec<(String, &Value)> = match value {
        Value::Object(fields) => {
            fields.iter().map(|(name, inner)| (format!("{}: ", Value::from(name.as_str())), inner)).collect()
        }
        Value::Array(items) => items.iter().map(|inner| (String::new(), inner)).collect(),
        _ => Vec::new(),
    };
    if level == LEVELS || parts.is_empty() {
        text.push_str(&serde_json::to_string(value)?);
        return Ok(());
    }
    let (open, close) = if value.is_object() { ('{', '}') } else { ('[', ']') };
    text.push(open);
    for (k, (name, inner)) in parts.iter().enumerate() {
        text.push_str(if k == 0 { "\n" } else { ",\n" });
        text.push_str(&"  ".repeat(level + 1));
        text.push_str(name);
        write(inner, level + 1, text)?;
    }
    text.push('\n');
    text.push_str(&"  ".repeat(level));
    text.push(close);
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

#[cfg(all(test, feature = "server"))]
mod tests {
    use super::*;
    use clap::ValueEnum;
    use std::path::Path;

    #[test]
    fn what_is_written_is_the_same_value() {
        let value = serde_json::json!({"a": [1, {"b": [], "c": {"d": {"e": {"f": "\u{e9}\"\n"}}}}], "g": {}, "h": null});
        let mut text = String::new();
        write(&value, 0, &mut text).expect("it is written");
        assert_eq!(serde_json::from_str::<Value>(&text).expect("JSON"), value);
        assert_eq!(text.lines().count(), 13, "{text}");
    }

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
