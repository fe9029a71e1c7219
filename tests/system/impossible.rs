//! Hands that no world can compute, played by several teams at once: other teams, network and signals still
//! work.

use crate::hands_upload::claw_from;
use crate::harness::{Client, Server, get, send};
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;
use tempfile::TempDir;
use tokio::task::JoinHandle;

/// Teams with such a hand.
const WORLDS: usize = 4;
/// Ticks of the team that plays at the same time.
const TICKS: u64 = 100;

/// Limits that let such a hand in.
pub(crate) fn no_limits() -> String {
    let figures = [
        "joint_torque_nm",
        "moment_arm",
        "tendon_stiffness",
        "tendon_force",
        "motor_scaling",
        "motor_speed_per_s",
        "motor_power_w",
    ];
    format!(
        "mode = \"practice\"\n[hand_limits]\n{}",
        figures.map(|figure| format!("{figure} = inf\n")).concat()
    )
}

/// The pinch hand with 1e9 for force, stiffness, winding and speed, its tendons slack at first.
pub(crate) fn hand_of_a_billion() -> Vec<u8> {
    let set = |text: String, fields: &[(&str, &str)]| {
        let change = |line: &str| match fields.iter().find(|(field, _)| line.trim_start().starts_with(field))
        {
            Some((field, value)) => format!("{field}{value}\n"),
            None => format!("{line}\n"),
        };
        text.lines().map(change).collect::<String>()
    };
    let urdf = [("<offset>", "0</offset>")];
    let billion = ["scaling", "speed_limit", "stiffness", "force_limit"].map(|field| (field, " = 1e9"));
    let settings = [&billion[..], &[("offset", " = 0.0")]].concat();
    claw_from("billion", &|text| set(text, &urdf), &|text| set(text, &settings))
}

/// Opens runs and steps them until `over` is set; counts worlds that failed.
async fn attack(server: Arc<Server>, team: String, over: Arc<AtomicBool>, failed: Arc<AtomicUsize>) {
    let (mut client, _) = Client::greet(&server, &team).await;
    'runs: while !over.load(Ordering::Relaxed) {
        let opened = client.ask(json!({"op": "reset", "task": "grasp", "hand": "billion", "seed": 1})).await;
        assert_eq!(opened["op"], "obs", "{opened}");
        for tick in 0..200 {
            if over.load(Ordering::Relaxed) {
                return;
            }
            let action = json!({"hand": [tick % 2, tick % 2]});
            let reply = client.ask(json!({"op": "step", "tick": tick, "action": action})).await;
            if reply["op"] == "error" {
                assert_eq!(reply["code"], "internal", "{reply}");
                failed.fetch_add(1, Ordering::Relaxed);
                let result = client.ask(json!({"op": "stop"})).await;
                assert_eq!(result["reason"], "world_fault", "{result}");
                continue 'runs;
            }
        }
        panic!("a world with a hand of a billion was computed to its end");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn worlds_that_cannot_be_computed_keep_nobody_from_playing() {
    let folder = TempDir::new().expect("temporary directory");
    let config = folder.path().join("competition.toml");
    std::fs::write(&config, no_limits()).expect("rules");
    let config = config.to_str().expect("UTF-8").to_owned();
    let server = Arc::new(Server::start_with(&["--config", &config]));
    let (over, failed) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicUsize::new(0)));
    let mut attackers = Vec::new();
    for k in 0..WORLDS {
        let team = format!("billion{k}");
        let sent = send(&server, "POST", &format!("/v1/hands?team={team}"), "", &hand_of_a_billion());
        assert_eq!(sent.status, 201, "{}", sent.body);
        attackers.push(tokio::spawn(attack(server.clone(), team, over.clone(), failed.clone())));
    }
    let (mut client, _) = Client::playing(&server, "innocent").await;
    let mut tick = 0;
    // Until each of the others has failed once at least.
    while tick < TICKS || failed.load(Ordering::Relaxed) < WORLDS {
        client.goes_on(tick).await;
        if tick % 20 == 0 {
            assert_eq!(get(&server, "/healthz").status, 200);
        }
        tick += 1;
        assert!(!attackers.iter().any(JoinHandle::is_finished), "an attacker did not go on");
    }
    over.store(true, Ordering::Relaxed);
    for attacker in attackers {
        tokio::time::timeout(Duration::from_secs(120), attacker)
            .await
            .expect("answered")
            .expect("as expected");
    }
    let result: Value = client.ask(json!({"op": "stop"})).await;
    assert_eq!((&result["op"], &result["ticks"]), (&json!("result"), &json!(tick)), "{result}");
    let server = Arc::into_inner(server).expect("nobody uses it any more");
    server.signal("TERM");
    let (status, log, _) = server.wait();
    assert_eq!(status.code(), Some(0), "{log}");
}
