//! Shows a run of this host to another host, for all of its viewers.

use super::access::Watcher;
use super::channel::{Following, QueuedMessage};
use super::context::WatchContext;
use super::hub::FindError;
use super::link::{CLOCK_PERIOD, LinkClock, Opened, PROOF, ToViewerHost, encoded};
use super::request::Target;
use super::sample::Overlays;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Path, State};
use axum::http::HeaderMap;
use axum::response::Response;
use palmares_metrics::METRICS;
use palmares_net::transport::problem::Problem;
use palmares_protocol::Code;
use std::time::Duration;
use tokio::sync::broadcast::error::RecvError;
use tokio::time::{Instant, MissedTickBehavior, interval, sleep_until, timeout};

/// Shortest time between two frames: 30 Hz.
const FRAME_PERIOD: Duration = Duration::from_micros(33_334);
/// Longest time for the other host to accept a message.
const SEND_TIMEOUT: Duration = Duration::from_secs(5);
/// Longest message of the other host, bytes.
const MESSAGE_BYTES: usize = 64;

/// `GET /v1/internal/watch/{run}`.
pub(crate) async fn relay(
    State(context): State<WatchContext>,
    Path(run_id): Path<String>,
    headers: HeaderMap,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Result<Response, Problem> {
    let proof = headers.get(PROOF).map(|proof| proof.as_bytes()).unwrap_or_default();
    let trusted = context.other_hosts.as_ref().is_some_and(|hosts| hosts.key().accepts(&run_id, proof));
    if !trusted {
        return Err(Problem::new(Code::NotAuthorized, "this address is for the other hosts of a fleet"));
    }
    let upgrade = upgrade.map_err(|rejection| {
        let message = format!("this address expects a WebSocket: {}", rejection.body_text());
        Problem::new(Code::BadRequest, message)
    })?;
    // The other host decides which of its viewers may watch the run.
    let found = context.hub.find(&Target::Run(run_id), &Watcher::Organizer);
    let following = found.map_err(|_: FindError| Problem::new(Code::NotFound, "the run is not open here"))?;
    let upgrade = upgrade.max_message_size(MESSAGE_BYTES).max_frame_size(MESSAGE_BYTES);
    // No `Caller` is kept: a host shows as many runs as its viewers watch, and has no limit of sockets.
    Ok(upgrade.on_upgrade(async move |socket| {
        let _counted = METRICS.relay();
        // An error means that the other host has gone.
        let _ = Relay { socket, context, following }.serve().await;
    }))
}

/// The other host has gone.
struct Gone;

struct Relay {
    socket: WebSocket,
    context: WatchContext,
    following: Following,
}

impl Relay {
    async fn serve(mut self) -> Result<(), Gone> {
        let channel = self.following.channel.clone();
        channel.pump();
        let opened = Opened {
            info: channel.info.clone(),
            sensing: channel.sensing,
            own_hand: channel.own_hand,
            scenes: channel.scenes.each_ref().map(|scene| scene.to_string()),
        };
        self.send(&ToViewerHost::Opened(opened)).await?;
        let mut clock = interval(CLOCK_PERIOD);
        clock.set_missed_tick_behavior(MissedTickBehavior::Delay);
        // A viewer that comes gets all overlays, even while the world is not stepped.
        let mut overlays = Overlays::ALL;
        self.send_frame(overlays).await?;
        overlays = Overlays::default();
        let mut next_frame = Instant::now() + FRAME_PERIOD;
        loop {
            let frames = &mut self.following.frames;
            let frame = async {
                sleep_until(next_frame).await;
                // An error means that the run is over: its last message comes through the queue.
                if frames.changed().await.is_err() {
                    std::future::pending::<()>().await;
                }
            };
            tokio::select! {
                biased;
                message = self.socket.recv() => match message {
                    Some(Ok(Message::Binary(bytes))) => {
                        overlays = postcard::from_bytes(&bytes).map_err(|_| Gone)?;
                        self.following.set_overlays(overlays);
                        self.send_frame(overlays).await?;
                    }
                    Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
                    _ => return Err(Gone),
                },
                message = self.following.queue.recv() => match message {
                    Ok(QueuedMessage::Message(text)) => {
                        self.send(&ToViewerHost::Message(text.to_string())).await?;
                    }
                    Ok(QueuedMessage::Ended(text)) => {
                        channel.refresh();
                        self.send_frame(Overlays::ALL).await?;
                        return self.send(&ToViewerHost::Ended(text.to_string())).await;
                    }
                    // The other host looks for the run again.
                    Ok(QueuedMessage::Moved) | Err(RecvError::Lagged(_) | RecvError::Closed) => return Ok(()),
                },
                _ = clock.tick() => {
                    let clock = self.context.clocks.get(&channel.info.session_id);
                    let clock = clock.map(|clock| LinkClock::of(&clock, self.context.lifecycle.now()));
                    self.send(&ToViewerHost::Clock(clock)).await?;
                }
                () = frame => {
                    self.send_frame(overlays).await?;
                    next_frame = Instant::now() + FRAME_PERIOD;
                }
            }
        }
    }

    /// Sends the newest frame.
    async fn send_frame(&mut self, overlays: Overlays) -> Result<(), Gone> {
        let frame = self.following.frames.borrow_and_update().clone();
        self.send(&ToViewerHost::Frame(frame.link(overlays))).await
    }

    async fn send(&mut self, message: &ToViewerHost) -> Result<(), Gone> {
        match timeout(SEND_TIMEOUT, self.socket.send(Message::Binary(encoded(message).into()))).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) | Err(_) => Err(Gone),
        }
    }
}
