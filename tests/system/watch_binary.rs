//! Spectators with binary frames and overlays: the frames are right, and they change nothing.

use crate::harness::{Client, Official, Server, handshake_to, reset};
use futures_util::{SinkExt, StreamExt};
use serde_json::{Value, json};
use std::time::Duration;
use tokio::net::TcpStream;
use tokio::time::timeout;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async};

/// A message to a viewer.
#[derive(Debug)]
enum Received {
    Text(Value),
    Frame(Box<Frame>),
    Closed(u16),
}

/// A binary frame, read by the description in docs/protocol.md.
#[derive(Debug, Default)]
struct Frame {
    key: bool,
    tick: u32,
    score: f32,
    bodies: Vec<(u16, [f32; 7])>,
    motors: Vec<[f32; 3]>,
    tension: Vec<f32>,
    q: Vec<f32>,
    predicted: Vec<f32>,
    work: Vec<f32>,
    fingers: Vec<Vec<f32>>,
    touch: Vec<Vec<f32>>,
    readings: Vec<f32>,
    contacts: Vec<(u16, u16, [f32; 6], u8)>,
}

/// Takes numbers off the front of a frame.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (head, rest) = self.0.split_first_chunk::<N>().expect("long enough");
        self.0 = rest;
        *head
    }
    fn byte(&mut self) -> u8 {
        self.take::<1>()[0]
    }
    fn short(&mut self) -> u16 {
        u16::from_le_bytes(self.take())
    }
    fn float(&mut self) -> f32 {
        f32::from_le_bytes(self.take())
    }
    fn floats(&mut self, count: usize) -> Vec<f32> {
        (0..count).map(|_| self.float()).collect()
    }
}

fn unpacked(packed: u32) -> [f32; 4] {
    let largest = (packed >> 30) as usize;
    let part = |shift: u32| {
        (((packed >> shift) & 1023) as f32 / 1023.0 * 2.0 - 1.0) * std::f32::consts::FRAC_1_SQRT_2
    };
    let others = [part(20), part(10), part(0)];
    let rest = (1.0 - others.iter().map(|x| x * x).sum::<f32>()).max(0.0).sqrt();
    let mut others = others.into_iter();
    std::array::from_fn(|k| if k == largest { rest } else { others.next().expect("three") })
}

fn decoded(bytes: &[u8]) -> Frame {
    let mut bytes = Bytes(bytes);
    assert_eq!(bytes.byte(), 1, "the version");
    let (flags, count) = (bytes.byte(), bytes.short());
    let mut frame = Frame {
        key: flags & 1 > 0,
        tick: u32::from_le_bytes(bytes.take()),
        score: bytes.float(),
        ..Frame::default()
    };
    for _ in 0..count {
        let (place, at) = (bytes.short(), bytes.floats(3));
        let [i, j, k, w] = unpacked(u32::from_le_bytes(bytes.take()));
        frame.bodies.push((place, [at[0], at[1], at[2], i, j, k, w]));
    }
    if flags & 2 > 0 {
        let motors = bytes.byte();
        frame.motors = (0..motors).map(|_| std::array::from_fn(|_| bytes.float())).collect();
        let tendons = usize::from(bytes.byte());
        frame.tension = bytes.floats(tendons);
        let joints = usize::from(bytes.byte());
        frame.q = bytes.floats(joints);
        if bytes.byte() == 1 {
            frame.predicted = bytes.floats(joints);
        }
    }
    if flags & 4 > 0 {
        for _ in 0..bytes.short() {
            let (a, b) = (bytes.short(), bytes.short());
            let numbers = std::array::from_fn(|_| bytes.float());
            frame.contacts.push((a, b, numbers, bytes.byte()));
        }
    }
    if flags & 8 > 0 {
        let motors = usize::from(bytes.byte());
        frame.work = bytes.floats(motors);
        frame.fingers = (0..bytes.byte()).map(|_| bytes.floats(6)).collect();
        frame.touch = (0..bytes.short()).map(|_| bytes.floats(3)).collect();
    }
    if flags & 16 > 0 {
        let count = usize::from(bytes.short());
        frame.readings = bytes.floats(count);
    }
    assert!(bytes.0.is_empty(), "{} bytes too many", bytes.0.len());
    frame
}

