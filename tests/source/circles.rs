//! No files of a crate import each other in a circle: each can be understood from those that it imports.

use std::fs;
use std::path::{Path, PathBuf};

use crate::imports::Imports;

/// Crates without circles. One that is put in order comes here.
const HELD: [&str; 10] =
    ["models", "sim", "tasks", "protocol", "replay", "hand-tools", "cli", "bench", "xtask", "server"];

#[test]
fn no_files_import_each_other_in_a_circle() {
    let found: Vec<String> = HELD.iter().flat_map(|name| circles_of(&workspace().join(name))).collect();
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The circles of a crate in words, each with what every one of its files imports of the others.
fn circles_of(folder: &Path) -> Vec<String> {
    let roots = ["src/lib.rs", "src/main.rs"].map(|root| folder.join(root));
    let mut told = Vec::new();
    for root in roots.iter().filter(|root| root.is_file()) {
        let imports = Imports::read(root);
        for circle in imports.circles() {
            let mut text = format!("{}: {} files in a circle\n", root.display(), circle.len());
            for &file in &circle {
                let of_circle = imports.of[file].iter().filter(|to| circle.contains(to));
                let names: Vec<String> =
                    of_circle.map(|&to| imports.files[to].display().to_string()).collect();
                text += &format!("    {} imports {}\n", imports.files[file].display(), names.join(", "));
            }
            told.push(text);
        }
    }
    told
}

/// What is told of a crate with these files.
fn told(files: &[(&str, &str)]) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in files {
        let file = folder.path().join("src").join(name);
        fs::create_dir_all(file.parent().expect("src")).expect("a folder");
        fs::write(file, text).expect("written");
    }
    circles_of(folder.path()).concat()
}

#[test]
fn a_circle_is_named_however_its_paths_are_written() {
    let lib = ("lib.rs", "pub mod a; mod b; mod c;");
    for (a, c) in [
        ("use crate::b::B;", "use super::a::A;"),
        ("use crate::{b::{self, B}, Pose};", "pub(crate) use crate::{Pose, a::{A as Other}};"),
        ("fn f() -> super::b::B { todo!() }", "fn f() { println!(\"{}\", crate::a::x()) }"),
        ("use crate::b as other; fn f() { other::x() }", "mod inner { use super::super::a::*; }"),
    ] {
        let told = told(&[lib, ("a.rs", a), ("b.rs", "use crate::c;"), ("c.rs", c)]);
        assert!(told.contains("3 files in a circle"), "{a} {c}: {told}");
        assert!(told.contains("a.rs imports b.rs\n") && told.contains("c.rs imports a.rs\n"), "{told}");
    }
}

#[test]
fn tests_comments_and_plain_names_close_no_circle() {
    let b = "//! As [`crate::a::A`].\n/// crate::a\nfn f(x: X) { x.a(); \"crate::a::A\"; other::a::x(); }\n\
             #[cfg(test)]\nmod tests { use crate::a::A; }\n#[cfg(test)]\nuse crate::a::A;";
    let quiet = told(&[("lib.rs", "mod a; mod b;"), ("a.rs", "use crate::b::f;"), ("b.rs", b)]);
    assert_eq!(quiet, "");
}

#[test]
fn a_parent_that_re_exports_closes_one_only_for_its_children() {
    let files = |b: &'static str| {
        let parent = ("room/mod.rs", "mod a; mod b; pub use self::a::A; pub use b::B;");
        [
            ("main.rs", "mod room; mod user;"),
            parent,
            ("room/a.rs", ""),
            ("room/b.rs", b),
            ("user.rs", "use crate::room::A;"),
        ]
    };
    assert_eq!(told(&files("use super::a::A; use crate::user;")), "");
    let told = told(&files("use super::A;"));
    assert!(told.contains("room/b.rs imports room/mod.rs"), "{told}");
}
