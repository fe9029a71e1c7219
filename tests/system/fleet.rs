//! Several servers that share one competition on a Postgres database.

use crate::harness::fleet::{
    LOOPBACK, TAKEN_OVER, free_port, host, resumed, rules, two_hosts, two_hosts_with,
};
use crate::harness::{
    Client, Official, RULES, assert_error, get, official_reset as reset, postgres_database, program,
};
use serde_json::{Value, json};
use std::os::unix::fs::PermissionsExt;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Starts a server that must refuse to start; returns the last line of its log.
fn refuses_to_start(url: &str, config: &str) -> String {
    let folder = TempDir::new().expect("temporary directory");
    let file = folder.path().join("competition.toml");
    std::fs::write(&file, config).expect("rules");
    let mut command = Command::new(program());
    command.args(["serve", "--listen", "127.0.0.1:0", "--data-dir"]).arg(folder.path());
    command.arg("--config").arg(&file).args(["--database-url", url]).stdin(Stdio::null());
    let output = command.output().expect("runs");
    assert!(!output.status.success(), "it started");
    String::from_utf8_lossy(&output.stderr).lines().last().unwrap_or_default().to_owned()
}

/// Ends all connections to the database, as its restart does.
async fn end_connections(url: &str) {
    use sqlx::{ConnectOptions, Executor};
    let options: sqlx::postgres::PgConnectOptions = url.parse().expect("URL");
    let mut connection = options.connect().await.expect("connects");
    let all = "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = current_database() \
               AND pid <> pg_backend_pid()";
    connection.execute(all).await.expect("ends them");
}

#[tokio::test]
async fn a_second_server_is_refused_also_after_the_database_was_away() {
    let Some(url) = postgres_database().await else { return };
    let first = Official::start_on(TempDir::new().expect("temporary directory"), RULES, Some(url.clone()));
    first.open();
    let (mut client, _, obs) = first.playing(&first.team("crabs")).await;
    client.goes_on(0).await;
    end_connections(&url).await;
    tokio::time::sleep(Duration::from_millis(1500)).await;
    let refused = refuses_to_start(&url, RULES);
    assert!(refused.contains("in use by another server"), "{refused}");
    let refused = refuses_to_start(&url, &rules("h1", free_port()));
    assert!(refused.contains("only if each has [fleet]"), "{refused}");
    client.goes_on(1).await;
    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!(result["status"], "provisional", "{result}");
    first.verified(&obs["run_id"]).await;
}

#[tokio::test]
async fn a_server_that_was_only_stopped_loses_its_place_and_changes_nothing_afterwards() {
    let Some(url) = postgres_database().await else { return };
    let first = Official::start_on(TempDir::new().expect("temporary directory"), RULES, Some(url.clone()));
    first.open();
    let team = first.team("crabs");
    let (mut client, welcome, obs) = first.playing(&team).await;
    client.goes_on(0).await;
    first.server.signal("STOP");
    let folder = TempDir::new().expect("temporary directory");
    for file in ["seed.secret", "signing.key", "organizer.token"] {
        std::fs::copy(first.server.folder().join(file), folder.path().join(file)).expect("it has it");
    }
    let second = Official::start_on(folder, RULES, Some(url));
    first.server.signal("CONT");
    // Its successor has aborted the run; its own result is refused.
    client.try_send(&json!({"op": "stop", "id": 77}).to_string()).await;
    let (status, log, _folder) = first.server.wait();
    assert!(log.contains("another process has taken this server's place"), "{status}");
    let run =
        second.get(&format!("/v1/runs/{}", obs["run_id"].as_str().expect("id")), &second.organizer).json();
    assert_eq!(run["status"], "aborted", "{run}");
    let (mut client, again) = resumed(&second, &team, &welcome["resume_token"]).await;
    assert_eq!(again["session_id"], welcome["session_id"]);
    assert_eq!(client.ask(reset()).await["op"], "obs");
}

