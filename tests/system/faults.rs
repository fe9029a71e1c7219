//! Worlds that fail: every report names the fault, its time and advice.

use crate::harness::{Client, Server, get, program};
use crate::impossible::{hand_of_a_billion, no_limits};
use serde_json::{Value, json};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Codes of the worlds that fail here; those of the program itself are not among them.
const CODES: [&str; 4] = ["not_finite", "out_of_bounds", "unsolvable", "work_exhausted"];
/// Longer than any of these commands takes on a busy machine. The test is that they end.
const PATIENCE: Duration = Duration::from_secs(300);

/// A folder with a hand that no world can compute, and a file with limits that let it in.
fn impossible() -> (TempDir, PathBuf, PathBuf) {
    let folder = TempDir::new().expect("temporary directory");
    let (archive, limits) = (folder.path().join("billion.zip"), folder.path().join("limits.toml"));
    std::fs::write(&archive, hand_of_a_billion()).expect("written");
    std::fs::write(&limits, no_limits()).expect("written");
    (folder, archive, limits)
}

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

fn word(value: &Value) -> &str {
    value.as_str().unwrap_or_else(|| panic!("a text, not {value}"))
}

/// The value of a field in a line of the log.
fn field<'a>(line: &'a str, name: &str) -> &'a str {
    let rest = line.split_once(&format!(" {name}=")).unwrap_or_else(|| panic!("no {name} in {line}")).1;
    rest.split(' ').next().unwrap_or_default().trim_matches('"')
}

#[tokio::test]
async fn a_failed_world_is_reported_to_its_team_to_spectators_and_in_the_log() {
    let (_folder, archive, limits) = impossible();
    let server = Server::start_with(&["--config", text(&limits), "--hand", text(&archive)]);
    let (mut client, _) = Client::greet(&server, "billion").await;
    let opened = client.ask(json!({"op": "reset", "task": "grasp", "hand": "billion", "seed": 5})).await;
    assert_eq!(opened["op"], "obs", "{opened}");
    let mut viewer = Client::connect_to(&server, "/v1/watch").await;
    viewer.ask(json!({"op": "subscribe", "featured": true})).await;
    let (mut tick, mut reply) = (0, opened.clone());
    while reply["op"] == "obs" {
        assert!(tick < 500, "this world was computed");
        let action = json!({"hand": [tick % 2, tick % 2]});
        reply = client.ask(json!({"op": "step", "tick": tick, "action": action})).await;
        tick += 1;
    }
    assert_eq!(
        (&reply["op"], &reply["code"], &reply["fatal"]),
        (&json!("error"), &json!("internal"), &json!(false))
    );
    let (fault, message) = (word(&reply["fault"]).to_owned(), word(&reply["message"]));
    assert!(CODES.contains(&fault.as_str()), "{reply}");
    let begins = format!("the world failed ({fault}) in tick {tick}, step ");
    assert!(message.starts_with(&begins), "{message}");
    for part in ["; ", "try ", "is void; reset opens another"] {
        assert!(message.contains(part), "'{part}' is not in {message}");
    }

    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!((&result["reason"], &result["status"]), (&json!("world_fault"), &json!("voided")), "{result}");
    assert_eq!(word(&result["fault"]), fault);
    assert!(word(&result["note"]).starts_with(&begins), "{result}");
    let run_id = word(&result["run_id"]);
    let stored = get(&server, &format!("/v1/runs/{run_id}")).json();
    assert_eq!((&stored["note"], &stored["reason"]), (&result["note"], &json!("world_fault")), "{stored}");
    loop {
        let message = viewer.next().await;
        if message["op"] == "ended" {
            assert_eq!(
                (&message["outcome"], word(&message["fault"])),
                (&Value::Null, fault.as_str()),
                "{message}"
            );
            break;
        }
    }

    // Another run continues, and its result has no fault.
    assert_eq!(
        client.ask(json!({"op": "reset", "task": "grasp", "hand": "pinch", "seed": 5})).await["op"],
        "obs"
    );
    let sound = client.ask(json!({"op": "stop"})).await;
    assert!(sound.get("fault").is_none() && sound.get("note").is_none(), "{sound}");

    let run_id = run_id.to_owned();
    server.signal("TERM");
    let (_, log, _) = server.wait();
    let line = log.lines().find(|line| line.contains("world fault")).unwrap_or_else(|| panic!("{log}"));
    let logged = ["run", "fault", "tick", "task", "hand", "seed"].map(|name| field(line, name));
    let tick = tick.to_string();
    assert_eq!(logged, [run_id.as_str(), fault.as_str(), tick.as_str(), "grasp", "billion", "5"], "{line}");
    let step: u64 = field(line, "step").parse().expect("a number");
    assert!(step <= 10 * tick.parse::<u64>().expect("a number"), "{line}");
    assert!(line.contains("why=") && line.contains("try "), "{line}");
}

