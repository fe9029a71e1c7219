//! Spectators: what they see, what they may not see, and that they delay no run.

use crate::harness::{Client, Server, assert_error, get, handshake_to, reset, step};
use futures_util::StreamExt;
use serde_json::{Value, json};
use std::time::Duration;
use tokio::net::TcpSocket;
use tokio::time::timeout;
use tokio_tungstenite::client_async;

async fn viewer(server: &Server) -> Client {
    Client::connect_to(server, "/v1/watch").await
}

/// Subscribes; returns the reply and the scene that follows when a run is open.
async fn subscribe(viewer: &mut Client, mut target: Value) -> (Value, Option<Value>) {
    target["op"] = "subscribe".into();
    let reply = viewer.ask(target).await;
    assert_eq!(reply["op"], "subscribed", "{reply}");
    let scene = match reply["run_id"].is_string() {
        true => Some(until(viewer, "scene").await),
        false => None,
    };
    (reply, scene)
}

/// The next message of a kind.
async fn until(viewer: &mut Client, op: &str) -> Value {
    loop {
        let message = viewer.next().await;
        if message["op"] == op {
            return message;
        }
    }
}

#[tokio::test]
async fn a_viewer_sees_a_session_from_run_to_run() {
    let server = Server::start();
    let (mut player, welcome) = Client::playing(&server, "crabs").await;
    let mut viewer = viewer(&server).await;
    let runs = viewer.ask(json!({"op": "list"})).await;
    assert_eq!(runs["runs"][0]["team"], "crabs", "{runs}");

    let session = json!({"session_id": welcome["session_id"]});
    let (reply, scene) = subscribe(&mut viewer, session).await;
    let scene = scene.expect("a run is open");
    assert_eq!((&scene["run"]["run_id"], &scene["run"]["task"]), (&reply["run_id"], &json!("balls")));
    let bodies = scene["bodies"].as_array().expect("bodies");
    for kind in ["object", "furniture", "hand"] {
        let shaped =
            |body: &&Value| body["kind"] == kind && body["parts"].as_array().is_some_and(|p| !p.is_empty());
        assert!(bodies.iter().any(|body| shaped(&body)), "no {kind} to draw");
    }
    let moving = scene["moving"].as_array().expect("ids").len();
    assert_eq!(moving, bodies.iter().filter(|body| body["kind"] != "furniture").count());
    let poses = until(&mut viewer, "poses").await;
    assert_eq!((&poses["tick"], poses["poses"].as_array().map(Vec::len)), (&json!(0), Some(moving)));
    assert_eq!(poses["poses"][0].as_array().map(Vec::len), Some(7));
    assert_eq!(until(&mut viewer, "score").await["run_id"], reply["run_id"]);

    for tick in 0..20 {
        player.goes_on(tick).await;
    }
    while until(&mut viewer, "poses").await["tick"] != 20 {}
    let result = player.ask(json!({"op": "stop"})).await;
    let ended = until(&mut viewer, "ended").await;
    assert_eq!(ended["run_id"], reply["run_id"]);
    assert_eq!(ended["outcome"]["score"], result["score"], "{ended}");
    assert_eq!(ended["outcome"]["reason"], "stopped");
    // The ranking after the result is stored; the one before it was empty.
    loop {
        let ranking = until(&mut viewer, "leaderboard").await;
        if ranking["rows"][0]["team"] == "crabs" {
            break;
        }
        assert_eq!(ranking["rows"], json!([]));
    }
    let next = player.ask(reset()).await;
    let scene = until(&mut viewer, "scene").await;
    assert_eq!(scene["run"]["run_id"], next["run_id"]);
}

#[tokio::test]
async fn a_late_viewer_sees_the_present_and_no_seed() {
    let server = Server::start();
    let (mut player, _) = Client::greet(&server, "crabs").await;
    let secret = 8_675_309_421_337_u64;
    let request = json!({"op": "reset", "task": "balls", "hand": "pinch", "seed": secret});
    assert_eq!(player.ask(request).await["op"], "obs");
    player.ask(json!({"op": "step", "tick": 0, "repeat": 1, "action": {}})).await;
    // Longer than the interval in which an unwatched run publishes itself.
    tokio::time::sleep(Duration::from_millis(150)).await;
    player.goes_on(1).await;

    let mut viewer = viewer(&server).await;
    let (_, scene) = subscribe(&mut viewer, json!({"featured": true})).await;
    let scene = scene.expect("a run is open");
    let poses = until(&mut viewer, "poses").await;
    assert_eq!(poses["tick"], 2, "{poses}");
    for message in [&scene, &poses] {
        let text = message.to_string();
        assert!(!text.contains("seed") && !text.contains(&secret.to_string()), "{text}");
    }
    // While the world does not move, no more poses come; the last ones are those of the last tick.
    player.ask(json!({"op": "step", "tick": 2, "repeat": 50, "action": {}})).await;
    while until(&mut viewer, "poses").await["tick"] != 52 {}
}

