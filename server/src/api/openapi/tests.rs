use super::*;
use std::collections::BTreeSet;
use std::path::Path;

/// The routes as the program's text has them: every `.route("path", get(…).post(…))`.
fn routes(folder: &Path, found: &mut BTreeSet<(String, String)>) {
    for entry in std::fs::read_dir(folder).expect("the sources") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            if !path.ends_with("openapi") {
                routes(&path, found);
            }
            continue;
        }
        let text = std::fs::read_to_string(&path).expect("a source file");
        for rest in text.split(".route(").skip(1) {
            let Some(rest) = rest.trim_start().strip_prefix('"') else { continue };
            let (address, rest) = rest.split_once('"').expect("an address");
            let mut depth = 1;
            let call = rest.split_inclusive(|c| {
                depth += i32::from(c == '(') - i32::from(c == ')');
                depth == 0
            });
            let call = call.into_iter().next().expect("a call");
            for method in ["get", "post", "put", "patch", "delete"] {
                let named = |at: usize| !call[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_');
                if call.match_indices(&format!("{method}(")).any(|(at, _)| named(at)) {
                    found.insert((method.to_owned(), address.to_owned()));
                }
            }
        }
    }
}

#[test]
fn every_route_is_in_the_document_and_nothing_else() {
    let mut there = BTreeSet::new();
    routes(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &mut there);
    assert!(there.len() > 10, "the search finds only {there:?}");
    let told: BTreeSet<(String, String)> =
        operations().iter().map(|operation| (operation.method.into(), operation.path.into())).collect();
    let (missing, gone): (Vec<_>, Vec<_>) =
        (there.difference(&told).collect(), told.difference(&there).collect());
    assert!(
        missing.is_empty() && gone.is_empty(),
        "api/openapi/operations.rs lacks {missing:?} and has {gone:?} that no router has"
    );
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

/// A schema with what it refers to in its place, one step.
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
    // Every handler tells its verbs when it is asked for another: its text has them all.
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/api/admin");
    for operation in operations().iter().filter(|operation| !operation.words.is_empty()) {
        let noun = operation.path.split('/').nth(3).expect("a noun");
        let file = match noun {
            "export" | "competition" => format!("{noun}.rs"),
            noun => format!("{noun}s.rs"),
        };
        let text = std::fs::read_to_string(folder.join(&file)).expect("a source file");
        let list = operation.words.join(", ");
        assert!(text.contains(&list), "{file} does not speak of {list}");
    }
}