#[tokio::test]
async fn a_session_outlives_its_host() {
    let Some((first, second, team)) = two_hosts().await else { return };
    let (mut client, welcome) = first.greet(&team).await;
    assert_eq!(client.ask(reset()).await["op"], "obs");
    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!(result["op"], "result", "{result}");
    // While its client is connected the other host does not get it by the team's token.
    let mut other = second.connect(&team).await;
    assert_error(&other.ask(json!({"op": "hello", "client": "test"})).await, "session_taken", false);
    // With the resume token it does.
    let (mut moved, again) = resumed(&second, &team, &welcome["resume_token"]).await;
    assert_eq!(again["session_id"], welcome["session_id"]);
    assert_eq!(client.closed().await, (1012, "session_moved".into()));
    assert_eq!(moved.ask(reset()).await["op"], "obs");
    assert_eq!(moved.ask(json!({"op": "stop"})).await["op"], "result");
    let before = moved.ask(json!({"op": "time"})).await;
    drop(moved);
    let began = Instant::now();
    second.server.kill();
    let (mut back, again) = resumed(&first, &team, &welcome["resume_token"]).await;
    assert!(began.elapsed() < 2 * TAKEN_OVER, "{:?}", began.elapsed());
    assert_eq!(again["session_id"], welcome["session_id"]);
    let after = back.ask(json!({"op": "time"})).await;
    let seconds = |time: &Value| time["elapsed_s"].as_f64().expect("seconds");
    assert!(seconds(&after) < seconds(&before) + 1.0, "{before} {after}");
    assert_eq!(back.ask(reset()).await["op"], "obs");
}

#[tokio::test]
async fn a_host_that_stops_gives_its_sessions_away() {
    let Some((first, second, team)) = two_hosts().await else { return };
    let (mut client, welcome) = first.greet(&team).await;
    let waiting = first.team("eels");
    let (gone, other) = first.greet(&waiting).await;
    drop(gone);
    first.server.signal("TERM");
    assert_eq!(client.closed().await, (1012, "server_restart".into()));
    let began = Instant::now();
    for (team, welcome) in [(&team, &welcome), (&waiting, &other)] {
        let (_, again) = resumed(&second, team, &welcome["resume_token"]).await;
        assert_eq!(again["session_id"], welcome["session_id"]);
    }
    // Without waiting for the end of a lease.
    assert!(began.elapsed() < Duration::from_secs(2), "{:?}", began.elapsed());
    assert!(first.server.wait().0.success());
}

#[tokio::test]
async fn an_organizers_command_reaches_the_host_that_has_the_session() {
    let Some((first, second, team)) = two_hosts().await else { return };
    let (mut client, welcome) = first.greet(&team).await;
    let session = json!({"session_id": welcome["session_id"], "reason": "a test"});
    second.order("session/pause", session.clone());
    assert_eq!(client.ask(json!({"op": "time"})).await["paused"], true);
    assert_error(&client.ask(reset()).await, "wrong_state", false);
    second.order("session/resume", session.clone());
    assert_eq!(client.ask(reset()).await["op"], "obs");
    client.goes_on(0).await;
    second.order("session/end", session);
    assert_eq!(client.next().await["op"], "result");
    // The phase of the competition is one for all.
    second.order("competition/close", json!({}));
    tokio::time::sleep(Duration::from_millis(1500)).await;
    let eels = first.team("eels");
    let mut late = first.connect(&eels).await;
    assert_error(&late.ask(json!({"op": "hello", "client": "test"})).await, "wrong_state", false);
    // A revoked token ends its connections everywhere.
    second.order("competition/open", json!({}));
    tokio::time::sleep(Duration::from_millis(1500)).await;
    let (mut client, _) = first.greet(&eels).await;
    second.order("team/revoke", json!({"team": "eels", "reason": "a test"}));
    assert_error(&client.next().await, "not_authorized", true);
}

