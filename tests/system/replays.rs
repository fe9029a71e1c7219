//! Every run leaves a replay, and replays play again.

use crate::harness::{Client, Server, get, get_bytes, program, reset};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Exit code and what was printed.
fn palmares(arguments: &[&str]) -> (i32, String) {
    with_program(program(), arguments)
}

fn with_program(program: &Path, arguments: &[&str]) -> (i32, String) {
    let output = Command::new(program).args(arguments).output().expect("palmares runs");
    let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).expect("UTF-8")).concat();
    (output.status.code().expect("it ended by itself"), text)
}

/// Moves the hand about for `ticks` ticks.
async fn play(client: &mut Client, ticks: u64) {
    let mut tick = 0;
    while tick < ticks {
        let x = 0.0005 * tick as f64;
        let base = json!({"position": [x, 0.0, 0.8 - x], "quat_xyzw": [0.0, 1.0, 0.0, 0.05]});
        let mut action = json!({"base": base, "hand": [0.003 * tick as f64]});
        if tick == 50 {
            action["effort"] = json!([0.4]);
        }
        let obs = client.ask(json!({"op": "step", "tick": tick, "repeat": 10, "action": action})).await;
        assert_eq!(obs["op"], "obs", "{obs}");
        tick = obs["tick"].as_u64().expect("a tick");
    }
}

async fn stop(client: &mut Client) -> Value {
    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!(result["op"], "result", "{result}");
    result
}

/// Fetches a run's replay into a folder.
fn fetch(server: &Server, run_id: &str, folder: &TempDir) -> PathBuf {
    let (status, bytes) = get_bytes(server, &format!("/v1/runs/{run_id}/replay"));
    assert_eq!(status, 200, "{}", String::from_utf8_lossy(&bytes));
    let path = folder.path().join("run.mcap");
    std::fs::write(&path, bytes).expect("written");
    path
}

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

#[tokio::test]
async fn a_run_leaves_a_replay_that_verifies() {
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "crabs").await;
    play(&mut client, 120).await;
    let result = stop(&mut client).await;
    let run_id = result["run_id"].as_str().expect("an id");
    let folder = TempDir::new().expect("temporary directory");
    let file = fetch(&server, run_id, &folder);
    let size = std::fs::metadata(&file).expect("file").len();
    assert_eq!(result["replay"]["bytes"], size, "{result}");
    let stored = std::fs::read(server.folder().join("replays").join(format!("{run_id}.mcap")));
    assert_eq!(stored.expect("in the data directory"), std::fs::read(&file).expect("file"));

    let listed = |path: &str| get(&server, path).json()["runs"].as_array().map(Vec::len);
    let newest = get(&server, "/v1/runs?task=balls&limit=5").json();
    assert_eq!(newest["runs"][0]["run_id"], result["run_id"], "{newest}");
    assert!(newest["runs"][0]["score"].is_number() && newest["runs"][0].get("events").is_none(), "{newest}");
    assert_eq!((listed("/v1/runs"), listed("/v1/runs?team=lobsters")), (Some(1), Some(0)));
    get(&server, "/v1/runs?of=crabs").assert_problem(400, "bad_request");

    let competition = get(&server, "/v1/competition").json();
    let key = competition["replay_key"].as_str().expect("a key");
    let (code, out) = palmares(&["verify", text(&file), "--key", key, "--json"]);
    assert_eq!(code, 0, "{out}");
    let verdict: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!((&verdict["verdict"], &verdict["run_id"]), (&json!("verified"), &result["run_id"]));
    assert_eq!((&verdict["ticks"], &verdict["score"]), (&json!(120), &result["score"]));

    let other = "3b6a27bcceb6a42d62a3a8d02a6f0d73653215771de243a63ac048a18b59da29";
    let (code, out) = palmares(&["verify", text(&file), "--key", other]);
    assert_eq!(code, 1, "{out}");
    assert!(out.contains("refused: bad_signature: signed by") && out.contains(key), "{out}");

    let (code, out) = palmares(&["replay", text(&file)]);
    assert_eq!(code, 0, "{out}");
    for part in ["crabs", "balls", "softhand", "120 ticks", "stopped", key, "(number 7)"] {
        assert!(out.contains(part), "'{part}' is not in:\n{out}");
    }
    assert!(out.contains(result["replay"]["sha256"].as_str().expect("a hash")), "{out}");
    let (code, out) = palmares(&["replay", text(&file), "--csv"]);
    assert_eq!(code, 0, "{out}");
    let mut lines = out.lines();
    assert_eq!(lines.next(), Some("time_s,body,x,y,z,qx,qy,qz,qw"));
    assert!(lines.all(|line| line.split(',').count() == 9), "{out}");
    assert!(out.contains(",ball_3,") && out.contains("\n0.000,hand/"), "{out}");

    let mut bytes = std::fs::read(&file).expect("file");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    std::fs::write(&file, &bytes).expect("written");
    let (code, out) = palmares(&["verify", text(&file)]);
    assert!(code == 1 && out.contains("refused: "), "{out}");
}

