//! Rebuilds after the viewer was built.

use std::path::Path;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    // A source distribution of the Python package has no viewer: its server is built without pages.
    if !Path::new("../viewer/dist").exists() {
        let made = std::fs::create_dir_all("../viewer/dist");
        made.unwrap_or_else(|error| panic!("viewer/dist is missing and cannot be made: {error}"));
    }
    println!("cargo::rerun-if-changed=../viewer/dist");
}