#[tokio::test]
async fn worlds_and_queues_of_all_hosts_are_counted() {
    let Some((first, second, crabs)) = two_hosts_with("max_worlds = 1\n", LOOPBACK).await else { return };
    let eels = first.team("eels");
    // Both come before a world is open: the fleet then keeps the other place in reserve.
    let ((mut playing, _), (mut waiting, _)) = (first.greet(&crabs).await, first.greet(&eels).await);
    assert_eq!(playing.ask(reset()).await["op"], "obs");
    for host in [&first, &second] {
        let began = Instant::now();
        let competition = loop {
            // It asks again, and stays in the queue.
            assert_eq!(waiting.ask(reset()).await["code"], "capacity");
            let competition = get(&host.server, "/v1/competition").json();
            if competition["worlds"]["waiting"] == 1 && competition["worlds"]["max"] == 2 {
                break competition;
            }
            assert!(began.elapsed() < Duration::from_secs(20), "{competition}");
            tokio::time::sleep(Duration::from_millis(100)).await;
        };
        let worlds = &competition["worlds"];
        assert_eq!((&worlds["max"], &worlds["busy"]), (&json!(2), &json!(1)), "{competition}");
        let places = &competition["places"];
        assert_eq!((&places["total"], &places["playing"]), (&json!(2), &json!(1)), "{competition}");
        // The one that waits takes the other host's place.
        assert!(places["free_within_s"].as_f64().is_some_and(|within| within > 500.0), "{competition}");
        let sessions = host.get("/v1/sessions", &eels).json();
        assert_eq!(sessions["sessions"][0]["place_in_queue"], 1, "{sessions}");
    }
    // The free place is kept for the world of the host that has one.
    let mut late = second.connect(&first.team("squids")).await;
    let refused = late.ask(json!({"op": "hello", "client": "test"})).await;
    assert_error(&refused, "capacity", false);
    let message = refused["message"].as_str().expect("text");
    assert!(message.contains("free places: 1; kept in case that a host fails: 1"), "{message}");
    playing.ask(json!({"op": "stop"})).await;
    assert_eq!(waiting.ask(reset()).await["op"], "obs");
}

#[tokio::test]
async fn a_host_that_does_not_fit_is_refused() {
    let Some((first, _second, _)) = two_hosts().await else { return };
    let url = first.database_url.clone().expect("Postgres");
    let refused = refuses_to_start(&url, RULES);
    assert!(refused.contains("only if each has [fleet]"), "{refused}");
    let refused = refuses_to_start(&url, &rules("h1", free_port()));
    assert!(refused.contains("has a host `h1` that runs"), "{refused}");
    let other = rules("h3", free_port()).replace("session_s = 600", "session_s = 601");
    let refused = refuses_to_start(&url, &other);
    assert!(refused.contains("whose competition.toml, tasks or hands differ"), "{refused}");
    let refused = refuses_to_start("sqlite:///tmp/x.sqlite", &rules("h3", free_port()));
    assert!(refused.contains("a fleet needs a Postgres database"), "{refused}");
}

/// A step whose action depends on the tick.
fn moving(tick: u64) -> Value {
    let hand = if (tick / 30).is_multiple_of(2) { [0.4, 0.6] } else { [0.7, 0.2] };
    json!({"op": "step", "tick": tick, "action": {"hand": hand}})
}

/// Steps a run of the hand `pinch`; returns the observations' state of the hand, which is the same in another process.
async fn play(client: &mut Client, from: u64, to: u64) -> Vec<Value> {
    let mut hands = Vec::new();
    for tick in from..to {
        let obs = client.ask(moving(tick)).await;
        assert_eq!((&obs["op"], &obs["tick"]), (&json!("obs"), &json!(tick + 1)), "{obs}");
        hands.push(obs["hand"].clone());
    }
    hands
}

/// Waits until the run of the welcome is here, and checks that it has gone back by no more than is promised. In real time it can be ahead
/// of the last observation that has arrived.
fn went_back_to(welcome: &Value, run_id: &Value, reached: u64) -> u64 {
    assert_eq!(&welcome["run"]["run_id"], run_id, "{welcome}");
    let tick = welcome["run"]["tick"].as_u64().expect("a tick");
    assert!(reached.saturating_sub(tick) <= 25, "from {reached} to {tick}");
    tick
}

