//! The types of the pages, in TypeScript.

use super::schema::{Field, Type, Types};
use anyhow::{Context, Result};
use serde_json::Value;

const HEAD: &str = "\
/**
 * Types of all messages and HTTP bodies, derived from docs/schema: `cargo xtask generate` writes them. SI units unless a field
 * says otherwise; vectors are in the world frame, quaternions are x, y, z, w.
 */
";

/// The text of the file.
pub(super) fn module(types: &Types) -> String {
    let mut text = HEAD.to_owned();
    for (name, declared) in &types.declared {
        text += &format!("\n{}", comment("", &declared.doc));
        text += &match &declared.value {
            Type::Object(fields) if !fields.is_empty() => {
                let lines =
                    fields.iter().map(|field| comment("  ", &field.doc) + "  " + &member(field) + ";\n");
                format!("export interface {name} {{\n{}}}\n", lines.collect::<String>())
            }
            Type::Union(variants) if variants.iter().any(|variant| !matches!(variant, Type::Word(_))) => {
                let lines = variants.iter().map(|variant| format!("\n  | {}", printed(variant)));
                format!("export type {name} ={};\n", lines.collect::<String>())
            }
            other => format!("export type {name} = {};\n", printed(other)),
        };
    }
    text
}

fn comment(indent: &str, doc: &str) -> String {
    if doc.is_empty() { String::new() } else { format!("{indent}/** {doc} */\n") }
}

/// A field that can be absent is never null.
fn member(Field { name, required, value, .. }: &Field) -> String {
    match value {
        _ if *required => format!("{name}: {}", printed(value)),
        Type::Nullable(value) => format!("{name}?: {}", printed(value)),
        value => format!("{name}?: {}", printed(value)),
    }
}

fn object(fields: &[Field]) -> String {
    format!("{{ {} }}", fields.iter().map(member).collect::<Vec<_>>().join("; "))
}

fn printed(value: &Type) -> String {
    let list =
        |item: &str| if item.contains(['|', '&']) { format!("({item})[]") } else { format!("{item}[]") };
    match value {
        Type::Any => "unknown".into(),
        Type::Text | Type::Bytes => "string".into(),
        Type::Integer | Type::Number => "number".into(),
        Type::Boolean => "boolean".into(),
        Type::Word(word) => format!("'{word}'"),
        Type::Table(None) => "number[]".into(),
        Type::Table(Some(columns)) => list(&tuple("number", *columns)),
        Type::List(item) => list(&printed(item)),
        Type::Array(item, length) => tuple(&printed(item), *length),
        Type::Map(value) => format!("Record<string, {}>", printed(value)),
        Type::Nullable(value) => format!("{} | null", printed(value)),
        Type::Union(variants) => variants.iter().map(printed).collect::<Vec<_>>().join(" | "),
        Type::Extended(name, fields) => format!("({} & {name})", object(fields)),
        Type::Object(fields) if fields.is_empty() => "Record<string, never>".into(),
        Type::Object(fields) => object(fields),
        Type::Named(name) => name.clone(),
    }
}

fn tuple(item: &str, length: u64) -> String {
    format!("[{}]", (0..length).map(|_| item).collect::<Vec<_>>().join(", "))
}

/// The text of a file with the fields of the telemetry in a replay. The time is that of the record, and left out.
pub(super) fn protobuf(replay: &Value) -> Result<String> {
    let fields = replay["protobuf"]["palmares.Telemetry"].as_array().context("no palmares.Telemetry")?;
    let (mut members, mut table) = (String::new(), String::new());
    for field in fields.iter().filter(|field| field["name"] != "timestamp") {
        let name = field["name"].as_str().context("a name")?;
        let kind = field["type"].as_str().context("a type")?;
        let repeated = field["repeated"] == true;
        members += &format!("  {name}: {};\n", if repeated { "number[]" } else { "number" });
        table +=
            &format!("  {}: {{ name: '{name}', type: '{kind}', repeated: {repeated} }},\n", field["number"]);
    }
    Ok(format!(
        "/** `palmares.Telemetry`, derived from docs/schema: `cargo xtask generate` writes it. */\n\
         export interface TelemetryRecord {{\n{members}}}\n\n\
         /** Its fields by number. */\n\
         export const TELEMETRY_FIELDS = {{\n{table}}} as const;\n"
    ))
}
