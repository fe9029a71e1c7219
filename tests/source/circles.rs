//! No files or folders import each other in a circle: each can be understood from those that it imports.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use crate::imports::{Segments, read};

#[test]
fn no_parts_of_a_folder_import_each_other_in_a_circle() {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let crates = crates(&workspace);
    assert!(crates.contains(&"sim".to_owned()), "{crates:?}");
    let found: String = crates.iter().map(|name| circles_of(&workspace.join(name))).collect();
    assert!(found.is_empty(), "\n{found}");
}

/// The folders of the workspace's members.
pub(crate) fn crates(workspace: &Path) -> Vec<String> {
    let manifest = fs::read_to_string(workspace.join("Cargo.toml")).expect("the workspace");
    let (_, members) = manifest.split_once("members = [").expect("members");
    members.split(']').next().expect("an end").split('"').skip(1).step_by(2).map(str::to_owned).collect()
}

/// The parts of a folder, each with those that it imports, and for each of these one import as an example.
type Folder = BTreeMap<String, BTreeMap<String, String>>;

/// The circles of a crate in words.
fn circles_of(folder: &Path) -> String {
    let roots = ["src/lib.rs", "src/main.rs"].map(|root| folder.join(root));
    let mut text = String::new();
    for root in roots.iter().filter(|root| root.is_file()) {
        for (path, parts) in folders(read(root)) {
            for circle in circles(&parts) {
                let place: PathBuf = root.parent().into_iter().chain(path.iter().map(Path::new)).collect();
                text += &format!("{}: {} parts in a circle\n", place.display(), circle.len());
                for part in circle.iter().copied() {
                    for (to, example) in parts[part].iter().filter(|(to, _)| circle.contains(*to)) {
                        text += &format!("    {part} imports {to} ({example})\n");
                    }
                }
            }
        }
    }
    text
}

/// The folders of a crate. An import between two modules is one between parts of the innermost folder that has both.
fn folders(imports: BTreeMap<Segments, BTreeSet<Segments>>) -> BTreeMap<Segments, Folder> {
    let mut folders: BTreeMap<Segments, Folder> = BTreeMap::new();
    for (from, to) in imports.iter().flat_map(|(from, all)| all.iter().map(move |to| (from, to))) {
        let depth = from.iter().zip(to).take_while(|(a, b)| a == b).count();
        // The folder's own file declares its parts, and may re-export them.
        let part = |path: &Segments| path.get(depth).cloned().unwrap_or_else(|| "mod.rs".to_owned());
        let folder = folders.entry(from[..depth].to_vec()).or_default();
        let example = format!("{} → {}", from.join("::"), to.join("::"));
        folder.entry(part(from)).or_default().entry(part(to)).or_insert(example);
    }
    folders
}

/// Every largest set of parts that lead to each other, with two parts or more.
fn circles(parts: &Folder) -> BTreeSet<BTreeSet<&String>> {
    let reached = |from| {
        let (mut found, mut open) = (BTreeSet::new(), vec![from]);
        while let Some(next) = open.pop() {
            let imports = parts.get(next).into_iter().flat_map(BTreeMap::keys);
            open.extend(imports.filter(|to| found.insert(*to)));
        }
        found
    };
    let reached: BTreeMap<&String, BTreeSet<&String>> =
        parts.keys().map(|from| (from, reached(from))).collect();
    let mutual = |from: &String| -> BTreeSet<&String> {
        reached
            .iter()
            .filter(|(to, back)| reached[from].contains(*to) && back.contains(from))
            .map(|(to, _)| *to)
            .collect()
    };
    reached.keys().map(|from| mutual(from)).filter(|circle| circle.len() > 1).collect()
}

/// The circles of a crate with these files, in words.
fn circles_of_files(files: &[(&str, &str)]) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in files {
        let file = folder.path().join("src").join(name);
        fs::create_dir_all(file.parent().expect("src")).expect("a folder");
        fs::write(file, text).expect("written");
    }
    circles_of(folder.path())
}

#[test]
fn a_circle_of_files_is_named_however_its_paths_are_written() {
    let lib = ("lib.rs", "pub mod a; mod b; mod c;");
    for (a, c) in [
        ("use crate::b::B;", "use super::a::A;"),
        ("use crate::{b::{self, B}, Pose};", "pub(crate) use crate::{Pose, a::{A as Other}};"),
        ("fn f() -> super::b::B { todo!() }", "fn f() { println!(\"{}\", crate::a::x()) }"),
        ("use crate::b as other; fn f() { other::x() }", "mod inner { use super::super::a::*; }"),
    ] {
        let found = circles_of_files(&[lib, ("a.rs", a), ("b.rs", "use crate::c;"), ("c.rs", c)]);
        assert!(found.contains("3 parts in a circle"), "{a} {c}: {found}");
        assert!(
            found.contains("a imports b (a → b)\n") && found.contains("c imports a (c → a)\n"),
            "{found}"
        );
    }
}

#[test]
fn a_circle_of_folders_is_named_though_no_files_are_in_one() {
    let files = |back: &'static str| {
        [
            ("lib.rs", "mod cases; mod report;"),
            ("cases/mod.rs", "mod fall; pub mod run;"),
            ("cases/fall.rs", "use crate::report::figure::Figure;"),
            ("cases/run.rs", ""),
            ("report/mod.rs", "pub mod figure; mod page;"),
            ("report/figure.rs", ""),
            ("report/page.rs", back),
        ]
    };
    assert_eq!(circles_of_files(&files("")), "");
    let found = circles_of_files(&files("use crate::cases::run;"));
    assert!(found.contains("cases imports report (cases::fall → report::figure)"), "{found}");
    assert!(found.contains("report imports cases (report::page → cases::run)"), "{found}");
}

#[test]
fn tests_comments_and_plain_names_close_no_circle() {
    let b = "//! As [`crate::a::A`].\n/// crate::a\nfn f(x: X) { x.a(); \"crate::a::A\"; other::a::x(); }\n\
             #[cfg(test)]\nmod tests { use crate::a::A; }\n#[cfg(test)]\nuse crate::a::A;";
    let found = circles_of_files(&[("lib.rs", "mod a; mod b;"), ("a.rs", "use crate::b::f;"), ("b.rs", b)]);
    assert_eq!(found, "");
}

#[test]
fn a_parent_that_re_exports_closes_one_only_for_its_children() {
    let files = |b: &'static str| {
        [
            ("main.rs", "mod room; mod user;"),
            ("room/mod.rs", "mod a; mod b; pub use self::a::A; pub use b::B;"),
            ("room/a.rs", ""),
            ("room/b.rs", b),
            ("user.rs", "use crate::room::A;"),
        ]
    };
    assert_eq!(circles_of_files(&files("use super::a::A;")), "");
    let found = circles_of_files(&files("use super::A;"));
    assert!(found.contains("b imports mod.rs (room::b → room)"), "{found}");
}