#[tokio::test]
async fn a_lockstep_run_continues_on_another_host_bit_for_bit() {
    let Some((first, second, team)) = two_hosts().await else { return };
    let (mut client, welcome) = first.greet(&team).await;
    let obs = client.ask(json!({"op": "reset", "task": "balls", "hand": "pinch"})).await;
    assert_eq!(obs["op"], "obs", "{obs}");
    let played = play(&mut client, 0, 230).await;
    let before = client.ask(json!({"op": "time"})).await;
    let first_folder = first.server.folder().to_owned();
    let keys = ["seed.secret", "signing.key", "organizer.token"]
        .map(|file| (file, std::fs::read(first_folder.join(file)).expect("it has it")));
    let url = first.database_url.clone().expect("Postgres");
    drop(first.server.kill());
    let (mut client, again) = resumed(&second, &team, &welcome["resume_token"]).await;
    let tick = went_back_to(&again, &obs["run_id"], 230);
    let after = client.ask(json!({"op": "time"})).await;
    let elapsed = |time: &Value| time["elapsed_s"].as_f64().expect("seconds");
    assert!(elapsed(&after) < elapsed(&before) + 0.5, "the outage costs nothing: {before} {after}");
    // The same steps give the same observations.
    assert_eq!(play(&mut client, tick, 230).await, played[tick as usize..]);
    let played = play(&mut client, 230, 260).await;
    // Another one: a host that stops in good order loses no tick.
    let third = {
        let folder = TempDir::new().expect("temporary directory");
        for (file, bytes) in &keys {
            let path = folder.path().join(file);
            std::fs::write(&path, bytes).expect("written");
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600)).expect("private");
        }
        let port = free_port();
        let listen = format!("127.0.0.1:{port}");
        Official::start_with(folder, &rules("h3", port), Some(url), &["--listen", &listen])
    };
    second.server.signal("TERM");
    assert_eq!(client.closed().await, (1012, "server_restart".into()));
    let (mut client, again) = resumed(&third, &team, &welcome["resume_token"]).await;
    assert_eq!(went_back_to(&again, &obs["run_id"], 260), 260);
    // A client that missed the last observation gets it from this host, too; the world makes no tick for it.
    let missed = client.ask(moving(259)).await;
    assert_eq!((&missed["tick"], &missed["hand"]), (&json!(260), &played[29]), "{missed}");
    client.refused(moving(259), "stale_tick").await;
    play(&mut client, 260, 300).await;
    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!((&result["status"], &result["ticks"]), (&json!("provisional"), &json!(300)), "{result}");
    third.verified(&obs["run_id"]).await;
}

#[tokio::test]
async fn a_run_is_closed_also_if_its_session_ends_while_its_host_is_away() {
    let Some((first, second, team)) = two_hosts().await else { return };
    let eels = first.team("eels");
    let pinch = json!({"op": "reset", "task": "balls", "hand": "pinch"});
    let mut runs = Vec::new();
    for team in [&team, &eels] {
        let (mut client, welcome) = first.greet(team).await;
        let obs = client.ask(pinch.clone()).await;
        play(&mut client, 0, 60).await;
        runs.push((client, welcome["session_id"].clone(), obs["run_id"].clone()));
    }
    drop(first.server.kill());
    second.order("competition/end", json!({"reason": "a test"}));
    for (_, session_id, run_id) in &runs {
        let path = format!("/v1/runs/{}", run_id.as_str().expect("an id"));
        let began = Instant::now();
        let mut run = second.get(&path, &second.organizer).json();
        while run["status"] == "open" {
            assert!(began.elapsed() < Duration::from_secs(20), "{session_id}: {run}");
            tokio::time::sleep(Duration::from_millis(100)).await;
            run = second.get(&path, &second.organizer).json();
        }
        // The ticks that the first host had stored count.
        assert!(run["ticks"].as_u64().is_some_and(|ticks| (35..=60).contains(&ticks)), "{run}");
        assert_eq!(run["note"], "an organizer ended the session while its host was away");
        second.verified(run_id).await;
    }
}

