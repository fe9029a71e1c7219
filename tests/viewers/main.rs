//! Many viewers of one world: what do they cost its ticks, and how much are they sent?
//!
//! `cargo run --release -p palmares-tests --example viewers -- --url ws://127.0.0.1:8080 --viewers 100`, against a practice
//! server on which nobody else plays. It plays a realtime run with and without viewers, in turns, and compares what
//! `GET /metrics` has the ticks.

use clap::Parser;
use futures_util::{SinkExt, StreamExt};
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async};

type Error = Box<dyn std::error::Error + Send + Sync>;
type Socket = WebSocketStream<MaybeTlsStream<TcpStream>>;

/// Opens viewers on one run and reports what they cost.
#[derive(Parser, Clone, Debug)]
struct ViewerTestOptions {
    /// The server
    #[arg(long, default_value = "ws://127.0.0.1:8080")]
    url: String,
    /// Viewers at once
    #[arg(long, default_value_t = 100)]
    viewers: usize,
    /// How long each turn lasts, s
    #[arg(long, default_value_t = 10.0)]
    seconds: f64,
    /// Turns with and turns without viewers
    #[arg(long, default_value_t = 3)]
    turns: usize,
    /// Task
    #[arg(long, default_value = "shelf")]
    task: String,
    /// Hand
    #[arg(long, default_value = "softhand")]
    hand: String,
    /// Layers that they subscribe to: telemetry, contacts, verdicts
    #[arg(long, value_delimiter = ',')]
    overlays: Vec<String>,
    /// Play nothing: watch what others play, until interrupted
    #[arg(long)]
    only_watch: bool,
    /// JSON instead of binary frames
    #[arg(long)]
    json: bool,
}

async fn connect(url: &str, protocol: &str) -> Result<Socket, Error> {
    let mut request = url.into_client_request()?;
    request.headers_mut().insert("Sec-WebSocket-Protocol", protocol.parse()?);
    Ok(connect_async(request).await?.0)
}

/// Ticks, the seconds they computed, and how late they began in all, s, as the server counts them.
async fn computed(url: &str) -> Result<[f64; 3], Error> {
    let address = url.trim_start_matches("ws://");
    let mut stream = TcpStream::connect(address).await?;
    let request = format!("GET /metrics HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n");
    stream.write_all(request.as_bytes()).await?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer).await?;
    let value = |name: &str| -> Result<f64, Error> {
        let line = answer.lines().find(|line| line.starts_with(name)).ok_or("no such metric")?;
        Ok(line.rsplit(' ').next().ok_or("no value")?.parse()?)
    };
    Ok([
        value("palmares_tick_compute_seconds_count ")?,
        value("palmares_tick_compute_seconds_sum ")?,
        value("palmares_tick_lateness_seconds_sum ")?,
    ])
}

/// Moves the hand about among the objects, by the clock, until `end` is set.
async fn play(options: ViewerTestOptions, end: Arc<AtomicBool>) -> Result<(), Error> {
    let mut socket = connect(&format!("{}/v1/control", options.url), "palmares.v1.json").await?;
    let send = |request: Value| Message::text(request.to_string());
    socket.send(send(json!({"op": "hello", "id": 1, "client": "viewers"}))).await?;
    let (task, hand) = (&options.task, &options.hand);
    let reset = json!({
        "op": "reset", "id": 2, "task": task, "hand": hand, "mode": "realtime", "sensing": "sensors", "seed": 1
    });
    socket.send(send(reset)).await?;
    while !end.load(Ordering::Relaxed) {
        let message = socket.next().await.ok_or("the server closed the connection")??;
        let Message::Text(text) = message else { continue };
        let message: Value = serde_json::from_str(&text)?;
        if message["op"] == "error" {
            return Err(text.to_string().into());
        }
        let Some(tick) = message["tick"].as_u64().filter(|_| message["op"] == "obs") else { continue };
        let wave = |period_s: f64| (std::f64::consts::TAU * tick as f64 * 0.01 / period_s).sin();
        let base =
            json!({"linear": [0.1 * wave(2.3), 0.1 * wave(3.1), 0.1 * wave(1.7)], "angular": [0, 0, 0]});
        let action = json!({"base": base, "hand": [0.5 + 0.5 * wave(1.9)]});
        socket.send(send(json!({"op": "act", "id": 10 + tick, "action": action}))).await?;
    }
    socket.send(send(json!({"op": "stop", "id": 3}))).await?;
    Ok(())
}

