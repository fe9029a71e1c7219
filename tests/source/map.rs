//! The documents name paths that exist. The map names every part of the repository, the documentation of a crate each of its folders.

use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn text(path: impl AsRef<Path>) -> String {
    fs::read_to_string(root().join(path)).expect("the file")
}

/// Where a path is that a document names: in the repository, or in the Python client, in whose folder some commands run.
fn find(path: &str) -> Option<PathBuf> {
    [root(), root().join("client-py")].into_iter().map(|folder| folder.join(path)).find(|path| path.exists())
}

/// The documentation of all parts, by its file: the first lines of a crate's root file, and the pages of the parts that are no crates.
fn part_docs() -> Vec<(String, String)> {
    let crates = crate::circles::crates(&root());
    let of_crates =
        crates.iter().flat_map(|name| ["lib", "main"].map(|file| format!("{name}/src/{file}.rs")));
    let files = of_crates.filter(|file| root().join(file).is_file());
    let files = files.chain(["server/tests/model/main.rs".to_owned()]);
    let rust = files.map(|file| {
        let lines: String = text(&file)
            .lines()
            .map_while(|line| line.strip_prefix("//!"))
            .flat_map(|line| [line, "\n"])
            .collect();
        (file, lines)
    });
    let pages = ["viewer/README.md", "client-py/README.md"].map(|file| (file.to_owned(), text(file)));
    rust.chain(pages).collect()
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

/// The texts in backquotes.
fn spans(document: &str) -> impl Iterator<Item = &str> {
    document.split('`').skip(1).step_by(2)
}

/// Whether this stands for several paths, or is hidden.
fn is_pattern(path: &str) -> bool {
    path.contains(['*', '{', '<', '…', '$']) || path.contains("/.")
}

/// Paths from the root of the repository in a text, without patterns and hidden files.
fn rooted_paths<'a>(span: &'a str, folders: &[String]) -> Vec<&'a str> {
    let words = span.split_whitespace().map(|word| word.trim_end_matches([',', ':', ';']));
    let in_repository =
        |word: &&str| word.split_once('/').is_some_and(|(first, _)| folders.iter().any(|name| name == first));
    words.filter(in_repository).filter(|word| !is_pattern(word)).collect()
}

/// A document without its blocks of code.
fn prose(document: &str) -> String {
    let mut is_code = false;
    let mut text = String::new();
    for line in document.lines() {
        let is_fence = line.trim_start().starts_with("```");
        is_code ^= is_fence;
        if !is_code && !is_fence {
            text += line;
            text.push('\n');
        }
    }
    text
}

/// Endings of files and folders that a document may name without a path, in the folder of the path before.
const NAMES: [&str; 5] = [".rs", ".py", ".ts", ".css", "/"];

/// The paths and names in backquotes that do not exist.
fn lost_paths(document: &str, folders: &[String]) -> Vec<String> {
    let document = prose(document);
    let (mut place, mut lost) = (root(), Vec::new());
    for span in spans(&document) {
        let rooted = rooted_paths(span, folders);
        for path in &rooted {
            match find(path) {
                Some(found) if found.is_dir() => place = found,
                Some(found) => place = found.parent().expect("a file is in a folder").to_owned(),
                None => lost.push((*path).to_owned()),
            }
        }
        let is_name = rooted.is_empty()
            && NAMES.iter().any(|ending| span.ends_with(ending))
            && !span.contains(char::is_whitespace)
            && !is_pattern(span);
        if is_name && !place.join(span).exists() {
            lost.push(format!("{span}, which is not in {}", place.display()));
        }
    }
    lost
}

