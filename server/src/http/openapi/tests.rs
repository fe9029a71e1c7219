use super::operation::Operation;
use crate::http::{document, operations};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Number of calls of `.route(` in each file below a folder.
fn routes(folder: &Path, found: &mut Vec<(PathBuf, usize)>) {
    for entry in std::fs::read_dir(folder).expect("the sources") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            routes(&path, found);
        } else if !path.ends_with("openapi/tests.rs") {
            let source = std::fs::read_to_string(&path).expect("a source file");
            // A test module at the end of a file may serve routes of its own.
            let program = source.split("#[cfg(test)]").next().unwrap_or_default();
            let calls = program.matches(".route(").count();
            if calls > 0 {
                found.push((path, calls));
            }
        }
    }
}

#[test]
fn every_route_is_in_the_document_and_nothing_else() {
    let mut there = Vec::new();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    routes(&folder, &mut there);
    assert_eq!(there, [(folder.join("http/openapi/routes.rs"), 1)], "routes that the document does not know");
    let document = document();
    let described = document["paths"].as_object().expect("paths");
    let described: usize = described.values().map(|item| item.as_object().expect("methods").len()).sum();
    assert_eq!(described, operations().len());
    assert!(described > 10, "{described}");
}

/// Every `$ref` in a value.
fn references(value: &Value, found: &mut BTreeSet<String>) {
    match value {
        Value::Object(fields) => {
            for (name, inner) in fields {
                match inner {
                    Value::String(text) if name == "$ref" => {
                        found.insert(text.clone());
                    }
                    inner => references(inner, found),
                }
            }
        }
        Value::Array(items) => items.iter().for_each(|item| references(item, found)),
        _ => {}
    }
}

#[test]
fn the_document_refers_only_to_what_it_has() {
    let document = document();
    let mut found = BTreeSet::new();
    references(&document, &mut found);
    assert!(found.contains("#/components/schemas/Problem"), "{found:?}");
    for reference in found {
        let pointer = reference.strip_prefix('#').expect("within the document");
        assert!(document.pointer(pointer).is_some(), "{reference}");
    }
}

#[test]
fn every_operation_has_a_name_of_its_own() {
    let ids: Vec<String> = operations().iter().map(Operation::id).collect();
    let distinct: BTreeSet<&String> = ids.iter().collect();
    assert_eq!(distinct.len(), ids.len(), "{ids:?}");
}

/// A schema, or the schema to which it refers.
fn resolved<'a>(document: &'a Value, schema: &'a Value) -> &'a Value {
    match schema["$ref"].as_str().and_then(|reference| reference.strip_prefix('#')) {
        Some(pointer) => document.pointer(pointer).expect("within the document"),
        None => schema,
    }
}

#[test]
fn every_object_that_organizers_send_or_get_has_its_fields() {
    let document = document();
    let paths = document["paths"].as_object().expect("paths");
    let mut looked_at = 0;
    for (path, item) in paths.iter().filter(|(path, _)| path.starts_with("/v1/admin/")) {
        for operation in item.as_object().expect("methods").values() {
            let bodies = [&operation["requestBody"], &operation["responses"]["200"]];
            for body in bodies.map(|body| &body["content"]["application/json"]["schema"]) {
                let schema = resolved(&document, body);
                if schema["type"] == "object" {
                    let fields = schema["properties"].as_object().map_or(0, serde_json::Map::len);
                    assert!(fields > 0, "{path}: {schema}");
                    looked_at += 1;
                }
            }
        }
    }
    assert!(looked_at > 15, "{looked_at}");
}

#[test]
fn the_verbs_in_the_document_are_those_that_are_known() {
    // Every handler lists its verbs when it refuses another one: its source has them all.
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/http/admin");
    for operation in operations().iter().filter(|operation| !operation.words.is_empty()) {
        let noun = operation.path.split('/').nth(3).expect("a noun");
        let file = match noun {
            "export" | "competition" | "schedule" => format!("{noun}.rs"),
            noun => format!("{noun}s.rs"),
        };
        let text = std::fs::read_to_string(folder.join(&file)).expect("a source file");
        let list = operation.words.join(", ");
        assert!(text.contains(&list), "{file} does not list {list}");
    }
}
