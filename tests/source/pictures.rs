//! Every picture of the docs is shown by a page.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Component, Path, PathBuf};

const KINDS: [&str; 4] = ["svg", "png", "gif", "webp"];

/// All files of a folder and those in it.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}

/// A path without `..`, from the root.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => drop(plain.pop()),
            Component::CurDir => {}
            part => plain.push(part),
        }
    }
    plain
}

/// The pictures that a page of this folder shows, from the root.
fn shown(page: &str, folder: &Path) -> BTreeSet<PathBuf> {
    let ends = |c: char| matches!(c, ')' | '"' | '\'' | ' ' | '\n');
    let links = ["](", "src=\"", "srcset=\""].into_iter().flat_map(|open| page.split(open).skip(1));
    links.filter_map(|rest| rest.split(ends).next()).map(|link| plain(&folder.join(link))).collect()
}

#[test]
fn every_picture_of_the_docs_is_shown_by_a_page() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the repository");
    let is = |file: &Path, kinds: &[&str]| {
        file.extension().and_then(|kind| kind.to_str()).is_some_and(|kind| kinds.contains(&kind))
    };
    let docs: Vec<PathBuf> = files(&root.join("docs"));
    let pages = docs.iter().filter(|file| is(file, &["md"])).cloned().chain([root.join("README.md")]);
    let shown: BTreeSet<PathBuf> = pages
        .flat_map(|page| shown(&fs::read_to_string(&page).expect("text"), page.parent().expect("a folder")))
        .collect();
    let lost: Vec<&PathBuf> = docs.iter().filter(|file| is(file, &KINDS) && !shown.contains(*file)).collect();
    assert!(lost.is_empty(), "no page shows {lost:?}");
}

#[test]
fn links_are_read_from_the_folder_of_their_page() {
    let page = "![a](b.svg) and [c](../d/e.png) <img src=\"./f.svg\"> `b.svg`";
    let found = shown(page, Path::new("docs/report"));
    assert_eq!(found, ["docs/report/b.svg", "docs/d/e.png", "docs/report/f.svg"].map(PathBuf::from).into());
}
