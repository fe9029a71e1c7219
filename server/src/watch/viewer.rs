//! One viewer's connection.

use super::access::Watcher;
use super::binary::WirePose;
use super::channel::{Following, QueuedMessage};
use super::context::WatchContext;
use super::frame::{ended, text};
use super::hub::FindError;
use super::link::LinkClock;
use super::messages::{Clock, Runs, Score, Subscribed, WatchReply};
use super::ranking_cache::Readings;
use super::request::{Request, Target, parse};
use super::sample::Overlays;
use axum::body::Bytes;
use axum::extract::ws::{Message, Utf8Bytes, WebSocket};
use palmares_metrics::METRICS;
use palmares_net::auth::Identity;
use palmares_net::config::settings::MESSAGE_BYTES;
use palmares_net::transport::{FrameError, answer_close, close_handshake};
use palmares_protocol::reply::ErrorReply;
use palmares_protocol::text::shortened;
use palmares_protocol::{Code, Refusal};
use palmares_store::Announcement;
use palmares_tasks::referee::ObjectStatus;
use std::future::pending;
use std::ops::ControlFlow;
use std::time::Duration;
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::watch;
use tokio::time::{Instant, MissedTickBehavior, interval_at, sleep_until, timeout};

/// Shortest time between two frames for a viewer. Less than the run's 33 ms, or a viewer would miss a frame now and then.
const FRAME_PERIOD: Duration = Duration::from_millis(25);
/// Time between two frames that show all bodies.
const KEY_PERIOD: Duration = Duration::from_secs(10);
/// Time between two messages `clock`.
const CLOCK_PERIOD: Duration = Duration::from_secs(1);
/// Shortest time between two messages `verdicts`.
const VERDICTS_PERIOD: Duration = Duration::from_millis(500);
/// Longest time for a viewer to accept a message.
const SEND_TIMEOUT: Duration = Duration::from_secs(5);

/// Reason why a connection ends.
enum ViewerEnd {
    /// The viewer is gone.
    Lost,
    /// The viewer closed the connection.
    Closed,
    /// The server closes it: code and reason of the close frame.
    Close(u16, Utf8Bytes),
}

impl ViewerEnd {
    fn close(code: u16, reason: &'static str) -> Self {
        ViewerEnd::Close(code, Utf8Bytes::from_static(reason))
    }
}

/// One viewer's connection.
pub(super) struct Viewer {
    socket: WebSocket,
    context: WatchContext,
    watcher: Watcher,
    target: Option<Target>,
    following: Option<Following>,
    /// The run that was shown here and may continue on another host.
    moved: Option<String>,
    /// The run and the score that were sent last.
    sent_score: Option<(String, f64)>,
    changes: watch::Receiver<u64>,
    /// Changes of the ranking, and the rankings that were read after some of them.
    ranking: watch::Receiver<u64>,
    rankings: watch::Receiver<Readings>,
    announced: watch::Receiver<Option<Announcement>>,
    /// Whether poses are binary frames.
    binary: bool,
    /// Its overlays; None if the client did not send the field.
    overlays: Option<Overlays>,
    /// Last sent poses, and when all are sent again.
    sent: Vec<WirePose>,
    next_key: Instant,
    /// Tick and time of the last message `clock`.
    sent_clock: Option<(u64, Instant)>,
    next_clock: Instant,
    /// The judgements that were sent last, and whether there may be newer ones.
    sent_verdicts: Option<Vec<ObjectStatus>>,
    verdicts_due: bool,
    next_verdicts: Instant,
    next_frame: Instant,
    /// Number of changes before the ranking that was sent last.
    sent_ranking: Option<u64>,
    heard: Instant,
}

/// The next item of the run that is followed.
enum Next {
    /// A message that must not be skipped.
    Queued(Result<QueuedMessage, RecvError>),
    /// A frame newer than the last.
    Frame,
}

