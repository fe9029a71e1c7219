//! The file of --config: settings with which no server starts.

use crate::harness::{RULES, program};
use std::process::Command;
use tempfile::TempDir;

/// The error of a server with this file.
fn refused(rules: &str) -> String {
    let folder = TempDir::new().expect("temporary directory");
    let file = folder.path().join("competition.toml");
    std::fs::write(&file, rules).expect("rules");
    let mut command = Command::new(program());
    command
        .args(["serve", "--listen", "127.0.0.1:0", "--data-dir"])
        .arg(folder.path())
        .arg("--config")
        .arg(&file);
    // A server that starts all the same is stopped here.
    let output =
        Command::new("timeout").arg("20").arg(command.get_program()).args(command.get_args()).output();
    let output = output.expect("palmares runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(1) && output.stdout.is_empty(), "{:?}: {said}", output.status);
    assert!(!folder.path().join("palmares.sqlite").exists(), "nothing is written");
    said
}

#[test]
fn a_list_with_a_value_twice_is_refused() {
    for (field, value) in [("tasks", "balls"), ("hands", "softhand"), ("sensors_only", "shelf")] {
        let said = refused(&format!("{RULES}{field} = [\"{value}\", \"{value}\"]\n"));
        assert!(said.contains(&format!("competition.toml: {field}: \"{value}\" is there twice")), "{said}");
    }
}

#[test]
fn a_file_without_a_mode_opens_no_practice_server() {
    for rules in ["", "session_s = 600\n"] {
        let said = refused(rules);
        assert!(said.contains("mode is missing: expected \"official\" or \"practice\""), "{said}");
    }
}
