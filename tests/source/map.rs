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

/// The map's walk along an action's way is short: 12 files from the socket to a motor, 8 back. That the code goes this way is
/// for a reader to see.
#[test]
fn the_map_leads_an_action_through_few_files() {
    let map = include_str!("../../ARCHITECTURE.md");
    let between = |from: &str, to: &str| {
        let (_, rest) = map.split_once(from).expect("a beginning");
        rest.split_once(to).expect("an end").0
    };
    let files = |list: &str| -> Vec<String> {
        let numbered = |line: &&str| line.split_once(". `").is_some_and(|(k, _)| k.parse::<u32>().is_ok());
        let named = |line: &str| line.split('`').nth(1).expect("a file").to_owned();
        list.lines().filter(numbered).map(named).collect()
    };
    for (way, most) in
        [(files(between("\nIn:\n", "\nOut:\n")), 12), (files(between("\nOut:\n", "\nA realtime")), 8)]
    {
        assert!((6..=most).contains(&way.len()), "{} files, at most {most}: {way:?}", way.len());
        let mut once = way.clone();
        once.sort();
        once.dedup();
        assert_eq!(once.len(), way.len(), "the way returns to a file: {way:?}");
    }
}

#[test]
fn every_crate_is_in_the_context_that_an_image_is_built_from() {
    let read = |file: &str| std::fs::read_to_string(format!("{}/../{file}", env!("CARGO_MANIFEST_DIR")));
    let workspace = read("Cargo.toml").expect("the workspace");
    let members = workspace.split_once("members = [").and_then(|(_, rest)| rest.split_once(']'));
    let members: Vec<&str> = members.expect("members").0.split('"').skip(1).step_by(2).collect();
    assert!(members.contains(&"sim"), "{members:?}");
    let context = read(".dockerignore").expect("the context");
    let left_out: Vec<_> =
        members.iter().filter(|m| !context.lines().any(|line| line == format!("!{m}"))).collect();
    assert!(left_out.is_empty(), ".dockerignore leaves out {left_out:?}");
}