struct Viewer(WebSocketStream<MaybeTlsStream<TcpStream>>);

impl Viewer {
    async fn connect(server: &Server, protocols: &str) -> Self {
        let request = handshake_to(server, "/v1/watch", Some(protocols));
        let (socket, response) = connect_async(request).await.expect("connects");
        let chosen = response.headers()["Sec-WebSocket-Protocol"].to_str().expect("text").to_owned();
        assert!(!chosen.contains("token") && !format!("{response:?}").contains("plm_"), "{response:?}");
        assert_eq!(chosen, protocols.split(',').next().expect("one").trim());
        Viewer(socket)
    }

    async fn subscribe(&mut self, overlays: Value) {
        let request = json!({"op": "subscribe", "id": 1, "featured": true, "overlays": overlays});
        self.0.send(Message::text(request.to_string())).await.expect("sent");
    }

    async fn next(&mut self) -> Received {
        loop {
            match timeout(Duration::from_secs(60), self.0.next()).await.expect("in time") {
                Some(Ok(Message::Text(text))) => {
                    return Received::Text(serde_json::from_str(&text).expect("JSON"));
                }
                Some(Ok(Message::Binary(bytes))) => return Received::Frame(Box::new(decoded(&bytes))),
                Some(Ok(Message::Close(frame))) => {
                    return Received::Closed(frame.expect("a reason").code.into());
                }
                Some(Ok(_)) => {}
                other => panic!("expected a message, got {other:?}"),
            }
        }
    }

    async fn text(&mut self, op: &str) -> Value {
        self.texts([op]).await.remove(0)
    }

    /// The next message of each of these kinds, which come in any order.
    async fn texts<const N: usize>(&mut self, ops: [&str; N]) -> Vec<Value> {
        let mut found = vec![None; N];
        let all = async {
            while found.iter().any(Option::is_none) {
                match self.next().await {
                    Received::Text(message) => {
                        if let Some(k) = (0..N).find(|&k| found[k].is_none() && message["op"] == ops[k]) {
                            found[k] = Some(message);
                        }
                    }
                    Received::Closed(code) => panic!("closed with {code}"),
                    Received::Frame(_) => {}
                }
            }
        };
        // Pings come at any time, and are no answer.
        timeout(Duration::from_secs(60), all).await.unwrap_or_else(|_| panic!("no {ops:?} within a minute"));
        found.into_iter().flatten().collect()
    }

    async fn frame(&mut self) -> Frame {
        loop {
            if let Received::Frame(frame) = self.next().await {
                return *frame;
            }
        }
    }
}

fn numbers(value: &Value) -> Vec<f32> {
    let all = value.as_array().unwrap_or_else(|| panic!("numbers, not {value}"));
    all.iter().map(|x| x.as_f64().expect("a number") as f32).collect()
}

fn near(a: &[f32], b: &[f32], most: f32) {
    assert_eq!(a.len(), b.len());
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= most), "{a:?} and {b:?}");
}

