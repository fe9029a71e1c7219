//! The messages of the control socket as the Python package has them: msgspec structs, whose tables are NumPy arrays.

use super::schema::{Field, Type, Types};
use anyhow::Result;
use serde_json::Value;
use std::collections::BTreeSet;

const HEAD: &str = r#""""Messages of protocol v1 as typed structs, derived from docs/schema: `cargo xtask generate` writes them.

Units are SI unless a field says otherwise; vectors are in the world frame, quaternions are x, y, z, w. Fields
that this client does not know are ignored, so that it works with a newer server. The structs are exempt from
cyclic garbage collection (``gc=False``): they form no cycles, and thousands of them come every second.
Methods of a struct are in a subclass of the same name, in `palmares.messages` and what that imports.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, Literal

import msgspec

from palmares.arrays import Array, Quat, Table, Vec3, array
from palmares.views import Brief


class Request(Brief, msgspec.Struct, kw_only=True, omit_defaults=True, gc=False, tag_field="op"):
    """A message to the server; the connection fills in its `id`."""

    id: int = 0


class Reply(Brief, msgspec.Struct, kw_only=True, gc=False, tag_field="op"):
    """A message from the server; `op` is its kind."""

    reply_to: int | None = msgspec.field(name="id", default=None)
    """`id` of the request it answers; ``None`` for a message that answers none"""
"#;

/// Types whose name in Python differs from the schema's. A request is called after its `op`.
const NAMES: [(&str, &str); 11] = [
    ("ActuatorObservation", "Actuator"),
    ("Contacts", "ContactTables"),
    ("ErrorReply", "ErrorMessage"),
    ("Field", "FieldSpec"),
    ("HandObservation", "HandState"),
    ("Objects", "ObjectTables"),
    ("Obs", "Observation"),
    ("ReplayInfo", "Replay"),
    ("RunResult", "Result"),
    ("TimeReport", "Time"),
    ("Warning", "SessionWarning"),
];
/// Types that have subclasses with methods, which are written by hand. A list of them is a `Sequence` here,
/// so that a list of the subclass is valid.
const SUBCLASSED: [&str; 12] = [
    "BodyState",
    "CameraImage",
    "FieldSpec",
    "HandState",
    "Observation",
    "Region",
    "Result",
    "Scene",
    "SceneBody",
    "ScenePart",
    "Specs",
    "Truth",
];
/// Fields that a method of the same name replaces.
const HIDDEN: [(&str, &str); 4] =
    [("Observation", "cameras"), ("Observation", "truth"), ("Truth", "objects"), ("Truth", "contacts")];
/// Types whose arrays are made when they are first read, and kept.
const CACHED: [&str; 3] = ["CameraImage", "Joints", "Truth"];
/// Types of HTTP bodies that the package reads.
const BODIES: [&str; 1] = ["LeaderboardRow"];
/// Longest line.
const WIDTH: usize = 110;
/// More words than this are not listed with a field.
const FEW: usize = 8;

/// The text of the file.
pub(super) fn module(types: &Types) -> Result<String> {
    let mut module = Module { types, written: BTreeSet::new(), text: HEAD.to_owned() };
    for (op, name) in &types.requests {
        module.class(name, Some((op, "Request")), true)?;
    }
    for (op, name) in &types.replies {
        module.class(name, Some((op, "Reply")), false)?;
    }
    for name in BODIES {
        module.class(name, None, false)?;
    }
    Ok(module.text)
}

struct Module<'a> {
    types: &'a Types,
    /// Names of the schema.
    written: BTreeSet<String>,
    text: String,
}