/// The next item of the run that is followed; a frame not before `not_before`.
async fn next(following: &mut Option<Following>, not_before: Instant) -> Next {
    let Some(Following { frames, queue, .. }) = following else { return pending().await };
    let frame = async {
        sleep_until(not_before).await;
        // An error means that the run is over: its last message comes through the queue.
        if frames.changed().await.is_err() {
            pending::<()>().await;
        }
    };
    tokio::select! {
        biased;
        message = queue.recv() => Next::Queued(message),
        () = frame => Next::Frame,
    }
}

/// Returns when the value has changed.
async fn changed<T>(changes: &mut watch::Receiver<T>) {
    if changes.changed().await.is_err() {
        pending::<()>().await;
    }
}

impl Viewer {
    pub(super) fn new(socket: WebSocket, context: WatchContext, watcher: Watcher, binary: bool) -> Self {
        let now = Instant::now();
        let (changes, ranking) = (context.hub.changes(), context.hub.ranking_changes());
        let (rankings, mut announced) = (context.ranking.readings(), context.hub.announcements());
        // Every new viewer gets the current one.
        announced.mark_changed();
        Viewer {
            socket,
            context,
            watcher,
            target: None,
            following: None,
            moved: None,
            sent_score: None,
            changes,
            ranking,
            rankings,
            announced,
            binary,
            overlays: None,
            sent: Vec::new(),
            next_key: now,
            sent_clock: None,
            next_clock: now,
            sent_verdicts: None,
            verdicts_due: false,
            next_verdicts: now,
            next_frame: now,
            sent_ranking: None,
            heard: now,
        }
    }

    pub(super) async fn serve(mut self, identity: Option<&Identity>) {
        let context = self.context.clone();
        let revoked = context.auth.revoked(identity);
        tokio::pin!(revoked);
        let stopping = context.lifecycle.stopping();
        tokio::pin!(stopping);
        let interval = self.context.competition.settings.ping_interval();
        let mut ping = interval_at(Instant::now() + interval, interval);
        ping.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let end = loop {
            let flow = tokio::select! {
                biased;
                () = &mut stopping => ControlFlow::Break(ViewerEnd::close(1001, "server_shutdown")),
                () = &mut revoked => {
                    let refusal = Refusal::new(Code::NotAuthorized, "the token was revoked").fatal();
                    self.refuse(None, &refusal).await
                }
                _ = ping.tick() => self.ping().await,
                message = self.socket.recv() => self.receive(message).await,
                changed = self.changes.changed(), if self.target.is_some() && self.following.is_none() => {
                    match changed {
                        Ok(()) => self.follow().await,
                        Err(_) => ControlFlow::Break(ViewerEnd::Lost),
                    }
                }
                () = changed(&mut self.ranking), if self.target.is_some() => {
                    self.context.ranking.refresh();
                    ControlFlow::Continue(())
                }
                () = changed(&mut self.rankings), if self.target.is_some() => self.send_ranking().await,
                () = changed(&mut self.announced), if self.target.is_some() => self.send_announcement().await,
                () = sleep_until(self.next_clock), if self.following.is_some() && self.has_extensions() => self.send_clock().await,
                () = sleep_until(self.next_verdicts), if self.verdicts_due => self.send_verdicts().await,
                next = next(&mut self.following, self.next_frame) => match next {
                    Next::Queued(message) => self.forward(message).await,
                    Next::Frame => self.send_frame().await,
                },
            };
            if let ControlFlow::Break(end) = flow {
                break end;
            }
        };
        match end {
            ViewerEnd::Lost => {}
            ViewerEnd::Closed => answer_close(self.socket).await,
            ViewerEnd::Close(code, reason) => close_handshake(self.socket, code, reason).await,
        }
    }

    async fn ping(&mut self) -> ControlFlow<ViewerEnd> {
        if self.heard.elapsed() >= self.context.competition.settings.ping_timeout {
            return ControlFlow::Break(ViewerEnd::Lost);
        }
        self.send_message(Message::Ping(Bytes::new())).await
    }

