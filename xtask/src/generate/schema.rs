//! The types that docs/schema describes, without what JSON Schema says beyond a programming language's types.

use anyhow::{Context, Result, bail, ensure};
use serde_json::{Map, Value};
use std::collections::BTreeMap;

/// A type.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Type {
    /// Any JSON value.
    Any,
    Text,
    Integer,
    Number,
    Boolean,
    /// A text that has one value.
    Word(String),
    /// Base64 in JSON, bytes in MessagePack.
    Bytes,
    /// A list of numbers, or of rows of this many numbers, that is a byte string in MessagePack.
    Table(Option<u64>),
    List(Box<Type>),
    /// A list of fixed length.
    Array(Box<Type>, u64),
    Map(Box<Type>),
    Nullable(Box<Type>),
    Union(Vec<Type>),
    /// The fields of another type and some more.
    Extended(String, Vec<Field>),
    Object(Vec<Field>),
    /// A declared type.
    Named(String),
}

/// A field of an object.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Field {
    pub(super) name: String,
    pub(super) doc: String,
    /// False for a field that can be absent.
    pub(super) required: bool,
    pub(super) default: Option<Value>,
    pub(super) value: Type,
}

/// A type with a name.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Declared {
    pub(super) doc: String,
    pub(super) value: Type,
}

/// Everything that docs/schema describes.
pub(super) struct Types {
    pub(super) declared: BTreeMap<String, Declared>,
    /// `op` and type of the messages of the control socket.
    pub(super) requests: Vec<(String, String)>,
    pub(super) replies: Vec<(String, String)>,
}

impl Types {
    /// Reads the documents. Two types of one name must be the same.
    pub(super) fn of(control: &Value, watch: &Value, openapi: &Value, replay: &Value) -> Result<Types> {
        let mut declared = BTreeMap::new();
        let mut add = |name: &str, schema: &Value, requested: bool| -> Result<()> {
            let read = Declared { doc: doc(schema), value: read(schema).with_context(|| name.to_owned())? };
            // Some fields may be left out of a request that every reply has; replies decide.
            if declared.get(name).is_some_and(|known| known != &read) {
                ensure!(requested, "docs/schema has two types of the name {name}");
                return Ok(());
            }
            declared.insert(name.to_owned(), read);
            Ok(())
        };
        let mut messages = [Vec::new(), Vec::new()];
        for (document, socket) in [(control, "Control"), (watch, "Watch")] {
            for (kind, found) in ["replies", "requests"].into_iter().zip(&mut messages) {
                let all = document[kind].as_object().with_context(|| kind.to_owned())?;
                for (op, schema) in all {
                    // `bye` of both sockets, and `error` of both, have one name.
                    let name = schema["title"].as_str().context("a message without a title")?;
                    for (inner, schema) in schema["$defs"].as_object().into_iter().flatten() {
                        add(inner, schema, kind == "requests")?;
                    }
                    add(name, schema, kind == "requests")?;
                    if socket == "Control" {
                        found.push((op.clone(), name.to_owned()));
                    }
                }
            }
            add(&format!("{socket}Reply"), &document["reply"], false)?;
        }
        for all in [&openapi["components"]["schemas"], &replay["$defs"]] {
            for (name, schema) in all.as_object().context("definitions")? {
                add(name, schema, false)?;
            }
        }
        let [replies, requests] = messages;
        Ok(Types { declared, requests, replies })
    }

    /// The declared type behind a name.
    pub(super) fn get(&self, name: &str) -> Result<&Declared> {
        self.declared.get(name).with_context(|| format!("docs/schema has no type {name}"))
    }
}

/// The description on one line.
fn doc(schema: &Value) -> String {
    schema["description"].as_str().unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ")
}

fn read(schema: &Value) -> Result<Type> {
    let text = |key: &str| schema[key].as_str();
    if let Some(reference) = text("$ref") {
        let name = reference.rsplit('/').next().unwrap_or_default().to_owned();
        let more = fields(schema)?;
        return Ok(if more.is_empty() { Type::Named(name) } else { Type::Extended(name, more) });
    }
    if let Some(word) = text("const") {
        return Ok(Type::Word(word.to_owned()));
    }
    if let Some(words) = schema["enum"].as_array() {
        let words = words.iter().filter_map(Value::as_str);
        return Ok(Type::Union(words.map(|word| Type::Word(word.to_owned())).collect()));
    }
    if let Some(variants) = schema["anyOf"].as_array().or(schema["oneOf"].as_array()) {
        let (null, others): (Vec<_>, Vec<_>) = variants.iter().partition(|variant| variant["type"] == "null");
        let shared = fields(schema)?;
        let mut others = others.into_iter().map(read).collect::<Result<Vec<Type>>>()?;
        for other in &mut others {
            match other {
                Type::Object(own) => own.splice(..0, shared.iter().cloned()).for_each(drop),
                _ => ensure!(shared.is_empty(), "fields beside a variant that is no object"),
            }
        }
        let value = if others.len() == 1 { others.remove(0) } else { Type::Union(others) };
        return Ok(if null.is_empty() { value } else { Type::Nullable(Box::new(value)) });
    }
    if let Some(kinds) = schema["type"].as_array() {
        let mut other = schema.clone();
        let kind = kinds.iter().find(|kind| *kind != "null").context("a type that is always null")?;
        other["type"] = kind.clone();
        return Ok(Type::Nullable(Box::new(read(&other)?)));
    }
    Ok(match text("type") {
        None => Type::Any,
        Some("string") if text("contentEncoding") == Some("base64") => Type::Bytes,
        Some("string") => Type::Text,
        Some("integer") => Type::Integer,
        Some("number") => Type::Number,
        Some("boolean") => Type::Boolean,
        Some("array") if text("x-msgpack").is_some() => Type::Table(schema["items"]["maxItems"].as_u64()),
        Some("array") => {
            let item = Box::new(read(&schema["items"])?);
            match schema["maxItems"].as_u64() {
                Some(length) if schema["minItems"] == length => Type::Array(item, length),
                _ => Type::List(item),
            }
        }
        Some("object") if schema["additionalProperties"].is_object() => {
            Type::Map(Box::new(read(&schema["additionalProperties"])?))
        }
        Some("object") if schema["additionalProperties"] == true => Type::Map(Box::new(Type::Any)),
        Some("object") => Type::Object(fields(schema)?),
        Some(other) => bail!("a schema of the type {other}"),
    })
}

/// The fields of an object: the required ones, which are in the order of the Rust type, first.
fn fields(schema: &Value) -> Result<Vec<Field>> {
    let none = Map::new();
    let properties = schema["properties"].as_object().unwrap_or(&none);
    let required: Vec<&str> =
        schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    let optional = properties.keys().map(String::as_str).filter(|name| !required.contains(name));
    let names = required.iter().copied().chain(optional);
    let field = |name: &str| -> Result<Field> {
        let property = properties.get(name).with_context(|| format!("no property {name}"))?;
        Ok(Field {
            name: name.to_owned(),
            doc: doc(property),
            required: required.contains(&name),
            default: property.get("default").cloned(),
            value: read(property).with_context(|| name.to_owned())?,
        })
    };
    names.map(field).collect()
}