fn found(table: &[(&str, &'static str)], name: &str) -> Option<&'static str> {
    table.iter().find(|(key, _)| *key == name).map(|(_, value)| *value)
}

impl Module<'_> {
    /// Writes a class, and before it those that it uses. `message`: its `op` and base class. `sent`: by the client.
    fn class(&mut self, schema: &str, message: Option<(&str, &str)>, sent: bool) -> Result<()> {
        let Some(fields) = self.object(schema)? else { return Ok(()) };
        if !self.written.insert(schema.to_owned()) {
            return Ok(());
        }
        let fields: Vec<Field> =
            fields.into_iter().filter(|field| message.is_none() || field.name != "id").collect();
        for name in fields.iter().flat_map(|field| named(&field.value)) {
            self.class(name, None, sent)?;
        }
        let name = match message {
            Some((_, "Request")) => format!("{schema}Request"),
            _ => found(&NAMES, schema).unwrap_or(schema).to_owned(),
        };
        let base = message.map_or("Brief, msgspec.Struct", |(_, base)| base);
        let mut arguments = vec![base.to_owned(), "kw_only=True".into()];
        if sent && message.is_none() {
            arguments.push("omit_defaults=True".into());
        }
        let cached = CACHED.contains(&name.as_str());
        arguments.push(if cached { "dict=True".into() } else { "gc=False".into() });
        arguments.extend(message.map(|(op, _)| format!("tag=\"{op}\"")));
        let mut text = format!("\n\nclass {name}({}):\n", arguments.join(", "));
        text += &summary(&self.types.get(schema)?.doc);
        let mut properties = String::new();
        for (k, field) in fields.iter().enumerate() {
            let hidden = HIDDEN.contains(&(&name, &field.name));
            let raw = matches!(bare(&field.value), Type::Table(_) | Type::Bytes);
            let annotation = self.annotation(&field.value, sent)?;
            let default = default(field, sent);
            text += if k == 0 { "\n" } else { "" };
            if !hidden && !raw {
                let default = default.map(|value| format!(" = {value}")).unwrap_or_default();
                text += &format!("    {}: {annotation}{default}\n", field.name);
                text += &described(&self.doc_of(field)?);
                continue;
            }
            let default = match default.as_deref() {
                Some("[]") => ", default_factory=list".into(),
                Some(value) => format!(", default={value}"),
                None => String::new(),
            };
            text += &format!("    _{0}: {annotation} = msgspec.field(name=\"{0}\"{default})\n", field.name);
            if let Type::Table(columns) = field.value {
                let (shape, reshaped) = match columns {
                    Some(columns) => (format!("(n, {columns})"), format!(", -1, {columns}")),
                    None => ("(n,)".into(), String::new()),
                };
                let doc = format!("Shape {shape}; {}", sentence(&self.doc_of(field)?));
                properties += &format!(
                    "\n    @{}\n    def {1}(self) -> Array:\n{2}        return array(self._{1}{reshaped})\n",
                    if cached { "cached_property" } else { "property" },
                    field.name,
                    docstring(&doc, 8)
                );
            }
        }
        self.text += &(text + &properties);
        Ok(())
    }

    /// The fields of a type that is a class in Python. A union of objects has the fields of all; it depends
    /// on the variant which of them exist.
    fn object(&self, name: &str) -> Result<Option<Vec<Field>>> {
        let variants = match &self.types.get(name)?.value {
            Type::Object(fields) => return Ok(Some(fields.clone())),
            Type::Union(variants) => variants,
            _ => return Ok(None),
        };
        let objects = variants.iter().map(|variant| match variant {
            Type::Object(fields) => Some(fields),
            _ => None,
        });
        let Some(objects) = objects.collect::<Option<Vec<_>>>() else { return Ok(None) };
        let mut fields: Vec<Field> = Vec::new();
        for field in objects.iter().copied().flatten() {
            let everywhere = objects.iter().all(|fields| fields.iter().any(|other| other.name == field.name));
            match fields.iter_mut().find(|known| known.name == field.name) {
                // The word that names the variant.
                Some(Field { value: Type::Union(words), .. }) => words.push(field.value.clone()),
                Some(known) if field.doc.len() > known.doc.len() => known.doc.clone_from(&field.doc),
                Some(_) => {}
                None => {
                    let value = match &field.value {
                        word @ Type::Word(_) => Type::Union(vec![word.clone()]),
                        value if everywhere || field.default.is_some() => value.clone(),
                        value => Type::Nullable(Box::new(value.clone())),
                    };
                    fields.push(Field { required: everywhere, value, ..field.clone() });
                }
            }
        }
        fields.sort_by_key(|field| !field.required);
        Ok(Some(fields))
    }

    fn annotation(&self, value: &Type, sent: bool) -> Result<String> {
        Ok(match value {
            Type::Any => "Any".into(),
            Type::Text => "str".into(),
            Type::Integer => "int".into(),
            Type::Number => "float".into(),
            Type::Boolean => "bool".into(),
            Type::Bytes => "bytes".into(),
            Type::Table(_) => "Table".into(),
            Type::List(item) => {
                let item = self.annotation(item, sent)?;
                let list = if SUBCLASSED.contains(&item.as_str()) { "Sequence" } else { "list" };
                format!("{list}[{item}]")
            }
            Type::Array(item, 3) if **item == Type::Number => "Vec3".into(),
            Type::Array(item, 4) if **item == Type::Number => "Quat".into(),
            Type::Array(item, length) => {
                let item = self.annotation(item, sent)?;
                format!("tuple[{}]", (0..*length).map(|_| item.as_str()).collect::<Vec<_>>().join(", "))
            }
            Type::Map(value) => format!("dict[str, {}]", self.annotation(value, sent)?),
            Type::Nullable(value) => format!("{} | None", self.annotation(value, sent)?),
            Type::Extended(..) | Type::Object(_) => "dict[str, Any]".into(),
            Type::Word(_) | Type::Union(_) => match (words(value), value) {
                // A later server may have words that this client does not know.
                (Some(_), _) if !sent => "str".into(),
                (Some(words), _) => {
                    let words = words.iter().map(|word| format!("\"{word}\""));
                    format!("Literal[{}]", words.collect::<Vec<_>>().join(", "))
                }
                (None, Type::Union(variants)) => {
                    let variants = variants.iter().map(|variant| self.annotation(variant, sent));
                    variants.collect::<Result<Vec<_>>>()?.join(" | ")
                }
                (None, _) => "str".into(),
            },
            Type::Named(name) if self.object(name)?.is_some() => {
                found(&NAMES, name).unwrap_or(name).to_owned()
            }
            Type::Named(name) => self.annotation(&self.types.get(name)?.value, sent)?,
        })
    }

    /// A field's description in Python's terms, with its possible words.
    fn doc_of(&self, field: &Field) -> Result<String> {
        let absent = match &field.value {
            Type::Nullable(_) => "``None``",
            Type::List(_) | Type::Table(_) => "empty",
            _ => "absent",
        };
        let doc = field.doc.replace('`', "``");
        let doc = doc.replace(" null", " ``None``").replace(" absent", &format!(" {absent}"));
        let value = match bare(&field.value) {
            Type::Named(name) => &self.types.get(name)?.value,
            value => value,
        };
        let Some(words) = words(value).filter(|words| words.len() <= FEW) else { return Ok(doc) };
        let words: Vec<String> = words.iter().map(|word| format!("``{word}``")).collect();
        let last = words.last().map(String::as_str).unwrap_or_default();
        let words = match &words[..words.len() - 1] {
            [] => last.to_owned(),
            others => format!("{} or {last}", others.join(", ")),
        };
        let known = words.split(' ').all(|word| doc.contains(word.trim_end_matches(',')));
        Ok(if known { doc } else { format!("{} {words}.", sentence(&doc)).trim_start().to_owned() })
    }
}

/// Names of the declared types in a type.
fn named(value: &Type) -> Vec<&str> {
    match value {
        Type::Named(name) => vec![name],
        Type::List(inner) | Type::Array(inner, _) | Type::Map(inner) | Type::Nullable(inner) => named(inner),
        Type::Union(variants) => variants.iter().flat_map(named).collect(),
        _ => Vec::new(),
    }
}

fn bare(value: &Type) -> &Type {
    if let Type::Nullable(inner) = value { inner } else { value }
}

/// The words of a type that is one of some words.
fn words(value: &Type) -> Option<Vec<&str>> {
    match value {
        Type::Word(word) => Some(vec![word]),
        Type::Union(variants) => {
            let words = variants.iter().map(|variant| match variant {
                Type::Word(word) => Some(word.as_str()),
                _ => None,
            });
            words.collect()
        }
        _ => None,
    }
}

/// The default of a field that may be left out. A client always sends the words that decide how the server
/// acts; a server may be of an earlier version, without a field that has a default.
fn default(Field { required, default, value, .. }: &Field, sent: bool) -> Option<String> {
    match (value, default) {
        (Type::Nullable(_), _) => Some("None".into()),
        (_, Some(Value::Number(number))) if !(sent && *required) => Some(number.to_string()),
        (_, Some(Value::String(word))) if !sent => Some(format!("\"{word}\"")),
        (_, Some(Value::Bool(value))) if !sent => Some(if *value { "True" } else { "False" }.into()),
        (Type::List(_) | Type::Table(_), default) if !required || default.is_some() => Some("[]".into()),
        (Type::Map(_), _) if !required => Some("{}".into()),
        (Type::Boolean, _) if !required => Some("False".into()),
        (Type::Text, _) if !required => Some("\"\"".into()),
        _ => None,
    }
}

fn sentence(text: &str) -> String {
    let mut text = text.to_owned();
    if !text.is_empty() && !text.ends_with('.') {
        text.push('.');
    }
    text
}

/// A class's docstring: the first sentence, and the others as a paragraph.
fn summary(doc: &str) -> String {
    docstring(&sentence(&doc.replace('`', "``")), 4)
}

/// A docstring of one line, or of a line and a paragraph.
fn docstring(doc: &str, indent: usize) -> String {
    let margin = " ".repeat(indent);
    let fits = |text: &str, quotes: usize| indent + text.chars().count() + quotes <= WIDTH;
    if fits(doc, 6) {
        return format!("{margin}\"\"\"{doc}\"\"\"\n");
    }
    let ends =
        doc.match_indices(['.', ';', ':']).filter(|(at, mark)| doc[at + mark.len()..].starts_with(' '));
    let mut ends = ends.map(|(at, _)| doc.split_at(at)).filter(|(first, _)| fits(first, 4));
    let (first, rest) = ends.next_back().unwrap_or((doc, ""));
    let rest = wrapped(rest.get(2..).unwrap_or_default(), WIDTH - indent);
    let rest = rest.iter().map(|line| format!("{margin}{line}\n")).collect::<String>();
    format!("{margin}\"\"\"{}\n\n{rest}{margin}\"\"\"\n", sentence(first))
}

/// A docstring below a field.
fn described(doc: &str) -> String {
    if doc.is_empty() {
        return String::new();
    }
    let lines = wrapped(&format!("\"\"\"{doc}\"\"\""), WIDTH - 4);
    lines.iter().map(|line| format!("    {line}\n")).collect()
}

fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}
