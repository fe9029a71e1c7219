//! The description of an address and a method.

use palmares_net::transport::problem::ProblemBody;
use schemars::generate::SchemaGenerator;
use schemars::{JsonSchema, Schema};
use serde_json::{Value, json};

pub(in crate::http) const TEXT: Content = Content::Other("text/plain");
pub(in crate::http) const CSV: Content = Content::Other("text/csv");
pub(in crate::http) const ZIP: Content = Content::Other("application/zip");

/// The content of a body.
#[derive(Clone, Copy)]
pub(in crate::http) enum Content {
    /// JSON of a type.
    Json(fn(&mut SchemaGenerator) -> Schema),
    /// Something else, by its media type.
    Other(&'static str),
    /// A WebSocket.
    Socket,
}

/// The token that an address requires.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(in crate::http) enum Token {
    /// None.
    None,
    /// Optional; a token shows more, or is required in a competition.
    Optional,
    /// An organizer's.
    Organizer,
}

/// An address and a method.
pub(in crate::http) struct Operation {
    pub(super) method: &'static str,
    pub(super) path: &'static str,
    summary: &'static str,
    /// Values of the variable part of the path, if they are fixed.
    pub(super) words: &'static [&'static str],
    /// Name and meaning of the query's fields, all optional.
    query: Vec<(&'static str, &'static str)>,
    pub(super) token: Token,
    body: Option<Content>,
    status: &'static str,
    answer: Content,
}

/// A type as JSON.
pub(in crate::http) fn of<T: JsonSchema>() -> Content {
    Content::Json(|generator| generator.subschema_for::<T>())
}

pub(in crate::http) fn get(path: &'static str, summary: &'static str, answer: Content) -> Operation {
    let status = if matches!(answer, Content::Socket) { "101" } else { "200" };
    let (query, token, body) = (Vec::new(), Token::None, None);
    Operation { method: "get", path, summary, words: &[], query, token, body, status, answer }
}

pub(in crate::http) fn post(
    path: &'static str,
    summary: &'static str,
    body: Content,
    answer: Content,
) -> Operation {
    Operation { method: "post", body: Some(body), ..get(path, summary, answer) }
}

/// A GET whose response is JSON of a type.
pub(in crate::http) fn get_json<A: JsonSchema>(path: &'static str, summary: &'static str) -> Operation {
    get(path, summary, of::<A>())
}

/// A POST of JSON whose response is JSON.
pub(in crate::http) fn post_json<B: JsonSchema, A: JsonSchema>(
    path: &'static str,
    summary: &'static str,
) -> Operation {
    post(path, summary, of::<B>(), of::<A>())
}

impl Operation {
    pub(in crate::http) fn words(mut self, words: &'static [&'static str]) -> Self {
        self.words = words;
        self
    }

    pub(in crate::http) fn query(mut self, name: &'static str, meaning: &'static str) -> Self {
        self.query.push((name, meaning));
        self
    }

    pub(in crate::http) fn token(mut self, token: Token) -> Self {
        self.token = token;
        self
    }

    pub(in crate::http) fn created(mut self) -> Self {
        self.status = "201";
        self
    }

    /// `get_v1_runs_id`
    pub(super) fn id(&self) -> String {
        let words = self.path.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
        std::iter::once(self.method).chain(words).collect::<Vec<_>>().join("_")
    }

    pub(super) fn describe(&self, sent: &mut SchemaGenerator, answered: &mut SchemaGenerator) -> Value {
        let in_path = self.path.split('{').skip(1).filter_map(|rest| rest.split('}').next());
        let in_path = in_path.map(|name| name.trim_start_matches('*'));
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
        let problem = answered.subschema_for::<ProblemBody<'static>>();
        let mut operation = json!({
            "operationId": self.id(),
            "summary": self.summary,
            "responses": {
                self.status: response(self.answer, answered),
                "default": {
                    "description": "The problem, and what would be valid.",
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