#[tokio::test]
async fn binary_frames_have_the_content_of_the_json_ones() {
    let server = Server::start();
    let (mut player, _) = Client::playing(&server, "crabs").await;
    let all = json!(["telemetry", "contacts", "verdicts"]);
    let mut binary = Viewer::connect(&server, "palmares.v1.bin").await;
    let mut plain = Viewer::connect(&server, "palmares.v1.json").await;
    for viewer in [&mut binary, &mut plain] {
        viewer.subscribe(all.clone()).await;
    }
    let scene = binary.text("scene").await;
    assert_eq!(scene["hand"]["name"], "softhand");
    let moving = scene["moving"].as_array().expect("ids").len();
    let first = binary.frame().await;
    assert!(first.key && first.bodies.len() == moving && !first.q.is_empty(), "{first:?}");
    let mut shown: Vec<[f32; 7]> = first.bodies.iter().map(|(_, pose)| *pose).collect();

    let action = json!({"base": {"position": [0.0, 0.0, 0.2], "quat_xyzw": [0, 1, 0, 0]}, "hand": [0.7]});
    for k in 0..30_u64 {
        let step = json!({"op": "step", "tick": 10 * k, "repeat": 10, "action": action});
        assert_eq!(player.ask(step).await["op"], "obs");
    }
    let mut smallest = usize::MAX;
    let last = loop {
        let frame = binary.frame().await;
        for (place, pose) in &frame.bodies {
            shown[usize::from(*place)] = *pose;
        }
        smallest = smallest.min(frame.bodies.len());
        if frame.tick == 300 {
            break frame;
        }
    };
    assert!(smallest < moving, "only what moves is sent");
    let poses = loop {
        let poses = plain.text("poses").await;
        if poses["tick"] == 300 {
            break poses;
        }
    };
    for (shown, sent) in shown.iter().zip(poses["poses"].as_array().expect("poses")) {
        let sent = numbers(sent);
        near(&shown[..3], &sent[..3], 1e-4);
        let dot: f32 = shown[3..].iter().zip(&sent[3..]).map(|(a, b)| a * b).sum();
        assert!(dot.abs() > 1.0 - 1e-5, "{shown:?} and {sent:?}");
    }
    let telemetry = &poses["telemetry"];
    near(&last.q, &numbers(&telemetry["q"]), 1e-6);
    near(&last.predicted, &numbers(&telemetry["predicted"]), 1e-6);
    near(&last.tension, &numbers(&telemetry["tension"]), 1e-3);
    let motor = &telemetry["motors"][0];
    near(&last.motors[0], &numbers(&json!([motor["command"], motor["position"], motor["tension"]])), 1e-3);
    near(&last.work, &numbers(&json!([motor["work"]])), 1e-3);
    let fingers = telemetry["fingers"].as_array().expect("fingers");
    assert_eq!((last.fingers.len(), last.touch.len()), (fingers.len(), 0));
    // Force and torque at the wrist.
    assert_eq!(last.readings.len(), 6);
    for (sent, finger) in last.fingers.iter().zip(fingers) {
        near(&sent[..3], &numbers(&finger["force"]), 1e-3);
        near(&sent[3..], &numbers(&finger["torque"]), 1e-3);
    }
    let contacts = poses["contacts"].as_array().expect("contacts");
    assert!(!contacts.is_empty(), "the hand is among the balls");
    assert_eq!(last.contacts.len(), contacts.len());
    for ((a, b, place, used), sent) in last.contacts.iter().zip(contacts) {
        assert_eq!((json!(a), json!(b)), (sent["a"].clone(), sent["b"].clone()));
        near(place, &[numbers(&sent["position"]), numbers(&sent["force"])].concat(), 1e-3);
        let expected = (255.0 * sent["use"].as_f64().expect("a number")).min(255.0);
        assert!((f64::from(*used) - expected).abs() < 0.6, "{used} {sent}");
    }
    assert_eq!(last.score, 0.0);
}

#[tokio::test]
async fn a_viewer_gets_the_clock_and_the_reason_why_no_ball_counts_yet() {
    let server = Server::start();
    let (mut player, _) = Client::greet(&server, "crabs").await;
    let mut run = reset();
    run["mode"] = "realtime".into();
    let opened = player.ask(run).await;
    let mut viewer = Viewer::connect(&server, "palmares.v1.bin").await;
    viewer.subscribe(json!(["verdicts"])).await;
    let [first, verdicts] = viewer.texts(["clock", "verdicts"]).await.try_into().expect("two");
    // Nothing is known of the speed at first.
    assert_eq!((&first["real_time_factor"], &first["session_left_s"]), (&Value::Null, &Value::Null));
    assert_eq!((&first["paused"], &first["run_id"]), (&json!(false), &opened["run_id"]));
    assert_eq!(verdicts["run_id"], opened["run_id"]);
    let objects = verdicts["objects"].as_array().expect("objects");
    assert_eq!(objects.len(), 10);
    for object in objects {
        assert_eq!((&object["counts"], &object["place"]), (&json!(false), &json!("start")), "{object}");
        let rule = &object["reasons"][0];
        assert_eq!(
            (&rule["rule"], &rule["holds"], &rule["unit"]),
            (&json!("in_goal"), &json!(false), &json!("m"))
        );
        assert!(rule["value"].as_f64().is_some_and(|away| away > 0.1), "{rule}");
    }
    let second = viewer.text("clock").await;
    assert!(second["real_time_factor"].as_f64().is_some_and(|factor| factor > 0.0), "{second}");
    assert!(second["late_s"].as_f64().is_some_and(|late| late >= 0.0), "{second}");
    assert!(second["elapsed_s"].as_f64() > first["elapsed_s"].as_f64(), "{second}");
}