#[tokio::test]
async fn a_realtime_run_continues_on_another_host() {
    let Some((first, second, team)) = two_hosts().await else { return };
    let (mut client, welcome) = first.greet(&team).await;
    let reset = json!({"op": "reset", "task": "balls", "hand": "pinch", "mode": "realtime"});
    let obs = client.ask(reset).await;
    assert_eq!(obs["op"], "obs", "{obs}");
    let mut reached = 0;
    while reached < 150 {
        let streamed = client.streamed().await;
        reached = streamed["tick"].as_u64().expect("a tick");
        assert!(streamed.get("resumed").is_none(), "{streamed}");
    }
    let began = Instant::now();
    drop(first.server.kill());
    let (mut client, again) = resumed(&second, &team, &welcome["resume_token"]).await;
    let tick = went_back_to(&again, &obs["run_id"], reached);
    let next = client.streamed().await;
    assert!(began.elapsed() < 2 * TAKEN_OVER, "{:?}", began.elapsed());
    // It stood until its client was back.
    let now = next["tick"].as_u64().expect("a tick");
    // The first tick may be over when the welcome is written.
    assert!(now >= tick && now <= tick + 20, "{tick} {now}");
    assert_eq!(next["resumed"], true);
    assert!(client.streamed().await.get("resumed").is_none());
    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!(result["status"], "provisional", "{result}");
    second.verified(&obs["run_id"]).await;
}

#[tokio::test]
async fn a_replay_that_was_not_uploaded_is_written_again_by_another_host() {
    let Some(url) = postgres_database().await else { return };
    // The storage does not work: its folder cannot be made.
    let shared = TempDir::new().expect("temporary directory");
    let season = shared.path().join("season");
    std::fs::write(&season, "").expect("written");
    let storage = format!("storage = \"file://{}\"\n", season.display());
    let first = host("h1", &url, None, &storage, LOOPBACK);
    let second = host("h2", &url, Some(&first), &storage, LOOPBACK);
    first.open();
    let team = first.team("crabs");
    let (mut client, _) = first.greet(&team).await;
    let mut results = Vec::new();
    for verified in [true, false] {
        assert_eq!(client.ask(reset()).await["op"], "obs");
        for (tick, repeat) in [(0, 40), (40, 1), (41, 7)] {
            let action = json!({"hand": [0.01 * f64::from(tick)]});
            client.ask(json!({"op": "step", "tick": tick, "repeat": repeat, "action": action})).await;
        }
        let result = client.ask(json!({"op": "stop"})).await;
        assert_eq!(result["status"], "provisional", "{result}");
        if verified {
            first.verified(&result["run_id"]).await;
            // Hosts look for ticks that nobody needs each 5 s.
            tokio::time::sleep(Duration::from_secs(6)).await;
        }
        results.push(result);
    }
    // A part of a recording that is no evidence against the run.
    let part = second
        .server
        .folder()
        .join(format!("replays/{}.mcap", results[1]["run_id"].as_str().expect("an id")));
    std::fs::write(part, "cut off").expect("written");
    // Its data directory is lost with it.
    drop(first.killed());
    std::fs::remove_file(&season).expect("removed");

    for result in &results {
        let sha256 = result["replay"]["sha256"].as_str().expect("a hash");
        let uploaded = season.join(format!("replays/{sha256}.mcap"));
        let began = Instant::now();
        while !uploaded.exists() {
            assert!(began.elapsed() < Duration::from_secs(120), "no replay of {result}");
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
        second.verified(&result["run_id"]).await;
        let output = Command::new(program()).arg("verify").arg(&uploaded).output().expect("runs");
        assert!(output.status.success(), "{output:?}");
    }
    let audit = second.get("/v1/admin/audit?limit=100", &second.organizer).json();
    let written = audit["records"].as_array().expect("records").iter();
    let written: Vec<&Value> = written.filter(|record| record["action"] == "replay.rewrite").collect();
    assert_eq!(written.len(), 2, "{audit}");
    assert!(
        written.iter().all(|record| record["reason"].as_str().expect("why").ends_with(": the same bytes"))
    );
}