    async fn receive(&mut self, message: Option<Result<Message, axum::Error>>) -> ControlFlow<ViewerEnd> {
        self.heard = Instant::now();
        let text = match message {
            None => return ControlFlow::Break(ViewerEnd::Lost),
            Some(Ok(Message::Close(_))) => return ControlFlow::Break(ViewerEnd::Closed),
            Some(Err(error)) => match FrameError::of(&error) {
                FrameError::TooLarge => {
                    let message = format!("a message may have at most {MESSAGE_BYTES} bytes");
                    return self.refuse(None, &Refusal::new(Code::TooLarge, message).fatal()).await;
                }
                FrameError::Violation(code, reason) => {
                    return ControlFlow::Break(ViewerEnd::Close(code, reason.into()));
                }
                FrameError::Lost => return ControlFlow::Break(ViewerEnd::Lost),
            },
            Some(Ok(Message::Ping(_) | Message::Pong(_))) => return ControlFlow::Continue(()),
            Some(Ok(Message::Binary(_))) => {
                let message = "requests are text frames, in JSON";
                return self.refuse(None, &Refusal::new(Code::BadJson, message)).await;
            }
            Some(Ok(Message::Text(text))) => text,
        };
        match parse(&text) {
            (Some(id), Ok(Request::Subscribe(target, overlays))) => {
                self.subscribe(id, target, overlays).await
            }
            (Some(id), Ok(Request::List)) => {
                let runs = self.context.list(&self.watcher).await;
                self.send(&WatchReply::Runs(Runs { id, runs })).await
            }
            (_, Ok(Request::Bye)) => ControlFlow::Break(ViewerEnd::close(1000, "bye")),
            (id, Err(refusal)) => self.refuse(id, &refusal).await,
            // The parser returns no request without an id.
            (None, Ok(_)) => ControlFlow::Continue(()),
        }
    }

    async fn subscribe(
        &mut self,
        id: u64,
        target: Target,
        overlays: Option<Overlays>,
    ) -> ControlFlow<ViewerEnd> {
        // Runs that open from now on are looked up again.
        self.changes.mark_unchanged();
        let found = match (self.context.find(&target, &self.watcher).await, &target) {
            (Ok(following), _) => Some(following),
            (Err(FindError::Waiting), _) => None,
            (Err(FindError::Forbidden), _) => {
                let message = "you may not watch this; `list` shows the runs that you may watch";
                let anybody = self.watcher == Watcher::Anybody;
                let code = if anybody { Code::NotAuthorized } else { Code::Forbidden };
                return self.refuse(Some(id), &Refusal::new(code, message)).await;
            }
            (Err(FindError::Unknown), Target::Run(run)) => {
                let message = format!("no open run `{}`; `list` shows the open runs", shortened(run));
                return self.refuse(Some(id), &Refusal::new(Code::NotFound, message)).await;
            }
            (Err(FindError::Unknown), Target::Session(session)) => {
                let message = format!(
                    "no session `{}` has opened a run; `list` shows the open runs",
                    shortened(session)
                );
                return self.refuse(Some(id), &Refusal::new(Code::NotFound, message)).await;
            }
            (Err(FindError::Unknown), Target::Featured | Target::Leaderboard) => None,
        };
        if self.target.is_none() {
            // The current ranking; if it has changed since it was read, after the next reading.
            self.sent_ranking = None;
            match self.context.ranking.is_stale() {
                true => self.context.ranking.refresh(),
                false => self.rankings.mark_changed(),
            }
        }
        self.target = Some(target);
        self.overlays = overlays;
        self.moved = None;
        let run_id = found.as_ref().map(|following| following.channel.info.run_id.clone());
        self.send(&WatchReply::Subscribed(Subscribed { id, run_id })).await?;
        self.start(found).await
    }