#[tokio::test]
async fn the_stream_of_a_failed_world_ends_and_says_why() {
    let (_folder, archive, limits) = impossible();
    let server = Server::start_with(&["--config", text(&limits), "--hand", text(&archive)]);
    let (mut client, _) = Client::greet(&server, "billion").await;
    let request = json!({"op": "reset", "task": "grasp", "hand": "billion", "seed": 1, "mode": "realtime"});
    assert_eq!(client.ask(request).await["op"], "obs");
    let mut last = client.streamed().await;
    let mut id = 1_000;
    while last["truncated"] == false {
        // Answers are not waited for: the last observation may come before one.
        id += 1;
        let k = last["tick"].as_u64().expect("a tick") % 2;
        client.send(&json!({"op": "act", "id": id, "action": {"hand": [k, k]}}).to_string()).await;
        last = client.streamed().await;
    }
    assert_eq!(last["reason"], "world_fault", "{last}");
    let result = client.settled(json!({"op": "stop"})).await;
    assert_eq!((&result["op"], &result["reason"]), (&json!("result"), &json!("world_fault")), "{result}");
    assert!(CODES.contains(&word(&result["fault"])), "{result}");
    assert!(word(&result["note"]).contains("; "), "{result}");
}

/// Exit code, what was printed to stdout, and to stderr; of a command that does not end, a panic.
fn ends(arguments: &[&str]) -> (i32, String, String) {
    let mut command = Command::new(program());
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("palmares runs");
    // Read all the time: a full pipe would stop it.
    let read = |mut pipe: Box<dyn Read + Send>| {
        std::thread::spawn(move || {
            let mut text = String::new();
            pipe.read_to_string(&mut text).expect("UTF-8");
            text
        })
    };
    let out = read(Box::new(child.stdout.take().expect("piped")));
    let err = read(Box::new(child.stderr.take().expect("piped")));
    let begun = Instant::now();
    let status = loop {
        match child.try_wait().expect("waits") {
            Some(status) => break status,
            None if begun.elapsed() > PATIENCE => {
                child.kill().expect("it is ours");
                panic!("{arguments:?} does not end");
            }
            None => std::thread::sleep(Duration::from_millis(20)),
        }
    };
    (status.code().expect("an exit code"), out.join().expect("read"), err.join().expect("read"))
}

#[test]
fn the_tools_for_hands_end_whatever_the_world_does() {
    let (folder, archive, limits) = impossible();
    let hand = text(&archive);
    let says = |text: &str| CODES.iter().any(|code| text.contains(&format!("the world failed ({code})")));

    let (code, out, err) = ends(&["hand", "check", hand, "--sigma", "0.6", "--config", text(&limits)]);
    assert_eq!(code, 1, "{out}{err}");
    assert!(
        says(&out) && out.contains("at σ = 0.6 0.6 the world failed") && out.contains("not usable"),
        "{out}"
    );
    let check = ["hand", "check", hand, "--sigma", "0.6", "--json", "--config", text(&limits)];
    let (code, out, _) = ends(&check);
    assert_eq!(code, 1);
    let report: Value = serde_json::from_str(&out).expect("JSON");
    let broken = &report["closures"][0]["broken_off"];
    assert!(CODES.contains(&word(&broken["fault"])) && broken["step"].is_u64(), "{broken}");

    let picture = folder.path().join("a.svg");
    let (code, out, err) = ends(&["hand", "show", hand, "--output", text(&picture), "--sigma", "0.6"]);
    assert_eq!(code, 1, "{out}{err}");
    assert!(says(&err) && err.contains("closed at σ = 0.6, 0.6: ") && out.contains("wrote "), "{out}{err}");
    assert!(picture.is_file(), "what was simulated is drawn");

    let (code, out, err) = ends(&["hand", "try", hand, "--task", "grasp"]);
    assert_eq!(code, 1, "{out}{err}");
    assert!(says(&out), "{out}");
}

