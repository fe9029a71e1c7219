//! Embeds the repository's documents, their pictures and the files that they link to.

use flate2::{Compression, write::GzEncoder};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs};

/// Folders with the endings of the files to embed; `*` is every folder. Not embedded are the records of measurements, with
/// megabytes of pictures: `docs/report`, `docs/validation` and `docs/training`.
const EMBEDDED: [(&str, &[&str]); 12] = [
    ("", &[".md", "LICENSE-MIT", "LICENSE-APACHE"]),
    ("docs", &[".md"]),
    ("docs/pictures", &[".md", ".png", ".svg"]),
    ("docs/pictures/cookbook", &[".png"]),
    ("docs/examples", &[".mjs", ".ipynb"]),
    ("docs/schema", &[".json"]),
    ("client-py", &["README.md"]),
    ("client-py/src/palmares/examples", &[".py"]),
    ("models/hands", &[".toml"]),
    ("models/hands/*", &["README.md", ".svg", ".toml"]),
    ("models/objects", &["README.md"]),
    ("tasks/*", &["task.toml"]),
];

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    embed(Path::new("../.."));
}

/// Writes `documents.rs` into the build's folder: path, bytes, and whether these are compressed, for each file.
/// A folder that is missing, as in a source distribution, embeds nothing.
fn embed(root: &Path) {
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it"));
    let mut list = String::from("[\n");
    for (number, path) in files(root).iter().enumerate() {
        let bytes = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        // A PNG is compressed already.
        let packs = path.extension().is_none_or(|ending| ending != "png");
        let kept = if packs { packed(&bytes) } else { bytes };
        let copy = out.join(format!("document-{number}"));
        fs::write(&copy, kept).unwrap_or_else(|error| panic!("{}: {error}", copy.display()));
        let name = path.strip_prefix(root).expect("below it").to_string_lossy().replace('\\', "/");
        writeln!(list, "    ({name:?}, include_bytes!({:?}), {packs}),", copy.display().to_string())
            .expect("a string");
    }
    list.push(']');
    fs::write(out.join("documents.rs"), list).expect("the build's folder");
}

/// The files to embed, sorted.
fn files(root: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for (folder, endings) in EMBEDDED {
        let folders = match folder.strip_suffix("/*") {
            Some(above) => entries(&root.join(above)),
            None => vec![root.join(folder)],
        };
        let all = folders.iter().flat_map(|folder| entries(folder));
        found.extend(all.filter(|path| {
            path.is_file() && endings.iter().any(|ending| path.to_string_lossy().ends_with(ending))
        }));
    }
    found.sort();
    found
}

/// Paths in a folder; changes in it run the script again. cargo looks at all files below a watched folder: it cannot watch the root,
/// which has `target`, and folders of Python, where each run of the tests writes compiled files.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let all = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let all: Vec<PathBuf> = all.collect();
    if folder.is_dir() && !folder.ends_with("..") && !folder.starts_with("../../client-py") {
        println!("cargo::rerun-if-changed={}", folder.display());
    }
    for file in all.iter().filter(|path| path.is_file()) {
        println!("cargo::rerun-if-changed={}", file.display());
    }
    all
}

fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut packer = GzEncoder::new(Vec::new(), Compression::best());
    packer.write_all(bytes).and_then(|()| packer.finish()).expect("memory")
}