/// Plays a run of half a second; returns its result.
async fn played(server: &Server, team: &str) -> Value {
    let (mut player, _) = Client::playing(server, team).await;
    for k in 0..25_u64 {
        let base = json!({"position": [0.02, 0.0, 0.7 - 0.01 * k as f64], "quat_xyzw": [0, 1, 0, 0]});
        let action = json!({"base": base, "hand": [0.5]});
        let step = json!({"op": "step", "tick": 2 * k, "repeat": 2, "action": action});
        assert_eq!(player.ask(step).await["op"], "obs");
    }
    let result = player.ask(json!({"op": "stop"})).await;
    assert_eq!(result["op"], "result", "{result}");
    result
}

#[tokio::test]
async fn whoever_watches_changes_no_bit_of_a_run() {
    let server = Server::start();
    let alone = played(&server, "crabs").await;
    let mut viewers = Vec::new();
    for k in 0..6 {
        let protocol = if k % 2 == 0 { "palmares.v1.bin" } else { "palmares.v1.json" };
        let mut viewer = Viewer::connect(&server, protocol).await;
        viewer.subscribe(json!(["telemetry", "contacts", "verdicts"])).await;
        viewers.push(tokio::spawn(async move { viewer.text("ended").await }));
    }
    let watched = played(&server, "eels").await;
    assert_eq!(watched["state_hash"], alone["state_hash"]);
    assert!(watched["state_hash"].as_str().is_some_and(|hash| hash.len() == 16), "{watched}");
    for viewer in viewers {
        assert_eq!(viewer.await.expect("it watched")["run_id"], watched["run_id"]);
    }
}

#[tokio::test]
async fn a_browsers_token_is_taken_as_a_subprotocol_refused_if_wrong_and_closed_if_revoked() {
    let cup = Official::start();
    let team = cup.team("crabs");
    let added = cup.order("token/add", json!({"role": "viewer", "label": "screen"}));
    let token = added["token"].as_str().expect("a token").to_owned();
    cup.open();
    let (_player, _, obs) = cup.playing(&team).await;
    let offer = |token: &str| format!("palmares.v1.bin, palmares.token.{token}");
    let mut viewer = Viewer::connect(&cup.server, &offer(&token)).await;
    viewer.subscribe(json!([])).await;
    assert_eq!(viewer.text("subscribed").await["run_id"], obs["run_id"]);
    assert_eq!(viewer.frame().await.tick, 0);
    let mut stranger = Viewer::connect(&cup.server, "palmares.v1.bin").await;
    stranger.subscribe(json!([])).await;
    assert_eq!(stranger.text("subscribed").await["run_id"], Value::Null);

    let (head, secret) = token.rsplit_once('_').expect("a secret");
    let wrong = format!("{head}_{}", secret.chars().rev().collect::<String>());
    for wrong in [wrong.as_str(), "plm", ""] {
        let request = handshake_to(&cup.server, "/v1/watch", Some(&offer(wrong)));
        assert_eq!(cup.refused(request).await, 401, "{wrong}");
    }
    // Two tokens are one too many, and on other sockets such an offer is none.
    let twice = format!("{}, palmares.token.{team}", offer(&token));
    assert_eq!(cup.refused(handshake_to(&cup.server, "/v1/watch", Some(&twice))).await, 401);
    let control = format!("palmares.v1.json, palmares.token.{team}");
    assert_eq!(cup.refused(handshake_to(&cup.server, "/v1/control", Some(&control))).await, 401);

    cup.order("token/revoke", json!({"token_id": added["token_id"], "reason": "lost"}));
    assert_eq!(viewer.text("error").await["code"], "not_authorized");
    loop {
        if let Received::Closed(code) = viewer.next().await {
            assert_eq!(code, 4401);
            break;
        }
    }
    assert_eq!(cup.refused(handshake_to(&cup.server, "/v1/watch", Some(&offer(&token)))).await, 401);
}