    /// Looks for a run to show, after a run has opened or ended.
    async fn follow(&mut self) -> ControlFlow<ViewerEnd> {
        let Some(target) = &self.target else { return ControlFlow::Continue(()) };
        // Runs that open from now on are looked up again.
        self.changes.mark_unchanged();
        let found = self.context.find(target, &self.watcher).await.ok();
        if let Some(run_id) = self.moved.take() {
            let goes_on = found.as_ref().is_some_and(|following| following.channel.info.run_id == run_id);
            if !goes_on && self.context.may_continue(&run_id).await {
                self.moved = Some(run_id);
                return ControlFlow::Continue(());
            }
            if !goes_on {
                self.send_text(ended(run_id, None, None)).await?;
                if matches!(self.target, Some(Target::Run(_))) {
                    self.target = None;
                    return ControlFlow::Continue(());
                }
            }
        }
        self.start(found).await
    }

    async fn start(&mut self, found: Option<Following>) -> ControlFlow<ViewerEnd> {
        self.following = found;
        self.sent_score = None;
        self.sent.clear();
        self.sent_clock = None;
        self.next_clock = Instant::now();
        (self.sent_verdicts, self.verdicts_due) = (None, false);
        if let Some(following) = &mut self.following {
            following.set_overlays(self.overlays.unwrap_or_default());
            following.channel.pump();
            let scene = following.channel.scene(&self.watcher);
            self.send_text(scene).await?;
            self.send_frame().await?;
        }
        ControlFlow::Continue(())
    }

    /// Sends the newest frame, and the score when it has changed.
    async fn send_frame(&mut self) -> ControlFlow<ViewerEnd> {
        let Some(following) = &mut self.following else { return ControlFlow::Continue(()) };
        let frame = following.frames.borrow_and_update().clone();
        let run_id = following.channel.info.run_id.clone();
        let overlays = self.overlays.unwrap_or_default();
        self.verdicts_due = overlays.verdicts;
        if self.binary {
            let now = Instant::now();
            let key = self.sent.is_empty() || now >= self.next_key;
            if key {
                self.next_key = now + KEY_PERIOD;
            }
            let bytes = frame.bytes(overlays, &mut self.sent, key);
            self.send_message(Message::Binary(bytes.into())).await?;
        } else {
            self.send_text(frame.text(overlays)).await?;
        }
        let (tick, score) = (frame.sample.tick, frame.sample.score);
        if self.sent_score.as_ref().is_none_or(|sent| *sent != (run_id.clone(), score)) {
            self.sent_score = Some((run_id.clone(), score));
            self.send(&WatchReply::Score(Score { run_id, tick, score })).await?;
        }
        // From the end of sending: a slow viewer gets fewer frames.
        self.next_frame = Instant::now() + FRAME_PERIOD;
        ControlFlow::Continue(())
    }

    /// Whether the client knows `clock`, which clients without `overlays` and binary frames do not.
    fn has_extensions(&self) -> bool {
        self.binary || self.overlays.is_some()
    }

    /// Sends the session's clock.
    async fn send_clock(&mut self) -> ControlFlow<ViewerEnd> {
        let Some(following) = &self.following else { return ControlFlow::Continue(()) };
        let info = &following.channel.info;
        let newest = following.channel.newest();
        let (now, session_now) = (Instant::now(), self.context.lifecycle.now());
        let before = self.sent_clock.replace((newest.tick, now));
        let real_time_factor = before.map(|(tick, then)| {
            newest.tick.saturating_sub(tick) as f64 * info.tick_s / (now - then).as_secs_f64()
        });
        let clock = following.channel.linked_clock().or_else(|| {
            let clock = self.context.clocks.get(&info.session_id)?;
            Some(LinkClock::of(&clock, session_now))
        });
        let message = Clock {
            run_id: info.run_id.clone(),
            session_left_s: clock.as_ref().and_then(|clock| clock.left_s),
            elapsed_s: clock.as_ref().map(|clock| clock.elapsed_s),
            paused: clock.as_ref().map(|clock| clock.paused),
            real_time_factor: real_time_factor.filter(|factor| factor.is_finite()),
            late_s: newest.late_s,
        };
        self.next_clock = now + CLOCK_PERIOD;
        self.send(&WatchReply::Clock(message)).await
    }

