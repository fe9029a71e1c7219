//! Many realtime sessions at once: how late are the ticks, and who is refused?
//!
//! `cargo run --release -p palmares-tests --example load -- --url ws://127.0.0.1:8080/v1/control --sessions 20`
//!
//! Without `--replay` every hand ploughs through the ten balls without a pause, the costliest thing that a controller of `balls` can
//! do. With it, the sessions repeat what controllers did.

use clap::Parser;
use futures_util::{SinkExt, StreamExt};
use palmares_replay::Replay;
use palmares_tasks::{Action, BaseTarget};
use serde::Deserialize;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::http::HeaderValue;
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async};

type Error = Box<dyn std::error::Error + Send + Sync>;

/// Opens realtime runs and reports how the server keeps up.
#[derive(Parser, Clone, Debug)]
struct LoadTestOptions {
    /// The server's control socket
    #[arg(long, default_value = "ws://127.0.0.1:8080/v1/control")]
    url: String,
    /// Sessions at once
    #[arg(long, default_value_t = 20)]
    sessions: u64,
    /// How long each plays, s
    #[arg(long, default_value_t = 30.0)]
    seconds: f64,
    /// The first seconds of a session do not count: others are still building their scenes, s
    #[arg(long, default_value_t = 5.0)]
    warm_up: f64,
    /// Replays whose task, hand, seed and actions the sessions repeat, in turn; without one, SoftHands plough through the balls
    #[arg(long)]
    replay: Vec<PathBuf>,
    /// Do not send the full state
    #[arg(long)]
    sensors: bool,
}

/// The fields of the server's messages that matter here.
#[derive(Debug, Deserialize)]
struct Reply {
    op: String,
    #[serde(default)]
    tick: u64,
    late_s: Option<f64>,
    code: Option<String>,
    message: Option<String>,
    #[serde(default)]
    missed_ticks: u64,
    #[serde(default)]
    late_ticks: u64,
    #[serde(default)]
    late_max_s: f64,
    #[serde(default)]
    dropped_obs: u64,
}

/// How one session went.
#[derive(Debug, Default)]
struct Course {
    refused: Option<String>,
    /// Simulated s per s.
    speed: f64,
    late_s: Vec<f64>,
    missed: u64,
    late: u64,
    late_max_s: f64,
    dropped: u64,
}

struct Client(WebSocketStream<MaybeTlsStream<TcpStream>>);

impl Client {
    async fn connect(url: &str) -> Result<Self, Error> {
        let mut request = url.into_client_request()?;
        request.headers_mut().insert("Sec-WebSocket-Protocol", HeaderValue::from_static("palmares.v1.json"));
        Ok(Client(connect_async(request).await?.0))
    }

    async fn send(&mut self, request: &serde_json::Value) -> Result<(), Error> {
        Ok(self.0.send(Message::text(request.to_string())).await?)
    }

    async fn next(&mut self) -> Result<Reply, Error> {
        loop {
            match self.0.next().await.ok_or("the server closed the connection")?? {
                Message::Text(text) => return Ok(serde_json::from_str(&text)?),
                Message::Close(frame) => return Err(format!("closed: {frame:?}").into()),
                _ => {}
            }
        }
    }

    /// The next message that is no streamed observation.
    async fn reply(&mut self, op: &str) -> Result<Reply, Error> {
        loop {
            let reply = self.next().await?;
            if reply.op == op || reply.op == "error" {
                return Ok(reply);
            }
        }
    }
}

/// Where the hand goes: palm down through the heap in box A, each session in a phase of its own.
fn target(phase: f64, time_s: f64) -> Action {
    let wave =
        |period_s: f64, shift: f64| (std::f64::consts::TAU * (time_s / period_s + shift) + phase).sin();
    let position = [0.12 * wave(2.3, 0.0), 0.12 * wave(3.1, 0.25), 0.29 + 0.09 * wave(1.7, 0.5)];
    let base = BaseTarget::Pose { position, quat_xyzw: [0.0, 1.0, 0.0, 0.0] };
    Action { base: Some(base), hand: Some(vec![0.5 + 0.5 * wave(1.9, 0.75)]), effort: None }
}

/// The actions of a session.
enum SessionRole {
    Plough { phase: f64 },
    Repeat(Arc<Replay>),
}

impl SessionRole {
    fn task(&self) -> &str {
        match self {
            SessionRole::Plough { .. } => "balls",
            SessionRole::Repeat(replay) => &replay.header.task,
        }
    }

    fn hand(&self) -> &str {
        match self {
            SessionRole::Plough { .. } => "softhand",
            SessionRole::Repeat(replay) => &replay.header.hand,
        }
    }