/// A hand of `fingers` fingers of six small links that bend together.
fn hand_of_fingers(fingers: usize) -> String {
    let inertia = "<inertia ixx=\"1e-7\" iyy=\"1e-7\" izz=\"1e-7\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/>";
    let mut urdf = format!(
        "<robot name=\"many\"><link name=\"base\"><inertial><mass value=\"0.3\"/>{inertia}</inertial></link>\n"
    );
    let mut joints = String::new();
    for k in 0..fingers {
        let mut parent = "base".to_owned();
        for i in 0..6 {
            let link = format!("l{k}_{i}");
            let at = match i {
                0 => format!("{} {} 0.012", 0.008 * (k % 10) as f64, 0.01 * (k / 10) as f64),
                _ => "0 0 0.004".to_owned(),
            };
            urdf += &format!(
                "<link name=\"{link}\"><inertial><origin xyz=\"0 0 0.002\"/><mass value=\"0.002\"/>{inertia}</inertial>\
                 <collision><origin xyz=\"0 0 0.002\"/><geometry><box size=\"0.004 0.004 0.0036\"/></geometry></collision></link>\
                 <joint name=\"j{link}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{link}\"/>\
                 <origin xyz=\"{at}\"/><axis xyz=\"1 0 0\"/><limit lower=\"0\" upper=\"1.5\" effort=\"1\" velocity=\"1\"/>\
                 <dynamics damping=\"0.001\"/></joint>\n"
            );
            joints += &format!(
                "<joint name=\"j{link}\"><mechanicalReduction>1</mechanicalReduction>\
                 <mechanicalElasticity>0.02</mechanicalElasticity><offset>0</offset></joint>"
            );
            parent = link;
        }
    }
    let kind = "<type>transmission_interface/AdaptiveSynergyTransmission</type>";
    urdf + &format!("<transmission name=\"t\">{kind}<actuator name=\"m\"/>{joints}</transmission></robot>")
}

#[test]
fn a_hand_of_hundreds_of_links_is_looked_at_to_an_end() {
    let folder = TempDir::new().expect("temporary directory");
    let (hand, limits) = (folder.path().join("hand.urdf"), folder.path().join("limits.toml"));
    std::fs::write(&hand, hand_of_fingers(40)).expect("written");
    let settings = "[motors.m]\nscaling = 120.0\nspeed_limit = 2.0\n[tendons.t]\nstiffness = 100.0\n\
                    force_limit = 2.0\n";
    std::fs::write(folder.path().join("hand.toml"), settings).expect("written");
    let (code, out, _) = ends(&["hand", "check", text(&hand)]);
    assert_eq!(code, 1, "a hand of a competition has fewer links");
    assert!(out.contains("not simulated") && out.contains("hand_limits.links"), "{out}");

    // All limits away.
    let (_, figures, _) = ends(&["hand", "check", "pinch", "--json", "--sigma", "0.1"]);
    let figures: Value = serde_json::from_str(&figures).expect("JSON");
    let limit = |row: &Value| match row["bound"] == "least" {
        true => format!("{} = 0\n", word(&row["figure"])),
        false => format!("{} = inf\n", word(&row["figure"])),
    };
    let all: String = figures["figures"].as_array().expect("a list").iter().map(limit).collect();
    std::fs::write(&limits, format!("[hand_limits]\n{all}")).expect("written");
    let (code, out, err) = ends(&["hand", "check", text(&hand), "--sigma", "0.6", "--config", text(&limits)]);
    let last = out.lines().last().unwrap_or_default();
    let verdict = if code == 0 { ": usable" } else { ": not usable" };
    assert!(last.contains(verdict), "{code}, {last}, {err}");
    if code != 0 {
        assert!(out.contains("\nerror: hand 'many': at σ = 0.6 "), "{out}");
    }
}