#[tokio::test]
async fn a_run_becomes_a_film_and_a_picture() {
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "crabs").await;
    play(&mut client, 60).await;
    let run_id = stop(&mut client).await["run_id"].as_str().expect("an id").to_owned();
    let folder = TempDir::new().expect("temporary directory");
    let file = fetch(&server, &run_id, &folder);
    let url = format!("http://{}", server.address());
    let out = |name: &str| folder.path().join(name);

    let (gif, png, top) = (out("run.gif"), out("run.png"), out("top.png"));
    let gif_options = ["--output", text(&gif), "--size", "80x60", "--fps", "10", "--to", "0.3"];
    let (code, said) = palmares(&[&["render", text(&file)][..], &gif_options].concat());
    assert!(code == 0 && said.contains("4 pictures of 80 × 60 pixels"), "{said}");
    let bytes = std::fs::read(&gif).expect("written");
    assert_eq!((&bytes[..6], bytes[6..10].as_ref()), (&b"GIF89a"[..], &[80, 0, 60, 0][..]));

    // The same run by its id, of the server.
    let (code, said) =
        palmares(&["render", &run_id, "--url", &url, "--output", text(&png), "--size", "64x48"]);
    assert!(code == 0 && said.contains("a picture of 64 × 48 pixels"), "{said}");
    let (code, said) =
        palmares(&["render", text(&file), "-o", text(&top), "--camera", "box_a", "--from", "0.1"]);
    assert!(code == 0 && said.contains("a picture of 320 × 240 pixels"), "{said}");
    for picture in [&png, &top] {
        assert!(std::fs::read(picture).expect("written").starts_with(b"\x89PNG"));
    }

    for (options, wanted) in [
        (vec!["--camera", "box_c"], "--camera: no camera `box_c`; there are: box_a, box_b, wrist, film"),
        (vec!["--size", "3000x2000"], "--size: a picture of 3000 × 2000 pixels"),
        (vec!["--from", "9"], "--from 9: the run ends after 0.6 s"),
    ] {
        let (code, said) =
            palmares(&[&["render", text(&file), "-o", text(&out("no.gif"))][..], &options].concat());
        assert!(code == 1 && said.contains(wanted), "{said}");
    }
    let (code, said) =
        palmares(&["render", "run_0000000000000000", "--url", &url, "-o", text(&out("no.gif"))]);
    assert!(code == 1 && said.contains("404"), "{said}");
    assert!(!out("no.gif").exists());

    let mut bytes = std::fs::read(&file).expect("file");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    std::fs::write(&file, &bytes).expect("written");
    let (code, said) = palmares(&["render", text(&file), "-o", text(&out("no.gif"))]);
    assert!(code == 1 && said.contains("refused: "), "{said}");
}

/// Without any ffmpeg an .mp4 is refused before the simulation, with the packages that help; with one it is a film.
#[test]
fn a_film_as_mp4_needs_ffmpeg() {
    let folder = TempDir::new().expect("temporary directory");
    let film = folder.path().join("run.mp4");
    // The recording is looked for first.
    let recording = folder.path().join("run.mcap");
    std::fs::write(&recording, "").expect("written");
    let mut command = Command::new(program());
    command.args(["render", text(&recording), "-o", text(&film)]);
    command.env("PATH", folder.path()).env("PALMARES_PYTHON", folder.path().join("no_python"));
    let output = command.output().expect("palmares runs");
    let said = String::from_utf8(output.stderr).expect("UTF-8");
    assert!(said.contains("needs ffmpeg: `pip install imageio-ffmpeg`"), "{said}");
    assert!(said.contains("or an ffmpeg on the PATH; .gif and .png need neither"), "{said}");
}

