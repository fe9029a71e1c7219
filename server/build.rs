//! Passes the commit of the build and the repository's documents to the program, and rebuilds after the viewer was built.

#[path = "documents.rs"]
mod documents;

use std::path::{Path, PathBuf};
use std::process::Command;

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=PALMARES_BUILD_HASH");
    // A source distribution of the Python package has no viewer: its server is built without pages.
    if !Path::new("../viewer/dist").exists() {
        let made = std::fs::create_dir_all("../viewer/dist");
        made.unwrap_or_else(|error| panic!("viewer/dist is missing and cannot be made: {error}"));
    }
    println!("cargo::rerun-if-changed=../viewer/dist");
    documents::embed(Path::new(".."));
    if let Some(folder) = git(&["rev-parse", "--absolute-git-dir"]) {
        // Only existing paths: a missing one would run this script at every build.
        for name in ["HEAD", "logs/HEAD"] {
            let path = PathBuf::from(&folder).join(name);
            if path.exists() {
                println!("cargo::rerun-if-changed={}", path.display());
            }
        }
    }
    let hash = std::env::var("PALMARES_BUILD_HASH")
        .ok()
        .or_else(|| git(&["rev-parse", "--short=12", "HEAD"]))
        .unwrap_or_else(|| "unknown".into());
    println!("cargo::rustc-env=PALMARES_BUILD_HASH={hash}");
}
