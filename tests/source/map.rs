//! The documents name paths that exist, and the map names every part of the repository.

use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn text(path: impl AsRef<Path>) -> String {
    fs::read_to_string(root().join(path)).expect("the file")
}

/// Whether the repository has this path, or the Python client, in whose folder some commands run.
fn exists(path: &str) -> bool {
    root().join(path).exists() || root().join("client-py").join(path).exists()
}

/// Folders at the root of the repository, without hidden ones.
fn folders() -> Vec<String> {
    let entries = fs::read_dir(root()).expect("the repository").map(|entry| entry.expect("an entry").path());
    let names =
        entries.filter(|path| path.is_dir()).filter_map(|path| Some(path.file_name()?.to_str()?.to_owned()));
    names.filter(|name| !name.starts_with('.') && name != "target").collect()
}

/// Rust files below the root of a crate, as paths.
fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().map(|entry| entry.expect("an entry").path());
    let below = entries.flat_map(|path| if path.is_dir() { rust_files(&path) } else { vec![path] });
    below.filter(|path| path.extension().is_some_and(|kind| kind == "rs")).collect()
}

/// Paths from the root of the repository that a document names in backquotes, without patterns and hidden files.
fn named_paths<'a>(document: &'a str, folders: &[String]) -> Vec<&'a str> {
    let words = document.split('`').skip(1).step_by(2).flat_map(str::split_whitespace);
    let words = words.map(|word| word.trim_end_matches([',', ':', ';']));
    let in_repository = |word: &&str| {
        word.split_once('/')
            .is_some_and(|(first, rest)| !rest.is_empty() && folders.iter().any(|name| name == first))
    };
    words
        .filter(in_repository)
        .filter(|word| !word.contains(['*', '{', '<', '…', '$']) && !word.contains("/."))
        .collect()
}

#[test]
fn every_path_that_a_document_names_exists() {
    let folders = folders();
    let docs = fs::read_dir(root().join("docs")).expect("docs").map(|entry| entry.expect("an entry").path());
    let docs = docs.filter(|path| path.extension().is_some_and(|kind| kind == "md"));
    let files: Vec<PathBuf> =
        folders.iter().flat_map(|name| rust_files(&root().join(name).join("src"))).collect();
    let mut missing = Vec::new();
    for page in ["ARCHITECTURE.md", "CONTRIBUTING.md", "README.md"].map(PathBuf::from).into_iter().chain(docs)
    {
        let document = text(&page);
        for path in named_paths(&document, &folders).into_iter().filter(|path| !exists(path)) {
            missing.push(format!("{} names `{path}`", page.display()));
        }
        // Others are relative to a folder that the text names.
        let spans = document.split('`').skip(1).step_by(2);
        let relative = spans.filter(|span| span.ends_with(".rs") && !span.contains([' ', '*', '{']));
        for path in relative.filter(|path| !exists(path) && !files.iter().any(|file| file.ends_with(path))) {
            missing.push(format!("{} names `{path}`", page.display()));
        }
    }
    assert!(missing.is_empty(), "there is no such path:\n{}", missing.join("\n"));
}

#[test]
fn paths_are_found_in_commands_and_patterns_are_not() {
    let document = "See `sim/src/world.rs`, `python client-py/run.py --out x.svg`, `tasks/*/task.toml`, sim/none and `models`.";
    let folders = ["sim", "client-py", "tasks", "models"].map(str::to_owned);
    assert_eq!(named_paths(document, &folders), ["sim/src/world.rs", "client-py/run.py"]);
}

#[test]
fn the_map_names_every_part_of_the_repository() {
    let map = text("ARCHITECTURE.md");
    let manifests = ["Cargo.toml", "pyproject.toml", "package.json"];
    let mut parts = folders();
    parts.retain(|folder| manifests.iter().any(|name| root().join(folder).join(name).is_file()));
    assert!(parts.contains(&"sim".to_owned()), "{parts:?}");
    let unnamed: Vec<_> = parts.iter().filter(|part| !map.contains(&format!("\n{part}/ "))).collect();
    assert!(unnamed.is_empty(), "ARCHITECTURE.md does not name {unnamed:?}");
}

#[test]
fn every_crate_is_in_the_context_that_an_image_is_built_from() {
    let workspace = text("Cargo.toml");
    let members = workspace.split_once("members = [").and_then(|(_, rest)| rest.split_once(']'));
    let members: Vec<&str> = members.expect("members").0.split('"').skip(1).step_by(2).collect();
    assert!(members.contains(&"sim"), "{members:?}");
    let context = text(".dockerignore");
    let left_out: Vec<_> =
        members.iter().filter(|m| !context.lines().any(|line| line == format!("!{m}"))).collect();
    assert!(left_out.is_empty(), ".dockerignore leaves out {left_out:?}");
}
