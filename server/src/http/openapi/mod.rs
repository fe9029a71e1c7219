//! The addresses as an OpenAPI 3.1 document, with the schemas of requests and responses.
//!
//! A new address is one entry of [`routes`](super::routes): its description and its handler.

pub(super) mod operation;
pub(super) mod routes;

use operation::Operation;
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value, json};

/// The document of these operations.
pub(super) fn document(operations: &[Operation]) -> Value {
    let settings = || {
        SchemaSettings::draft2020_12().with(|settings| {
            settings.definitions_path = "/components/schemas".into();
            settings.meta_schema = None;
        })
    };
    let mut sent = settings().for_deserialize().into_generator();
    let mut answered = settings().for_serialize().into_generator();
    let mut paths: Map<String, Value> = Map::new();
    for operation in operations {
        // The router writes `{*path}` for a variable part with slashes, OpenAPI `{path}`.
        let path = operation.path.replace("{*", "{");
        let item = paths.entry(path).or_insert_with(|| json!({}));
        item[operation.method] = operation.describe(&mut sent, &mut answered);
    }
    let mut schemas = answered.take_definitions(true);
    for (name, schema) in sent.take_definitions(true) {
        schemas.entry(name).or_insert(schema);
    }
    json!({
        "openapi": "3.1.0",
        "info": {
            "title": "Palmares",
            "version": env!("CARGO_PKG_VERSION"),
            "description": "A competition server for compliant underactuated robot hands. Control and watching \
                            use two WebSockets; this document describes the rest.",
            "license": {"name": "MIT OR Apache-2.0", "identifier": "MIT OR Apache-2.0"},
        },
        "paths": paths,
        "components": {
            "schemas": schemas,
            "securitySchemes": {"token": {"type": "http", "scheme": "bearer"}},
        },
    })
}

#[cfg(test)]
mod tests;
