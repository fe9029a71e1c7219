//! A server cannot reach the code for learners.

use std::fs;
use std::path::{Path, PathBuf};

/// Every Rust file below a folder.
pub(crate) fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("the folder").map(|entry| entry.expect("an entry").path());
    entries
        .flat_map(|path| match path.is_dir() {
            true => files(&path),
            false => vec![path],
        })
        .filter(|path| path.extension().is_some_and(|kind| kind == "rs"))
        .collect()
}

/// Files that name something of that module, however they import it.
fn naming_it(crates: &[&str]) -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let all = crates.iter().flat_map(|name| files(&root.join(name)));
    all.filter(|file| fs::read_to_string(file).expect("text").contains("training::")).collect()
}

#[test]
fn no_server_opens_a_run_that_is_not_the_tasks() {
    assert_eq!(
        naming_it(&["server", "protocol/src", "cli/src", "replay/src", "hand-tools/src"]),
        Vec::<PathBuf>::new()
    );
    // It would be found: this is how the engine in a learner's process names it.
    assert!(!naming_it(&["client-py/native/src"]).is_empty());
}
