//! The map of the house names files that are there.

use std::path::Path;

#[test]
fn every_file_that_the_architecture_names_is_there() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut named = 0;
    for page in ["ARCHITECTURE.md", "docs/physics.md"] {
        let text = std::fs::read_to_string(root.join(page)).expect("the page");
        let folders = [
            "models/",
            "sim/",
            "tasks/",
            "protocol/",
            "replay/",
            "hand-tools/",
            "server/",
            "cli/",
            "bench/",
            "tests/",
            "client-py/",
            "docs/",
        ];
        for word in text.split('`').skip(1).step_by(2) {
            let is_path = folders.iter().any(|folder| word.starts_with(folder)) && !word.contains(['*', ' ']);
            if is_path {
                assert!(root.join(word).exists(), "{page} names `{word}`, which is not there");
                named += 1;
            }
        }
    }
    assert!(named > 40, "only {named} files are named");
}
