//! `GET /openapi.json`: the addresses as an OpenAPI 3.1 document, with the schemas of the types that are sent.
//!
//! A new address is one entry in [`operations`]; a test holds the list against the routes.

mod operations;

use super::problem::Body;
use axum::http::header::CONTENT_TYPE;
use axum::response::IntoResponse;
use operations::operations;
use schemars::generate::{SchemaGenerator, SchemaSettings};
use schemars::{JsonSchema, Schema};
use serde_json::{Map, Value, json};
use std::sync::LazyLock;

/// What is sent or answered.
#[derive(Clone, Copy)]
enum Content {
    /// JSON of a type.
    Json(fn(&mut SchemaGenerator) -> Schema),
    /// Something else, by its media type.
    Other(&'static str),
    /// A WebSocket.
    Socket,
}

/// Who may ask.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Token {
    /// Anybody.
    None,
    /// Anybody; a token shows more, or is needed in a competition.
    Optional,
    /// Whoever has a token.
    Required,
    /// Organizers.
    Organizer,
}

/// An address and a method.
struct Operation {
    method: &'static str,
    path: &'static str,
    summary: &'static str,
    /// What the last part of the path may be, where the program knows it.
    words: &'static [&'static str],
    /// Name and meaning of what may stand in the query, all optional.
    query: Vec<(&'static str, &'static str)>,
    token: Token,
    body: Option<Content>,
    status: &'static str,
    answer: Content,
}

/// A type as JSON.
fn of<T: JsonSchema>() -> Content {
    Content::Json(|generator| generator.subschema_for::<T>())
}

fn get(path: &'static str, summary: &'static str, answer: Content) -> Operation {
    let status = if matches!(answer, Content::Socket) { "101" } else { "200" };
    let (query, token, body) = (Vec::new(), Token::None, None);
    Operation { method: "get", path, summary, words: &[], query, token, body, status, answer }
}

fn post(path: &'static str, summary: &'static str, body: Content, answer: Content) -> Operation {
    Operation { method: "post", body: Some(body), ..get(path, summary, answer) }
}

impl Operation {
    fn words(mut self, words: &'static [&'static str]) -> Self {
        self.words = words;
        self
    }

    fn query(mut self, name: &'static str, meaning: &'static str) -> Self {
        self.query.push((name, meaning));
        self
    }

    fn token(mut self, token: Token) -> Self {
        self.token = token;
        self
    }

    fn created(mut self) -> Self {
        self.status = "201";
        self
    }

    /// `get_v1_runs_id`
    fn id(&self) -> String {
        let words = self.path.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
        std::iter::once(self.method).chain(words).collect::<Vec<_>>().join("_")
    }

    fn describe(&self, sent: &mut SchemaGenerator, answered: &mut SchemaGenerator) -> Value {
        let in_path = self.path.split('{').skip(1).filter_map(|rest| rest.split('}').next());
        let text = json!({"type": "string"});
        let word =
            if self.words.is_empty() { text.clone() } else { json!({"type": "string", "enum": self.words}) };
        let in_path =
            in_path.map(|name| json!({"name": name, "in": "path", "required": true, "schema": word}));
        let in_query = self.query.iter();
        let in_query = in_query.map(
            |(name, meaning)| json!({"name": name, "in": "query", "description": meaning, "schema": text}),
        );
        let parameters: Vec<Value> = in_path.chain(in_query).collect();
        let problem = answered.subschema_for::<Body<'static>>();
        let mut operation = json!({
            "operationId": self.id(),
            "summary": self.summary,
            "responses": {
                self.status: response(self.answer, answered),
                "default": {
                    "description": "What is wrong and what would be right.",
                    "content": {"application/problem+json": {"schema": problem}},
                },
            },
        });
        if !parameters.is_empty() {
            operation["parameters"] = parameters.into();
        }
        if let Some(body) = self.body {
            operation["requestBody"] = json!({"required": true, "content": content(body, sent)});
        }
        match self.token {
            Token::None => {}
            Token::Optional => operation["security"] = json!([{}, {"token": []}]),
            Token::Required => operation["security"] = json!([{"token": []}]),
            Token::Organizer => {
                operation["security"] = json!([{"token": []}]);
                operation["description"] = "For organizers.".into();
            }
        }
        operation
    }
}

fn content(content: Content, generator: &mut SchemaGenerator) -> Value {
    match content {
        Content::Json(schema) => json!({"application/json": {"schema": schema(generator)}}),
        Content::Other(media) => json!({media: {}}),
        Content::Socket => json!({}),
    }
}

fn response(answer: Content, generator: &mut SchemaGenerator) -> Value {
    match answer {
        Content::Socket => json!({
            "description": "A WebSocket with the subprotocol palmares.v1.json. Its messages: docs/protocol.md and \
                            `palmares schema`.",
        }),
        _ => json!({"description": "As asked.", "content": content(answer, generator)}),
    }
}

/// The whole document.
pub(crate) fn document() -> Value {
    let settings = || {
        SchemaSettings::draft2020_12().with(|settings| {
            settings.definitions_path = "/components/schemas".into();
            settings.meta_schema = None;
        })
    };
    let mut sent = settings().for_deserialize().into_generator();
    let mut answered = settings().for_serialize().into_generator();
    let mut paths: Map<String, Value> = Map::new();
    for operation in operations() {
        let item = paths.entry(operation.path).or_insert_with(|| json!({}));
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
            "description": "A competition server for compliant underactuated robot hands. What is a stream goes over \
                            the two WebSockets; this is the rest.",
            "license": {"name": "MIT OR Apache-2.0", "identifier": "MIT OR Apache-2.0"},
        },
        "paths": paths,
        "components": {
            "schemas": schemas,
            "securitySchemes": {"token": {"type": "http", "scheme": "bearer"}},
        },
    })
}

/// `GET /openapi.json`.
pub(super) async fn openapi() -> impl IntoResponse {
    static TEXT: LazyLock<String> = LazyLock::new(|| document().to_string());
    ([(CONTENT_TYPE, "application/json")], TEXT.as_str())
}

#[cfg(test)]
mod tests;