#[tokio::test]
async fn pushes_and_real_time_replay_too() {
    let server = Server::start();
    let (mut client, _) = Client::greet(&server, "crabs").await;
    let folder = TempDir::new().expect("temporary directory");
    let link = get(&server, "/v1/hands/pinch").json()["links"][1]["name"].clone();
    for mode in ["lockstep", "realtime"] {
        let request = json!({"op": "reset", "task": "balls", "hand": "pinch", "seed": 3, "mode": mode});
        let obs = client.ask(request).await;
        assert_eq!(obs["op"], "obs", "{obs}");
        let push = json!({"op": "perturb", "link": link, "wrench": {"force": [0.0, 2.0, 0.0], "torque": [0.0, 0.0, 0.0]},
                          "duration_s": 0.1});
        if mode == "lockstep" {
            let ack = client.ask(push).await;
            assert_eq!(ack["op"], "ack", "{ack}");
            let action = json!({"hand": [0.5, 0.5]});
            client.ask(json!({"op": "step", "tick": 0, "repeat": 60, "action": action})).await;
        } else {
            // Observations come in between; only the answers count.
            client.send(&json!({"op": "act", "id": 1001, "action": {"hand": [0.4, 0.6]}}).to_string()).await;
            let mut pushed = push;
            pushed["id"] = json!(1002);
            client.send(&pushed.to_string()).await;
            let mut tick = 0;
            while tick < 60 {
                let message = client.next().await;
                assert_ne!(message["op"], "error", "{message}");
                tick = message["tick"].as_u64().unwrap_or(tick);
            }
        }
        client.send(&json!({"op": "stop", "id": 2000}).to_string()).await;
        let mut result = client.next().await;
        while result["op"] != "result" {
            result = client.next().await;
        }
        let file = fetch(&server, result["run_id"].as_str().expect("an id"), &folder);
        let (code, out) = palmares(&["verify", text(&file)]);
        assert_eq!(code, 0, "{mode}: {out}");
    }
}