#[test]
fn every_path_that_a_document_names_exists() {
    let folders = folders();
    let docs = fs::read_dir(root().join("docs")).expect("docs").map(|entry| entry.expect("an entry").path());
    let docs = docs.filter(|path| path.extension().is_some_and(|kind| kind == "md"));
    let files: Vec<PathBuf> =
        folders.iter().flat_map(|name| rust_files(&root().join(name).join("src"))).collect();
    let mut missing = Vec::new();
    for page in docs.chain([PathBuf::from("README.md")]) {
        let document = text(&page);
        let rooted = spans(&document).flat_map(|span| rooted_paths(span, &folders));
        for path in rooted.filter(|path| find(path).is_none()) {
            missing.push(format!("{} names `{path}`", page.display()));
        }
        // Others are relative to a folder that the text names.
        let relative =
            spans(&document).filter(|span| span.ends_with(".rs") && !span.contains([' ', '*', '{']));
        let is_lost = |path: &str| find(path).is_none() && !files.iter().any(|file| file.ends_with(path));
        for path in relative.filter(|path| is_lost(path)) {
            missing.push(format!("{} names `{path}`", page.display()));
        }
    }
    assert!(missing.is_empty(), "there is no such path:\n{}", missing.join("\n"));
}

#[test]
fn every_path_of_the_map_the_recipes_and_the_parts_exists() {
    let folders = folders();
    let maps = ["ARCHITECTURE.md", "CONTRIBUTING.md"].map(|file| (file.to_owned(), text(file)));
    let mut lost = Vec::new();
    for (file, document) in part_docs().into_iter().chain(maps) {
        lost.extend(lost_paths(&document, &folders).iter().map(|path| format!("{file} names `{path}`")));
    }
    assert!(lost.is_empty(), "there is no such path:\n{}", lost.join("\n"));
}

#[test]
fn every_folder_of_a_crate_is_in_the_documentation_of_a_crate() {
    let docs: String = part_docs().into_iter().map(|(_, text)| text).collect();
    let mut unnamed = Vec::new();
    for name in crate::circles::crates(&root()) {
        let entries = fs::read_dir(root().join(&name).join("src")).into_iter().flatten();
        for path in entries.map(|entry| entry.expect("an entry").path()) {
            let Some(folder) = path.file_name().and_then(|folder| folder.to_str()) else { continue };
            let named = format!("`{name}/src/{folder}/`");
            if path.join("mod.rs").is_file() && folder != "tests" && !docs.contains(&named) {
                unnamed.push(named);
            }
        }
    }
    assert!(unnamed.is_empty(), "no crate's first lines name {}", unnamed.join(", "));
}

#[test]
fn paths_are_found_in_commands_and_patterns_are_not() {
    let document = "See `sim/src/world.rs`, `python client-py/run.py --out x.svg`, `tasks/*/task.toml`, sim/none and `models`.";
    let folders = ["sim", "client-py", "tasks", "models"].map(str::to_owned);
    let found: Vec<&str> = spans(document).flat_map(|span| rooted_paths(span, &folders)).collect();
    assert_eq!(found, ["sim/src/world.rs", "client-py/run.py"]);
}

#[test]
fn a_name_is_in_the_folder_of_the_path_before_it() {
    let folders = ["sim", "tasks"].map(str::to_owned);
    let lost = |document: &str| lost_paths(document, &folders).len();
    assert_eq!(lost("`sim/src/world.rs`, `model.rs`; `sim/src/step/`: `mod.rs`; `sim/src/*/mod.rs`"), 0);
    assert_eq!(lost("`sim/src/step/` and `world.rs`"), 1);
    assert_eq!(lost("`model.rs` before `sim/src/world.rs`, `sim/src/none.rs`, `step/`"), 2);
    assert_eq!(lost("```\nsee `model.rs`\n```\n`tasks/none/`"), 1);
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
    assert!(map.lines().count() <= 200, "ARCHITECTURE.md is no map that a newcomer reads in ten minutes");
}

#[test]
fn every_crate_is_in_the_context_that_an_image_is_built_from() {
    let workspace = text("Cargo.toml");
    let members = workspace.split_once("members = [").and_then(|(_, rest)| rest.split_once(']'));
    let members: Vec<&str> = members.expect("members").0.split('"').skip(1).step_by(2).collect();
    assert!(members.contains(&"sim"), "{members:?}");
    let context = text(".dockerignore");
    let taken = |member: &str| {
        Path::new(member)
            .ancestors()
            .any(|folder| context.lines().any(|line| line == format!("!{}", folder.display())))
    };
    let left_out: Vec<_> = members.iter().filter(|member| !taken(member)).collect();
    assert!(left_out.is_empty(), ".dockerignore leaves out {left_out:?}");
}