#[tokio::test]
async fn requests_that_make_no_sense_are_refused_and_harm_nothing() {
    let server = Server::start();
    let mut viewer = viewer(&server).await;
    viewer.refused(json!({"op": "subscribe", "run_id": "run_x"}), "not_found").await;
    viewer.refused(json!({"op": "subscribe", "session_id": "ses_x"}), "not_found").await;
    viewer.refused(json!({"op": "subscribe"}), "bad_request").await;
    viewer.refused(json!({"op": "subscribe", "run": "x"}), "bad_request").await;
    viewer.refused(json!({"op": "step", "tick": 0, "action": {}}), "unknown_op").await;
    viewer.send("{").await;
    assert_error(&viewer.next().await, "bad_json", false);

    // No run is open: the first one is shown when it opens.
    let (reply, _) = subscribe(&mut viewer, json!({"featured": true})).await;
    assert_eq!(reply["run_id"], Value::Null);
    let (_player, _) = Client::playing(&server, "crabs").await;
    assert_eq!(until(&mut viewer, "scene").await["run"]["team"], "crabs");
    viewer.send(r#"{"op":"bye","id":9}"#).await;
    loop {
        // Poses may still be on their way.
        if let Some(closed) = viewer.next_or_closed().await.err() {
            assert_eq!(closed, (1000, "bye".into()));
            break;
        }
    }
    get(&server, "/v1/watch").assert_problem(400, "bad_request");
}

/// A viewer that never reads, and has little room for what it is sent.
async fn deaf(server: &Server) -> tokio_tungstenite::WebSocketStream<tokio::net::TcpStream> {
    let socket = TcpSocket::new_v4().expect("a socket");
    socket.set_recv_buffer_size(4096).expect("a small buffer");
    let stream = socket.connect(server.address().parse().expect("an address")).await.expect("connects");
    let request = handshake_to(server, "/v1/watch", Some("palmares.v1.json"));
    let (mut socket, _) = client_async(request, stream).await.expect("a WebSocket");
    use futures_util::SinkExt;
    // Every answer brings the scene with it: the way back is full soon.
    for id in 1..=400 {
        let subscribe = json!({"op": "subscribe", "id": id, "featured": true}).to_string();
        socket.send(subscribe.into()).await.expect("sent");
    }
    socket
}

#[tokio::test]
async fn nobody_waits_for_a_viewer_that_does_not_read_and_it_is_let_go() {
    let server = Server::start();
    let (mut player, _) = Client::playing(&server, "crabs").await;
    let mut deaf = deaf(&server).await;
    let mut viewer = viewer(&server).await;
    subscribe(&mut viewer, json!({"featured": true})).await;

    // The player and the other viewer continue until the server drops the deaf one: the server logs it, and
    // the connection ends after the last unread message.
    let mut tick = 0;
    let mut sent = false;
    for _ in 0..2000 {
        let obs = player.ask(step(tick)).await;
        assert_eq!(obs["op"], "obs", "{obs}");
        tick += 1;
        let now = until(&mut viewer, "poses").await["tick"].as_u64().expect("a tick");
        assert!(now <= tick);
        sent = get(&server, "/metrics").body.contains("palmares_viewers 1\n");
        if sent {
            break;
        }
    }
    assert!(sent, "the deaf viewer still holds its place");
    let mut frames = Vec::new();
    while let Some(Ok(message)) = timeout(Duration::from_secs(20), deaf.next()).await.expect("in time") {
        if let Ok(text) = message.into_text()
            && let Ok(message) = serde_json::from_str::<Value>(&text)
            && message["op"] == "poses"
        {
            frames.push(message["tick"].as_u64().expect("a tick"));
        }
    }
    // A frame may come once more, for every subscription; never an older one.
    assert!(frames.windows(2).all(|pair| pair[0] <= pair[1]), "{frames:?}");
    assert!(frames.last().is_none_or(|&last| last < tick), "{frames:?}");
    player.goes_on(tick).await;
}
