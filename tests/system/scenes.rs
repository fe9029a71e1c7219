//! Competitions whose teams have scenes of their own.

use crate::harness::fleet::{LOOPBACK, resumed, two_hosts_with};
use crate::harness::{Client, Official, RULES, get, official_reset, postgres_database, program};
use palmares_tasks::{Scenes, Seed};
use serde_json::{Value, json};
use std::process::{Command, Stdio};
use tempfile::TempDir;

const PER_TEAM: &str = "scenes = \"per_team\"\n";

fn text(value: &Value) -> String {
    value.as_str().expect("a text").to_owned()
}

/// The seed that the rules promise, from the file of the secret.
fn promised(cup: &Official, scenes: Scenes, k: u64, team: &str) -> String {
    let file = std::fs::read_to_string(cup.folder().join("seed.secret")).expect("the secret");
    let digits = file.trim().as_bytes();
    let byte = |pair: &[u8]| u8::from_str_radix(str::from_utf8(pair).expect("digits"), 16).expect("digits");
    let secret: Vec<u8> = digits.chunks(2).map(byte).collect();
    Seed::for_run(&secret, scenes, "balls", k, team).to_hex()
}

/// Plays a run of some ticks; returns its objects at the start and its result.
async fn play(client: &mut Client) -> (Value, Value) {
    let obs = client.ask(official_reset()).await;
    client.goes_on(0).await;
    (obs["truth"]["objects"].clone(), client.ask(json!({"op": "stop"})).await)
}

#[tokio::test]
async fn every_team_has_its_own_scenes_if_the_rules_say_so() {
    let mut databases = vec![None];
    databases.extend(postgres_database().await.map(Some));
    for database in databases {
        let rules = format!("{RULES}{PER_TEAM}");
        let cup = Official::start_on(TempDir::new().expect("a folder"), &rules, database);
        let teams = ["crabs", "eels"].map(|name| (name, cup.team(name)));
        cup.open();
        assert_eq!(get(&cup.server, "/v1/competition").json()["scenes"], "per_team");
        let (mut scenes, mut runs) = (Vec::<Value>::new(), Vec::new());
        for (name, token) in &teams {
            let (mut client, welcome) = cup.greet(token).await;
            assert_eq!(welcome["competition"]["scenes"], "per_team", "{welcome}");
            for k in 1..=2 {
                let (scene, result) = play(&mut client).await;
                assert!(!scenes.contains(&scene), "{name}, run {k}: another run had this scene");
                scenes.push(scene);
                runs.push((name, k, result["run_id"].clone()));
            }
        }
        for (name, k, run_id) in runs {
            cup.verified(&run_id).await;
            let run = cup.get(&format!("/v1/runs/{}", text(&run_id)), &cup.organizer).json();
            assert_eq!(run["k"], k, "{run}");
            assert_eq!(text(&run["seed_hex"]), promised(&cup, Scenes::PerTeam, k, name));
        }
    }
}

#[tokio::test]
async fn whose_scenes_are_played_is_fixed_with_the_first_run() {
    let cup = Official::start();
    let token = cup.team("crabs");
    // Before the first run it may change.
    let (folder, _) = cup.killed();
    let cup = Official::start_on(folder, &format!("{RULES}{PER_TEAM}"), None);
    let (folder, _) = cup.killed();
    let cup = Official::start_on(folder, RULES, None);
    assert_eq!(get(&cup.server, "/v1/competition").json()["scenes"], "shared");
    cup.open();
    let (mut client, _) = cup.greet(&token).await;
    let (_, result) = play(&mut client).await;
    let run = cup.get(&format!("/v1/runs/{}", text(&result["run_id"])), &cup.organizer).json();
    assert_eq!(text(&run["seed_hex"]), promised(&cup, Scenes::Shared, 1, "crabs"));
    let (folder, _) = cup.killed();
    let file = folder.path().join("competition.toml");
    std::fs::write(&file, format!("{RULES}{PER_TEAM}")).expect("rules");
    let mut command = Command::new(program());
    command.args(["serve", "--listen", "127.0.0.1:0", "--data-dir"]).arg(folder.path());
    let output = command.arg("--config").arg(&file).stdin(Stdio::null()).output().expect("runs");
    let log = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && log.contains("scenes = \"per_team\""), "{log}");
    assert!(log.contains("played with scenes = \"shared\""), "{log}");
    let cup = Official::start_on(folder, RULES, None);
    assert_eq!(get(&cup.server, "/v1/competition").json()["scenes"], "shared");
}

#[tokio::test]
async fn a_run_in_a_scene_of_its_team_continues_on_another_host() {
    let Some((first, second, team)) = two_hosts_with(PER_TEAM, LOOPBACK).await else { return };
    let (mut client, welcome, obs) = first.playing(&team).await;
    // The last ticks before a failure are lost.
    let moving = json!({"op": "step", "tick": 0, "action": {"hand": [0.4]}, "repeat": 100});
    assert_eq!(client.ask(moving).await["tick"], 100);
    first.server.kill();
    let (mut back, again) = resumed(&second, &team, &welcome["resume_token"]).await;
    assert_eq!(again["session_id"], welcome["session_id"]);
    let result = back.ask(json!({"op": "stop"})).await;
    assert_eq!(result["run_id"], obs["run_id"], "{result}");
    let (_, next) = play(&mut back).await;
    for (k, result) in [(1, &result), (2, &next)] {
        second.verified(&result["run_id"]).await;
        let run = second.get(&format!("/v1/runs/{}", text(&result["run_id"])), &second.organizer).json();
        assert_eq!(text(&run["seed_hex"]), promised(&second, Scenes::PerTeam, k, "crabs"), "{run}");
    }
}