#[tokio::test]
async fn a_killed_server_leaves_a_cut_file_that_makes_room_like_any_other() {
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "crabs").await;
    play(&mut client, 200).await;
    let folder = server.kill();
    let files: Vec<PathBuf> = std::fs::read_dir(folder.path().join("replays"))
        .expect("folder")
        .map(|entry| entry.expect("entry").path())
        .collect();
    let [file] = files.as_slice() else { panic!("{files:?}") };
    let (code, out) = palmares(&["verify", text(file)]);
    assert_eq!(code, 1, "{out}");
    assert!(out.contains("refused: truncated: "), "{out}");
    // Files of others are left alone.
    let notes = folder.path().join("replays/notes.mcap");
    std::fs::write(&notes, "mine").expect("written");
    let server = Server::start_in(folder, &["--practice-replays-mb", "0"]);
    let start = Instant::now();
    while file.exists() {
        assert!(start.elapsed() < Duration::from_secs(40), "the cut file stays");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    let (mut client, _) = Client::playing(&server, "crabs").await;
    // The file of an open run also stays, even if other runs end.
    let (mut other, _) = Client::playing(&server, "eels").await;
    play(&mut other, 10).await;
    let ended = stop(&mut other).await;
    let path = |result: &Value| {
        let run_id = result["run_id"].as_str().expect("an id");
        server.folder().join("replays").join(format!("{run_id}.mcap"))
    };
    while path(&ended).exists() {
        assert!(start.elapsed() < Duration::from_secs(120), "the file stays");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    let open = client.ask(json!({"op": "time"})).await["run"].clone();
    assert!(path(&open).exists() && notes.exists(), "{open}");
}

#[tokio::test]
async fn recording_can_be_turned_off_and_old_replays_go() {
    let server = Server::start_with(&["--no-replays"]);
    let (mut client, _) = Client::playing(&server, "crabs").await;
    play(&mut client, 10).await;
    let result = stop(&mut client).await;
    assert_eq!(result["replay"], Value::Null, "{result}");
    let path = format!("/v1/runs/{}/replay", result["run_id"].as_str().expect("an id"));
    get(&server, &path).assert_problem(404, "not_found");
    get(&server, "/v1/runs/run_none/replay").assert_problem(404, "not_found");
    assert_eq!(get(&server, "/v1/competition").json()["replay_key"], Value::Null);

    let server = Server::start_with(&["--practice-replays-mb", "0"]);
    let (mut client, _) = Client::playing(&server, "crabs").await;
    play(&mut client, 10).await;
    let result = stop(&mut client).await;
    let run_id = result["run_id"].as_str().expect("an id");
    assert!(result["replay"]["bytes"].is_u64(), "{result}");
    let start = Instant::now();
    while server.folder().join("replays").join(format!("{run_id}.mcap")).exists() {
        assert!(start.elapsed() < Duration::from_secs(120), "the file stays");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    assert_eq!(get(&server, &format!("/v1/runs/{run_id}")).json()["score"], result["score"]);
}

#[tokio::test]
async fn a_hand_of_ones_own_verifies_without_its_folder() {
    let hand = TempDir::new().expect("temporary directory");
    let pinch = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/hands/pinch");
    for file in ["hand.urdf", "hand.toml"] {
        let text = std::fs::read_to_string(pinch.join(file)).expect("part of the source");
        std::fs::write(hand.path().join(file), text.replace("name = \"pinch\"", "name = \"claw\""))
            .expect("written");
    }
    let server = Server::start_with(&["--hand", text(hand.path())]);
    let (mut client, _) = Client::greet(&server, "crabs").await;
    let obs = client.ask(json!({"op": "reset", "task": "balls", "hand": "claw", "seed": 3})).await;
    assert_eq!(obs["op"], "obs", "{obs}");
    client.ask(json!({"op": "step", "tick": 0, "repeat": 30, "action": {"hand": [0.5, 0.2]}})).await;
    let result = stop(&mut client).await;
    let folder = TempDir::new().expect("temporary directory");
    let file = fetch(&server, result["run_id"].as_str().expect("an id"), &folder);
    drop((server, hand));
    let (code, out) = palmares(&["verify", text(&file)]);
    assert_eq!(code, 0, "{out}");
    assert!(out.contains("balls with claw"), "{out}");
}

#[tokio::test]
async fn a_run_verifies_while_eight_worlds_run() {
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "crabs").await;
    play(&mut client, 100).await;
    let result = stop(&mut client).await;
    let folder = TempDir::new().expect("temporary directory");
    let file = fetch(&server, result["run_id"].as_str().expect("an id"), &folder);
    let mut others = Vec::new();
    for k in 0..8 {
        let (mut client, _) = Client::greet(&server, &format!("team {k}")).await;
        let mut request = reset();
        request["seed"] = json!(k);
        assert_eq!(client.ask(request).await["op"], "obs");
        others.push(client);
    }
    let verifying = tokio::task::spawn_blocking(move || palmares(&["verify", text(&file)]));
    let worlds: Vec<_> = others
        .into_iter()
        .map(|mut client| {
            tokio::spawn(async move {
                play(&mut client, 40).await;
                let result = stop(&mut client).await;
                result["run_id"].as_str().expect("an id").to_owned()
            })
        })
        .collect();
    let (code, out) = verifying.await.expect("verified");
    assert_eq!(code, 0, "{out}");
    for (k, world) in worlds.into_iter().enumerate() {
        let run_id = world.await.expect("played");
        // One of the simultaneous runs is enough.
        if k == 7 {
            let (code, out) = palmares(&["verify", text(&fetch(&server, &run_id, &folder))]);
            assert_eq!(code, 0, "{out}");
        }
    }
}

/// The program in the other profile, if it has been built from the same source.
fn other_build() -> Result<PathBuf, String> {
    let own = program();
    let (target, profile) = (own.parent().and_then(Path::parent), own.parent().and_then(Path::file_name));
    let (Some(target), Some(profile)) = (target, profile) else { return Err("no target directory".into()) };
    let other = target
        .join(if profile == "release" { "debug" } else { "release" })
        .join(own.file_name().unwrap_or_default());
    if other.exists() { Ok(other) } else { Err(format!("{} is not built", other.display())) }
}

#[tokio::test]
async fn a_run_of_one_build_verifies_in_the_other() {
    let other = match other_build() {
        Ok(other) => other,
        Err(why) => return println!("SKIP: {why}"),
    };
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "crabs").await;
    play(&mut client, 250).await;
    let result = stop(&mut client).await;
    let folder = TempDir::new().expect("temporary directory");
    let file = fetch(&server, result["run_id"].as_str().expect("an id"), &folder);
    let (code, out) = with_program(&other, &["verify", text(&file)]);
    if out.contains("refused: other_") || out.contains("unrecognized subcommand") {
        return println!("SKIP: {} was built from another source: {out}", other.display());
    }
    assert_eq!(code, 0, "{out}");
}
