//! Every command of cargo compiles a dependency with the same features, so that one command uses what another has compiled.

use std::collections::BTreeSet;
use std::process::Command;

/// Dependencies with their features, as a command with these packages compiles them; crates of ours are left out.
fn resolved(packages: &[&str]) -> BTreeSet<String> {
    let mut tree = Command::new(env!("CARGO"));
    tree.current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).args(["tree", "--locked", "--offline"]);
    tree.args(["--prefix", "none", "--no-dedupe", "--format", "{p} with {f}"]).args(packages);
    let output = tree.output().expect("cargo starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let lines = String::from_utf8(output.stdout).expect("text");
    lines.lines().filter(|line| !line.contains('/')).map(str::to_owned).collect()
}

#[test]
fn dependencies_have_the_same_features_in_every_program() {
    let all = resolved(&["--workspace", "--edges", "normal,build,dev"]);
    assert!(all.iter().any(|line| line.starts_with("nalgebra v")), "{all:?}");
    for package in ["palmares", "palmares-native", "palmares-bench", "palmares-compare"] {
        let own = resolved(&["--package", package, "--edges", "normal,build"]);
        assert!(own.len() > 50, "{package}: {own:?}");
        let differ: Vec<&String> = own.difference(&all).collect();
        assert!(
            differ.is_empty(),
            "{package} compiles these again; add their features to features/Cargo.toml: {differ:#?}"
        );
    }
}
