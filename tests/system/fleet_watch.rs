//! Spectators of a fleet: the runs of any host are watched at every other one.

use crate::harness::fleet::{resumed, two_hosts, two_hosts_with};
use crate::harness::{Client, Official, assert_error, get, official_reset as reset};
use serde_json::{Value, json};
use std::net::UdpSocket;
use std::time::{Duration, Instant};

/// The next message of a kind; earlier ones are dropped.
async fn until(viewer: &mut Client, op: &str) -> Value {
    loop {
        let message = viewer.next().await;
        if message["op"] == op {
            return message;
        }
    }
}

/// Waits until a host has this number of connections by which other hosts show its runs.
async fn relays(host: &Official, number: usize) {
    let began = Instant::now();
    let line = format!("palmares_relays_open {number}");
    loop {
        let metrics = get(&host.server, "/metrics").body;
        if metrics.lines().any(|have| have == line) {
            return;
        }
        assert!(began.elapsed() < Duration::from_secs(10), "no `{line}` in\n{metrics}");
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
}

/// The runs in a viewer's list, as soon as there are some.
async fn listed(viewer: &mut Client) -> Value {
    let began = Instant::now();
    loop {
        let runs = viewer.ask(json!({"op": "list"})).await["runs"].take();
        if runs != json!([]) {
            return runs;
        }
        assert!(began.elapsed() < Duration::from_secs(10), "no run in the list");
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
}

#[tokio::test]
async fn a_run_is_watched_at_any_host_over_one_connection() {
    let Some((first, second, team)) = two_hosts().await else { return };
    let screen = second.order("token/add", json!({"role": "viewer", "label": "screen"}));
    let screen = screen["token"].as_str().expect("a token").to_owned();
    let (mut client, welcome, obs) = first.playing(&team).await;
    let run_id = &obs["run_id"];
    let mut viewer = second.watch(Some(&screen)).await;
    let runs = listed(&mut viewer).await;
    let mut there = first.watch(Some(&screen)).await;
    assert_eq!(runs, listed(&mut there).await);
    // The same rights as at the run's host.
    let eels = second.team("eels");
    let mut rival = second.watch(Some(&eels)).await;
    assert_eq!(rival.ask(json!({"op": "list"})).await["runs"], json!([]));
    assert_error(&rival.ask(json!({"op": "subscribe", "run_id": run_id})).await, "forbidden", false);
    let mut stranger = second.watch(None).await;
    let featured = stranger.ask(json!({"op": "subscribe", "featured": true})).await;
    assert_eq!(featured["run_id"], Value::Null, "{featured}");
    relays(&first, 0).await;

    let overlays = json!(["telemetry", "contacts", "verdicts"]);
    let local = there.ask(json!({"op": "subscribe", "run_id": run_id, "overlays": overlays})).await;
    assert_eq!(local["run_id"], *run_id, "{local}");
    let mut viewers = vec![viewer, second.watch(Some(&screen)).await, second.watch(Some(&screen)).await];
    let targets = [
        json!({"op": "subscribe", "run_id": run_id, "overlays": overlays}),
        json!({"op": "subscribe", "session_id": welcome["session_id"]}),
        json!({"op": "subscribe", "featured": true}),
    ];
    let scene = until(&mut there, "scene").await;
    for (viewer, target) in viewers.iter_mut().zip(targets) {
        let subscribed = viewer.ask(target).await;
        assert_eq!(
            (&subscribed["op"], &subscribed["run_id"]),
            (&json!("subscribed"), run_id),
            "{subscribed}"
        );
        assert_eq!(until(viewer, "scene").await, scene);
        assert_eq!(until(viewer, "poses").await["tick"], 0);
    }
    relays(&first, 1).await;

    for tick in 0..20 {
        client.goes_on(tick).await;
    }
    // The overlays of one viewer are copied at the run's host, and are those of a viewer there.
    let whole = async |viewer: &mut Client| loop {
        let poses = until(viewer, "poses").await;
        if poses["tick"] == 20 && poses.get("telemetry").is_some() && poses.get("contacts").is_some() {
            return poses;
        }
    };
    let last = whole(&mut viewers[0]).await;
    let same = whole(&mut there).await;
    assert_eq!((&last["poses"], &last["telemetry"]), (&same["poses"], &same["telemetry"]));
    let clock = until(&mut viewers[0], "clock").await;
    assert!(clock["session_left_s"].as_f64().is_some_and(|left| left < 600.0), "{clock}");
    assert_eq!(clock["paused"], false);

    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!(result["op"], "result", "{result}");
    let end = until(&mut there, "ended").await;
    for viewer in &mut viewers {
        let ended = until(viewer, "ended").await;
        assert_eq!(ended, end);
        assert_eq!(ended["outcome"]["score"], result["score"]);
    }
    relays(&first, 0).await;

    // The next run is shown by itself. Without viewers its connection ends.
    let next = client.ask(reset()).await;
    for viewer in &mut viewers[1..] {
        assert_eq!(until(viewer, "scene").await["run"]["run_id"], next["run_id"]);
    }
    relays(&first, 1).await;
    drop(viewers);
    relays(&first, 0).await;
}

/// The address of this machine in its network; None without one. Only such an address has a limit of connections.
fn own_address() -> Option<String> {
    let socket = UdpSocket::bind("0.0.0.0:0").ok()?;
    // Nothing is sent.
    socket.connect("192.0.2.254:9").ok()?;
    Some(socket.local_addr().ok()?.ip()).filter(|address| !address.is_loopback()).map(|ip| ip.to_string())
}

#[tokio::test]
async fn connections_between_hosts_take_no_places_of_an_address() {
    let Some(address) = own_address() else { return println!("SKIP: this machine has no network") };
    // Places for both teams, and for one connection more.
    let limit = "max_connections_per_address = 3\n";
    let Some((first, second, crabs)) = two_hosts_with(limit, &address).await else { return };
    let eels = first.team("eels");
    let players = [first.playing(&crabs).await, first.playing(&eels).await];
    let mut viewers = Vec::new();
    for (_, _, obs) in &players {
        let mut viewer = second.watch(Some(&second.organizer)).await;
        listed(&mut viewer).await;
        let subscribed = viewer.ask(json!({"op": "subscribe", "run_id": obs["run_id"]})).await;
        assert_eq!(subscribed["run_id"], obs["run_id"], "{subscribed}");
        assert_eq!(until(&mut viewer, "scene").await["run"]["run_id"], obs["run_id"]);
        viewers.push(viewer);
    }
}

#[tokio::test]
async fn a_viewer_sees_a_pause_when_a_run_moves() {
    let Some((first, second, team)) = two_hosts().await else { return };
    let (mut client, welcome, obs) = first.playing(&team).await;
    client.goes_on(0).await;
    let mut viewers = Vec::new();
    for host in [&first, &second] {
        let mut viewer = host.watch(Some(&host.organizer)).await;
        listed(&mut viewer).await;
        let subscribed = viewer.ask(json!({"op": "subscribe", "run_id": obs["run_id"]})).await;
        assert_eq!(subscribed["run_id"], obs["run_id"], "{subscribed}");
        until(&mut viewer, "poses").await;
        viewers.push(viewer);
    }
    // To the host of the second viewer, away from that of the first.
    let (mut client, again) = resumed(&second, &team, &welcome["resume_token"]).await;
    let mut tick = again["run"]["tick"].as_u64().expect("a tick");
    assert_eq!(again["run"]["run_id"], obs["run_id"], "{again}");
    relays(&first, 0).await;
    relays(&second, 1).await;
    for viewer in &mut viewers {
        let from = tick;
        loop {
            client.goes_on(tick).await;
            tick += 1;
            let message = viewer.next().await;
            assert_ne!(message["op"], "ended", "{message}");
            if message["op"] == "poses" && message["tick"].as_u64() > Some(from) {
                break;
            }
        }
    }
    let result = client.ask(json!({"op": "stop"})).await;
    for viewer in &mut viewers {
        assert_eq!(until(viewer, "ended").await["outcome"]["score"], result["score"]);
    }
}

#[tokio::test]
async fn runs_of_a_host_are_not_shown_to_strangers() {
    let Some((first, second, team)) = two_hosts().await else { return };
    let (_client, _, obs) = first.playing(&team).await;
    let run_id = obs["run_id"].as_str().expect("an id");
    let path = format!("/v1/internal/watch/{run_id}");
    for host in [&first, &second] {
        for token in [&team, &first.organizer] {
            assert_eq!(host.refused(host.handshake(&path, token)).await, 401);
        }
        let mut forged = host.handshake(&path, &first.organizer);
        forged.headers_mut().insert("palmares-host-proof", "00".repeat(32).parse().expect("a header"));
        assert_eq!(host.refused(forged).await, 401);
    }
    // A server alone has no other hosts.
    let alone = Official::start();
    assert_eq!(alone.refused(alone.handshake(&path, &alone.organizer)).await, 401);
}
