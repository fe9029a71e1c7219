//! The documentation of crates has no examples. The manifests say `doctest = false`, since to look for them takes a pass of
//! the compiler over every crate.

use crate::training::files;
use std::fs;
use std::path::Path;

#[test]
fn no_documentation_has_an_example() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let crates = [
        "models",
        "sim",
        "senses",
        "tasks",
        "protocol",
        "replay",
        "analysis",
        "hand-import",
        "hand-tools",
        "s3",
        "server",
        "cli",
        "bench",
        "compare",
    ];
    let all = crates.iter().flat_map(|name| files(&root.join(name).join("src")));
    let is_fence =
        |line: &str| ["/// ```", "//! ```"].iter().any(|fence| line.trim_start().starts_with(fence));
    let with = all.filter(|file| fs::read_to_string(file).expect("text").lines().any(is_fence));
    assert_eq!(with.collect::<Vec<_>>(), Vec::<std::path::PathBuf>::new());
}