    /// Sends why objects count or do not, if it has changed.
    async fn send_verdicts(&mut self) -> ControlFlow<ViewerEnd> {
        self.verdicts_due = false;
        let Some(following) = &self.following else { return ControlFlow::Continue(()) };
        let frame = following.frames.borrow().clone();
        let Some(verdicts) = frame.verdicts() else { return ControlFlow::Continue(()) };
        if self.sent_verdicts.as_ref() == Some(verdicts) {
            return ControlFlow::Continue(());
        }
        self.sent_verdicts = Some(verdicts.clone());
        self.next_verdicts = Instant::now() + VERDICTS_PERIOD;
        self.send_text(frame.verdicts_text(verdicts)).await
    }

    /// Sends a message of the queue; after the last one of a run it follows the next run.
    async fn forward(&mut self, message: Result<QueuedMessage, RecvError>) -> ControlFlow<ViewerEnd> {
        match message {
            Ok(QueuedMessage::Message(text)) => self.send_text(text).await,
            Ok(QueuedMessage::Ended(text)) => {
                // The last frame first, even if the viewer's period has not passed.
                if let Some(following) = &self.following {
                    following.channel.refresh();
                }
                let unsent = |following: &Following| following.frames.has_changed().unwrap_or(true);
                if self.following.as_ref().is_some_and(unsent) {
                    self.send_frame().await?;
                }
                if self.verdicts_due {
                    self.send_verdicts().await?;
                }
                self.send_text(text).await?;
                self.following = None;
                self.verdicts_due = false;
                if matches!(self.target, Some(Target::Run(_))) {
                    self.target = None;
                    return ControlFlow::Continue(());
                }
                self.follow().await
            }
            Ok(QueuedMessage::Moved) => {
                self.moved = self.following.take().map(|following| following.channel.info.run_id.clone());
                self.verdicts_due = false;
                self.follow().await
            }
            Err(RecvError::Lagged(_)) => {
                let message = "this connection is too slow: messages were lost";
                self.refuse(None, &Refusal::new(Code::TooSlow, message).fatal()).await
            }
            Err(RecvError::Closed) => {
                self.following = None;
                ControlFlow::Continue(())
            }
        }
    }

    /// Sends the ranking that was read last, and has it read again if it has changed since.
    async fn send_ranking(&mut self) -> ControlFlow<ViewerEnd> {
        let newest = self.rankings.borrow_and_update().newest.clone();
        self.context.ranking.refresh();
        match newest {
            Some(newest) if self.sent_ranking != Some(newest.changes) => {
                self.sent_ranking = Some(newest.changes);
                self.send_text(newest.message()).await
            }
            _ => ControlFlow::Continue(()),
        }
    }

    async fn send_announcement(&mut self) -> ControlFlow<ViewerEnd> {
        let announcement = self.announced.borrow_and_update().clone();
        match announcement {
            Some(announcement) => self.send(&WatchReply::Announcement(announcement)).await,
            None => ControlFlow::Continue(()),
        }
    }

    async fn refuse(&mut self, id: Option<u64>, refusal: &Refusal) -> ControlFlow<ViewerEnd> {
        METRICS.refused(refusal.code);
        self.send(&WatchReply::Error(ErrorReply::of(id, refusal))).await?;
        if refusal.fatal {
            return ControlFlow::Break(ViewerEnd::close(refusal.code.close_code(), refusal.code.name()));
        }
        ControlFlow::Continue(())
    }

    async fn send(&mut self, message: &WatchReply) -> ControlFlow<ViewerEnd> {
        self.send_text(text(message)).await
    }

    async fn send_text(&mut self, text: Utf8Bytes) -> ControlFlow<ViewerEnd> {
        self.send_message(Message::Text(text)).await
    }

    async fn send_message(&mut self, message: Message) -> ControlFlow<ViewerEnd> {
        match timeout(SEND_TIMEOUT, self.socket.send(message)).await {
            Ok(Ok(())) => ControlFlow::Continue(()),
            Ok(Err(_)) | Err(_) => ControlFlow::Break(ViewerEnd::Lost),
        }
    }
}
