//! Descriptions of everything that clients send and receive: JSON Schema of the messages, OpenAPI of the addresses.

use crate::http;
use crate::watch::messages::WatchReply;
use crate::watch::request::{List, Subscribe, WatchBye};
use palmares_protocol::reply::Reply;
use palmares_protocol::request::{Act, Bye, Hello, Perturb, Reset, Step, Stop, Time};
use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, schema_for};
use serde_json::{Map, Value, json};

/// A message that clients send.
fn sent<T: JsonSchema>() -> Value {
    schema_for!(T).to_value()
}

/// The messages that clients receive: each by its `op`, and all of them as one union that `op` discriminates.
fn received<T: JsonSchema>() -> (Value, Value) {
    let union = SchemaSettings::draft2020_12().for_serialize().into_generator().into_root_schema_for::<T>();
    let union = union.to_value();
    let definitions = &union["$defs"];
    let each = union["oneOf"].as_array().into_iter().flatten().filter_map(|variant| {
        let op = variant["properties"]["op"]["const"].as_str()?;
        let name = variant["$ref"].as_str()?.strip_prefix("#/$defs/")?;
        let mut message = definitions[name].clone();
        message["title"] = name.into();
        message["$schema"] = union["$schema"].clone();
        let used = used(&message, definitions);
        if !used.is_empty() {
            message["$defs"] = used.into();
        }
        Some((op.to_owned(), message))
    });
    (each.collect::<Map<_, _>>().into(), union)
}

/// The definitions that a schema refers to, and those that these refer to.
fn used(schema: &Value, definitions: &Value) -> Map<String, Value> {
    let (mut found, mut open) = (Map::new(), vec![schema]);
    while let Some(value) = open.pop() {
        match value {
            Value::Object(fields) => open.extend(fields.values()),
            Value::Array(items) => open.extend(items),
            Value::String(text) => {
                if let Some(name) = text.strip_prefix("#/$defs/")
                    && !found.contains_key(name)
                {
                    found.insert(name.to_owned(), definitions[name].clone());
                    open.push(&definitions[name]);
                }
            }
            _ => {}
        }
    }
    found
}

/// The HTTP addresses.
pub fn openapi() -> Value {
    http::document()
}

/// The watch socket's messages, in the form of [`control`].
pub fn watch() -> Value {
    let requests = json!({
        "subscribe": sent::<Subscribe>(),
        "list": sent::<List>(),
        "bye": sent::<WatchBye>(),
    });
    let (replies, reply) = received::<WatchReply>();
    json!({"requests": requests, "replies": replies, "reply": reply})
}

/// The control socket's messages: requests without their `op` and `id`, replies each by its `op` and as a union.
pub fn control() -> Value {
    let requests = json!({
        "hello": sent::<Hello>(),
        "reset": sent::<Reset>(),
        "step": sent::<Step>(),
        "act": sent::<Act>(),
        "perturb": sent::<Perturb>(),
        "stop": sent::<Stop>(),
        "time": sent::<Time>(),
        "bye": sent::<Bye>(),
    });
    let (replies, reply) = received::<Reply>();
    json!({"requests": requests, "replies": replies, "reply": reply})
}
