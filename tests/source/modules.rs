//! Every Rust file belongs to its crate: a `mod` line in its parent names it. Without one neither compiler nor tests see it.

use std::fs;
use std::path::{Path, PathBuf};

/// Rust files below a folder that no file of the folder declares as modules; `roots` are the files that declare its parts.
fn forgotten(folder: &Path, roots: &[PathBuf], found: &mut Vec<PathBuf>) {
    let declared: String = roots.iter().filter_map(|root| fs::read_to_string(root).ok()).collect();
    let is_declared =
        |name: &str| declared.contains(&format!("mod {name};")) || declared.contains(&format!("{name}.rs\""));
    for entry in fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("an entry").path();
        let name = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default().to_owned();
        if path.is_dir() {
            let own = [path.join("mod.rs"), folder.join(format!("{name}.rs"))];
            // A folder without such a file has no modules: the binaries of a package.
            if own.iter().any(|file| file.is_file()) {
                forgotten(&path, &own, found);
                if own[0].is_file() && !is_declared(&name) {
                    found.push(path);
                }
            }
        } else if path.extension().is_some_and(|kind| kind == "rs")
            && !roots.contains(&path)
            && !is_declared(&name)
        {
            found.push(path);
        }
    }
}

fn forgotten_in(folder: &Path) -> Vec<PathBuf> {
    let roots = ["lib.rs", "main.rs"].map(|root| folder.join(root));
    let mut found = Vec::new();
    forgotten(folder, &roots, &mut found);
    found
}

#[test]
fn every_file_is_a_module_of_its_crate() {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut folders: Vec<PathBuf> =
        crate::circles::crates(&workspace).iter().map(|name| workspace.join(name).join("src")).collect();
    folders.extend(["system", "source"].map(|name| workspace.join("tests").join(name)));
    let found: Vec<PathBuf> =
        folders.iter().filter(|folder| folder.is_dir()).flat_map(|folder| forgotten_in(folder)).collect();
    assert!(found.is_empty(), "no `mod` line names these: {found:#?}");
}

#[test]
fn a_file_without_a_line_is_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        let file = folder.path().join(name);
        fs::create_dir_all(file.parent().expect("a parent")).expect("a folder");
        fs::write(file, text).expect("written");
    };
    write("lib.rs", "mod a;\npub mod b;\n#[path = \"d.rs\"]\nmod other;");
    write("a.rs", "mod inner;");
    write("a/inner.rs", "");
    write("b/mod.rs", "");
    write("d.rs", "");
    assert_eq!(forgotten_in(folder.path()), Vec::<PathBuf>::new());
    write("b/lost.rs", "");
    assert_eq!(forgotten_in(folder.path()), [folder.path().join("b/lost.rs")]);
}