    fn seed(&self) -> Option<u64> {
        match self {
            SessionRole::Plough { phase } => Some(*phase as u64),
            SessionRole::Repeat(replay) => replay.header.seed_number,
        }
    }

    /// The action after this tick. None after the last tick of the replay.
    fn action(&self, tick: u64) -> Option<Action> {
        match self {
            SessionRole::Plough { phase } => Some(target(*phase, tick as f64 * 0.01)),
            SessionRole::Repeat(replay) => {
                replay.actions.get(tick as usize).map(|recorded| recorded.action.clone())
            }
        }
    }
}

fn read_replay(path: &Path) -> Result<Arc<Replay>, Error> {
    let bytes = std::fs::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(Arc::new(palmares_replay::read(&bytes).map_err(|error| format!("{}: {error}", path.display()))?))
}

async fn play(options: LoadTestOptions, number: u64, role: SessionRole) -> Result<Course, Error> {
    let mut course = Course::default();
    let mut client = Client::connect(&options.url).await?;
    client.send(&json!({"op": "hello", "id": 1, "client": format!("load {number}")})).await?;
    client.reply("welcome").await?;
    let sensing = if options.sensors { "sensors" } else { "truth" };
    let reset = json!({
        "op": "reset", "id": 2, "task": role.task(), "hand": role.hand(), "mode": "realtime", "sensing": sensing,
        "seed": role.seed(),
    });
    client.send(&reset).await?;
    let opened = client.reply("obs").await?;
    if opened.op == "error" {
        course.refused =
            Some(format!("{}: {}", opened.code.unwrap_or_default(), opened.message.unwrap_or_default()));
        return Ok(course);
    }
    let start = Instant::now();
    let mut tick = 0;
    while start.elapsed().as_secs_f64() < options.seconds {
        let reply = client.next().await?;
        if reply.op == "error" {
            return Err(format!("{reply:?}").into());
        }
        let Some(late_s) = reply.late_s else { continue };
        if start.elapsed().as_secs_f64() >= options.warm_up {
            course.late_s.push(late_s);
        }
        tick = reply.tick;
        let Some(action) = role.action(tick) else { break };
        client.send(&json!({"op": "act", "id": 10 + tick, "action": action})).await?;
    }
    course.speed = tick as f64 * 0.01 / start.elapsed().as_secs_f64();
    client.send(&json!({"op": "stop", "id": 3})).await?;
    let result = client.reply("result").await?;
    course.missed = result.missed_ticks;
    course.late = result.late_ticks;
    course.late_max_s = result.late_max_s;
    course.dropped = result.dropped_obs;
    Ok(course)
}

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Error> {
    let options = LoadTestOptions::parse();
    let replays: Vec<_> = options.replay.iter().map(|path| read_replay(path)).collect::<Result<_, _>>()?;
    let mut sessions = Vec::new();
    for number in 0..options.sessions {
        let role = match replays.len() {
            0 => SessionRole::Plough { phase: number as f64 },
            count => SessionRole::Repeat(replays[number as usize % count].clone()),
        };
        sessions.push(tokio::spawn(play(options.clone(), number, role)));
        // Real teams do not come in the same moment.
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    let mut late_s = Vec::new();
    let (mut played, mut refused) = (0, 0);
    let (mut missed, mut late, mut dropped) = (0, 0, 0);
    let (mut begun_s, mut slowest) = (0.0_f64, f64::INFINITY);
    for (number, session) in sessions.into_iter().enumerate() {
        match session.await? {
            Ok(Course { refused: Some(why), .. }) => {
                refused += 1;
                println!("session {number} refused: {why}");
            }
            Ok(course) => {
                played += 1;
                late_s.extend(course.late_s);
                missed += course.missed;
                late += course.late;
                dropped += course.dropped;
                begun_s = begun_s.max(course.late_max_s);
                slowest = slowest.min(course.speed);
            }
            Err(error) => println!("session {number} failed: {error}"),
        }
    }
    late_s.sort_by(f64::total_cmp);
    let quantile = |part: f64| match late_s.len() {
        0 => f64::NAN,
        count => late_s[((count - 1) as f64 * part).round() as usize] * 1e3,
    };
    println!("{played} sessions played, {refused} refused, {} observations", late_s.len());
    println!(
        "sent after due, ms: p50 {:.2}  p90 {:.2}  p99 {:.2}  p99.9 {:.2}  max {:.2}",
        quantile(0.5),
        quantile(0.9),
        quantile(0.99),
        quantile(0.999),
        quantile(1.0)
    );
    println!("begun more than half a tick late: {late} ticks; latest {:.2} ms", begun_s * 1e3);
    println!("without a new action: {missed} ticks; not taken in time: {dropped} observations");
    println!("slowest session: {slowest:.3} of real time");
    Ok(())
}
