//! Passes the commit of the build to the program.

use std::path::{Path, PathBuf};
use std::process::Command;

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=PALMARES_BUILD_HASH");
    if let Some(folder) = git(&["rev-parse", "--absolute-git-dir"]) {
        // Only existing paths: a missing one would run this script at every build.
        for name in ["HEAD", "logs/HEAD"] {
            let path: PathBuf = Path::new(&folder).join(name);
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
