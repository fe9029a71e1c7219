//! JSON Schemas of the channels.

use crate::descriptors::Described;
use crate::format::{ACTION, EVENT, HASH, SCENE};
use crate::foxglove::SceneUpdate;
use crate::frames::FrameTransforms;
use crate::messages::{ActionMessage, HashMessage};
use crate::telemetry::TelemetryMessage;
use palmares_tasks::Event;
use prost_types::DescriptorProto;
use prost_types::field_descriptor_proto::Label;
use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value, json};

/// Keywords of the schemas in a file.
const KEYWORDS: [&str; 7] = ["title", "description", "type", "properties", "items", "minimum", "maximum"];

/// The JSON messages of a replay by topic, and the fields of its protobuf messages.
pub fn document() -> Value {
    let mut generator = SchemaSettings::draft2020_12().for_serialize().into_generator();
    let messages = json!({
        ACTION: generator.subschema_for::<ActionMessage>(),
        EVENT: generator.subschema_for::<Event>(),
        HASH: generator.subschema_for::<HashMessage>(),
        SCENE: generator.subschema_for::<SceneUpdate>(),
    });
    let mut files = Vec::new();
    FrameTransforms::describe(&mut files);
    TelemetryMessage::describe(&mut files);
    let protobuf = files.iter().flat_map(|file| {
        file.message_type
            .iter()
            .map(|message| (format!("{}.{}", file.package(), message.name()), fields(message)))
    });
    json!({
        "messages": messages,
        "$defs": generator.take_definitions(true),
        "protobuf": protobuf.collect::<Map<_, _>>(),
    })
}

/// Number, name and type of each field.
fn fields(message: &DescriptorProto) -> Value {
    let fields = message.field.iter().map(|field| {
        let scalar = field.r#type().as_str_name().trim_start_matches("TYPE_").to_lowercase();
        let kind = field.type_name.as_deref().map_or(scalar, |name| name.trim_start_matches('.').to_owned());
        let repeated = field.label() == Label::Repeated;
        json!({"number": field.number(), "name": field.name(), "type": kind, "repeated": repeated})
    });
    fields.collect()
}

/// The schema of a channel as the file has it: in the simple form that Foxglove reads, without references and unions.
pub(crate) fn channel<T: JsonSchema>(title: &str) -> Value {
    let settings = SchemaSettings::draft2020_12().for_serialize();
    let settings = settings.with(|settings| settings.inline_subschemas = true);
    let mut schema = simple(settings.into_generator().into_root_schema_for::<T>().to_value());
    schema["title"] = title.into();
    schema
}

fn simple(schema: Value) -> Value {
    let Value::Object(mut fields) = schema else { return schema };
    // A union has the properties of all variants, and a field that can be null can be absent instead.
    for key in ["anyOf", "oneOf"] {
        let Some(Value::Array(variants)) = fields.remove(key) else { continue };
        for (key, value) in variants.into_iter().map(simple).filter_map(object).flatten() {
            match (fields.get_mut(&key), value) {
                (Some(Value::Object(known)), Value::Object(more)) => known.extend(more),
                (Some(_), _) => {}
                (None, value) => drop(fields.insert(key, value)),
            }
        }
    }
    fields.retain(|key, _| KEYWORDS.contains(&key.as_str()));
    for (key, value) in &mut fields {
        *value = match (key.as_str(), value.take()) {
            ("type", Value::Array(kinds)) => {
                kinds.into_iter().find(|kind| kind != "null").unwrap_or_default()
            }
            ("properties", Value::Object(properties)) => {
                properties.into_iter().map(|(name, schema)| (name, simple(schema))).collect()
            }
            ("items", items) => simple(items),
            (_, value) => value,
        };
    }
    fields.into()
}

fn object(value: Value) -> Option<Map<String, Value>> {
    if let Value::Object(fields) = value { Some(fields) } else { None }
}