/// Messages sent to the viewers.
#[derive(Debug, Default)]
struct Sent {
    bytes: AtomicU64,
    frames: AtomicU64,
}

async fn view(options: ViewerTestOptions, sent: Arc<Sent>) -> Result<(), Error> {
    let protocol = if options.json { "palmares.v1.json" } else { "palmares.v1.bin" };
    let mut socket = connect(&format!("{}/v1/watch", options.url), protocol).await?;
    let request = json!({"op": "subscribe", "id": 1, "featured": true, "overlays": options.overlays});
    socket.send(Message::text(request.to_string())).await?;
    let mut scene = false;
    while let Some(message) = socket.next().await {
        let message = message?;
        let is_frame =
            message.is_binary() || message.to_text().is_ok_and(|text| text.starts_with(r#"{"op":"poses""#));
        // The scene comes once; what comes after it, every second.
        if scene && (message.is_text() || message.is_binary()) {
            sent.bytes.fetch_add(message.len() as u64 + 4, Ordering::Relaxed);
            sent.frames.fetch_add(u64::from(is_frame), Ordering::Relaxed);
        }
        scene |= is_frame;
    }
    Ok(())
}

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Error> {
    let options = ViewerTestOptions::parse();
    if options.only_watch {
        let crowd = (0..options.viewers).map(|_| view(options.clone(), Arc::default()));
        futures_util::future::try_join_all(crowd).await?;
        return Ok(());
    }
    let end = Arc::new(AtomicBool::new(false));
    let player = tokio::spawn(play(options.clone(), end.clone()));
    tokio::time::sleep(Duration::from_secs(3)).await;
    let (mut with, mut without) = (Vec::new(), Vec::new());
    for _ in 0..options.turns {
        for viewers in [0, options.viewers] {
            let sent = Arc::new(Sent::default());
            let tasks: Vec<_> =
                (0..viewers).map(|_| tokio::spawn(view(options.clone(), sent.clone()))).collect();
            tokio::time::sleep(Duration::from_secs(1)).await;
            let (begun, before) = (Instant::now(), computed(&options.url).await?);
            let [bytes, frames] = [&sent.bytes, &sent.frames].map(|count| count.load(Ordering::Relaxed));
            tokio::time::sleep(Duration::from_secs_f64(options.seconds)).await;
            let (after, passed_s) = (computed(&options.url).await?, begun.elapsed().as_secs_f64());
            let each = |now: &AtomicU64, then: u64| {
                (now.load(Ordering::Relaxed) - then) as f64 / passed_s / viewers.max(1) as f64
            };
            let ticks = after[0] - before[0];
            let [tick_us, late_us] = [1, 2].map(|k| (after[k] - before[k]) / ticks * 1e6);
            println!(
                "{viewers} viewers: {tick_us:.1} µs a tick over {ticks} ticks, {late_us:.1} µs late; each viewer {:.1} KB/s in \
                 {:.1} frames/s",
                each(&sent.bytes, bytes) / 1e3,
                each(&sent.frames, frames)
            );
            if viewers == 0 {
                without.push([tick_us, late_us])
            } else {
                with.push([tick_us, late_us])
            }
            tasks.iter().for_each(|task| task.abort());
            if player.is_finished() {
                return player.await?;
            }
        }
    }
    let mean = |all: &[[f64; 2]], k: usize| all.iter().map(|turn| turn[k]).sum::<f64>() / all.len() as f64;
    for (k, what) in ["a tick", "late"].into_iter().enumerate() {
        let (with, without) = (mean(&with, k), mean(&without, k));
        let more = 100.0 * (with / without - 1.0);
        println!("{what}: {without:.1} µs without, {with:.1} µs with viewers: {more:+.2} %");
    }
    end.store(true, Ordering::Relaxed);
    player.await?
}
