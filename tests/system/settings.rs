//! The file of --config: settings with which no server starts. The environment: empty variables.

use crate::harness::{Official, RULES, Server, get, program};
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

#[test]
fn a_hand_without_ranges_is_refused_where_hands_are_drawn() {
    let spread = format!("{RULES}hand_spread = true\n");
    for hands in ["[\"pinch\"]", "[\"softhand\", \"pinch\"]"] {
        let said = refused(&format!("{spread}hands = {hands}\n"));
        for part in [
            "competition.toml: hand_spread = true",
            "`pinch` of hands",
            "[uncertain]",
            "`softhand`",
            "`reflex`",
        ] {
            assert!(said.contains(part), "'{part}' is not in: {said}");
        }
        assert!(!said.contains("Hands with ranges: `pinch`"), "{said}");
    }
    let own = concat!(env!("CARGO_MANIFEST_DIR"), "/../models/hands/pinch/hand.urdf");
    let folder = TempDir::new().expect("temporary directory");
    for file in std::fs::read_dir(std::path::Path::new(own).parent().expect("a folder")).expect("files") {
        let from = file.expect("a file").path();
        let to = folder.path().join(from.file_name().expect("a name"));
        let text = std::fs::read(&from).expect("reads");
        let text = String::from_utf8_lossy(&text).replacen("name = \"pinch\"", "name = \"claw\"", 1);
        std::fs::write(to, text).expect("copied");
    }
    let own = folder.path().join("hand.urdf");
    let said = refused(&format!("{spread}hands = [\"softhand\"]\nhand_files = [{:?}]\n", own));
    assert!(said.contains("`claw` of hand_files"), "{said}");
}

#[test]
fn a_task_that_nobody_could_play_is_refused() {
    let said = refused(&format!("{RULES}sensors_only = [\"shelves\"]\n"));
    assert!(said.contains("competition.toml: sensors_only: no task `shelves`; there are: balls"), "{said}");

    let own = TempDir::new().expect("temporary directory");
    let text =
        include_str!("../../tasks/grasp/task.toml").replacen("name = \"grasp\"", "name = \"buried\"", 1);
    let write = |text: &str| std::fs::write(own.path().join("task.toml"), text).expect("writes");
    let rules =
        format!("{RULES}hands = [\"softhand\"]\ntasks = [\"balls\"]\ntask_files = [{:?}]\n", own.path());
    // The hand begins inside the table.
    let buried = text.replacen("position = [0.0, 0.0, 0.55]", "position = [0.0, 0.0, 0.02]", 1);
    assert_ne!(buried, text);
    write(&buried);
    let said = refused(&rules);
    assert!(said.contains("competition.toml: hands: `softhand` cannot be played in every task"), "{said}");
    assert!(said.contains("task `buried`: where the hand starts"), "{said}");
}

/// The environment variables that the help of a command names.
fn variables(command: &[&str]) -> Vec<String> {
    let help = Command::new(program()).args(command).arg("--help").output().expect("palmares runs");
    let help = String::from_utf8(help.stdout).expect("UTF-8");
    let named = help.split("[env: ").skip(1).filter_map(|rest| rest.split(['=', ']']).next());
    named.map(str::to_owned).collect()
}

#[test]
fn an_empty_variable_is_as_if_it_were_not_set() {
    let all = variables(&["serve"]);
    assert!(all.len() > 15 && all.iter().any(|name| name == "PALMARES_CONFIG"), "{all:?}");
    let empty: Vec<(&str, &str)> = all.iter().map(|name| (name.as_str(), "")).collect();
    let folder = TempDir::new().expect("folder");
    let server = Server::start_in_environment(folder, &[], &empty);
    // A practice server, as without the variable of the file.
    let competition = get(&server, "/v1/competition").json();
    assert_eq!(competition["mode"], "practice", "{competition}");

    let cup = Official::start();
    let mut all = variables(&["admin", "status"]);
    all.extend(["PALMARES_TOKEN", "PALMARES_CA", "PALMARES_TOKEN_FILE"].map(str::to_owned));
    let mut status = Command::new(program());
    status.args(["admin", "--url", &format!("http://{}", cup.server.address()), "status"]);
    status.envs(all.iter().map(|name| (name, ""))).env("PALMARES_DATA_DIR", cup.folder());
    let output = status.output().expect("palmares runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
