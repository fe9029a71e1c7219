//! No text has the marks of a merge that was left open.

use std::fs;
use std::path::{Path, PathBuf};

#[test]
fn no_text_has_marks_of_a_merge() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let texts: Vec<PathBuf> =
        ["", "docs", "tasks", "client-py"].iter().flat_map(|folder| texts(&root.join(folder))).collect();
    assert!(texts.iter().any(|path| path.ends_with("CHANGELOG.md")), "{texts:?}");
    let marked =
        |text: &str| text.lines().any(|line| line.starts_with("<<<<<<<") || line.starts_with(">>>>>>>"));
    let with = texts.iter().filter(|path| fs::read_to_string(path).is_ok_and(|text| marked(&text)));
    assert_eq!(with.collect::<Vec<_>>(), Vec::<&PathBuf>::new());
}

/// Texts of a folder, without those of folders in it.
fn texts(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("the folder").map(|entry| entry.expect("an entry").path());
    entries.filter(|path| path.extension().is_some_and(|kind| kind == "md" || kind == "toml")).collect()
}
