//! One viewer's connection.

use super::access::Watcher;
use super::binary::Seven;
use super::channel::{Following, News};
use super::context::WatchContext;
use super::frame::text;
use super::hub::Nothing;
use super::messages::{Clock, Ranking, Runs, Score, Subscribed, WatchReply};
use super::request::{Request, Target, parse};
use super::snapshot::Overlays;
use crate::auth::Identity;
use crate::metrics::METRICS;
use crate::store::Announcement;
use crate::transport::farewell;
use axum::body::Bytes;
use axum::extract::ws::{Message, Utf8Bytes, WebSocket};
use palmares_protocol::reply::ErrorReply;
use palmares_protocol::text::shortened;
use palmares_protocol::{Code, Refusal};
use palmares_tasks::referee::ObjectStatus;
use std::future::pending;
use std::ops::ControlFlow;
use std::time::Duration;
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::watch;
use tokio::time::{Instant, MissedTickBehavior, interval_at, sleep_until, timeout};

/// Least time between two frames of a viewer. The run shows itself 30 times a second; a viewer that waits as long by itself
/// would miss a frame now and then.
const FRAME_PERIOD: Duration = Duration::from_millis(25);
/// Time between two frames that show all bodies.
const KEY_PERIOD: Duration = Duration::from_secs(10);
/// Time between two clocks.
const CLOCK_PERIOD: Duration = Duration::from_secs(1);
/// Least time between two verdicts.
const VERDICTS_PERIOD: Duration = Duration::from_millis(500);
/// Least time between two rankings.
const RANKING_PERIOD: Duration = Duration::from_secs(1);
/// How long a viewer may take to accept a message.
const SEND_TIMEOUT: Duration = Duration::from_secs(5);

/// Why a connection ends: with a close code and a reason, or because the viewer is gone.
type End = Option<(u16, &'static str)>;

/// One viewer's connection.
pub(super) struct Viewer {
    socket: WebSocket,
    context: WatchContext,
    watcher: Watcher,
    target: Option<Target>,
    following: Option<Following>,
    /// The run and the score that were told last.
    told: Option<(String, f64)>,
    changes: watch::Receiver<u64>,
    ranking: watch::Receiver<u64>,
    announced: watch::Receiver<Option<Announcement>>,
    /// Whether poses are binary frames.
    binary: bool,
    /// What it wants to see; none if it never said.
    overlays: Option<Overlays>,
    /// Where bodies were when they were last sent, and when all are sent again.
    sent: Vec<Seven>,
    next_key: Instant,
    /// Tick and time of the last clock.
    clocked: Option<(u64, Instant)>,
    next_clock: Instant,
    /// The verdicts that were told last, and whether there may be newer ones.
    judged: Option<Vec<ObjectStatus>>,
    unjudged: bool,
    next_verdicts: Instant,
    next_frame: Instant,
    next_ranking: Instant,
    heard: Instant,
}

/// What a run has for its viewers.
enum Next {
    /// A word that must not be skipped.
    News(Result<News, RecvError>),
    /// A frame newer than the last.
    Frame,
}

/// The next that the run that is followed has to show; frames not before a certain time.
async fn next(following: &mut Option<Following>, not_before: Instant) -> Next {
    let Some(Following { frames, news, .. }) = following else { return pending().await };
    let frame = async {
        sleep_until(not_before).await;
        // An error means that the run is over: its last word comes as news.
        if frames.changed().await.is_err() {
            pending::<()>().await;
        }
    };
    tokio::select! {
        biased;
        news = news.recv() => Next::News(news),
        () = frame => Next::Frame,
    }
}

/// Returns when there is something new, and not before a certain time.
async fn fresh<T>(changes: &mut watch::Receiver<T>, not_before: Instant) {
    sleep_until(not_before).await;
    if changes.changed().await.is_err() {
        pending::<()>().await;
    }
}

impl Viewer {
    pub(super) fn new(socket: WebSocket, context: WatchContext, watcher: Watcher, binary: bool) -> Self {
        let now = Instant::now();
        let (changes, mut ranking) = (context.hub.changes(), context.hub.ranking_changes());
        let mut announced = context.hub.announcements();
        // The first ones are for everybody who comes.
        ranking.mark_changed();
        announced.mark_changed();
        Viewer {
            socket,
            context,
            watcher,
            target: None,
            following: None,
            told: None,
            changes,
            ranking,
            announced,
            binary,
            overlays: None,
            sent: Vec::new(),
            next_key: now,
            clocked: None,
            next_clock: now,
            judged: None,
            unjudged: false,
            next_verdicts: now,
            next_frame: now,
            next_ranking: now,
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
                () = &mut stopping => ControlFlow::Break(Some((1001, "server_shutdown"))),
                () = &mut revoked => {
                    let refusal = Refusal::new(Code::NotAuthorized, "the token was revoked").fatal();
                    self.refuse(None, &refusal).await
                }
                _ = ping.tick() => self.beat().await,
                message = self.socket.recv() => self.receive(message).await,
                changed = self.changes.changed(), if self.target.is_some() && self.following.is_none() => {
                    match changed {
                        Ok(()) => self.follow().await,
                        Err(_) => ControlFlow::Break(None),
                    }
                }
                () = fresh(&mut self.ranking, self.next_ranking), if self.target.is_some() => self.rank().await,
                () = fresh(&mut self.announced, Instant::now()), if self.target.is_some() => self.announce().await,
                () = sleep_until(self.next_clock), if self.following.is_some() && self.is_told_more() => self.clock().await,
                () = sleep_until(self.next_verdicts), if self.unjudged => self.judge().await,
                next = next(&mut self.following, self.next_frame) => match next {
                    Next::News(news) => self.tell(news).await,
                    Next::Frame => self.show().await,
                },
            };
            if let ControlFlow::Break(end) = flow {
                break end;
            }
        };
        if let Some((code, reason)) = end {
            farewell(self.socket, code, reason).await;
        }
    }

    async fn beat(&mut self) -> ControlFlow<End> {
        if self.heard.elapsed() >= self.context.competition.settings.ping_timeout {
            return ControlFlow::Break(None);
        }
        self.send_message(Message::Ping(Bytes::new())).await
    }

    async fn receive(&mut self, message: Option<Result<Message, axum::Error>>) -> ControlFlow<End> {
        self.heard = Instant::now();
        let text = match message {
            None | Some(Ok(Message::Close(_)) | Err(_)) => return ControlFlow::Break(None),
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
                let runs = self.context.hub.list(&self.watcher);
                self.send(&WatchReply::Runs(Runs { id, runs })).await
            }
            (_, Ok(Request::Bye)) => ControlFlow::Break(Some((1000, "bye"))),
            (id, Err(refusal)) => self.refuse(id, &refusal).await,
            // The parser gives no request without an id.
            (None, Ok(_)) => ControlFlow::Continue(()),
        }
    }

    async fn subscribe(&mut self, id: u64, target: Target, overlays: Option<Overlays>) -> ControlFlow<End> {
        // What opens from here on is looked at again.
        self.changes.mark_unchanged();
        let found = match (self.context.hub.find(&target, &self.watcher), &target) {
            (Ok(following), _) => Some(following),
            (Err(Nothing::Waiting), _) => None,
            (Err(Nothing::Forbidden), _) => {
                let message = "this is not for you to watch; `list` tells what is";
                let anybody = self.watcher == Watcher::Anybody;
                let code = if anybody { Code::NotAuthorized } else { Code::Forbidden };
                return self.refuse(Some(id), &Refusal::new(code, message)).await;
            }
            (Err(Nothing::Unknown), Target::Run(run)) => {
                let message = format!("no open run `{}`; `list` tells which there are", shortened(run));
                return self.refuse(Some(id), &Refusal::new(Code::NotFound, message)).await;
            }
            (Err(Nothing::Unknown), Target::Session(session)) => {
                let message = format!(
                    "no session `{}` has opened a run; `list` tells which there are",
                    shortened(session)
                );
                return self.refuse(Some(id), &Refusal::new(Code::NotFound, message)).await;
            }
            (Err(Nothing::Unknown), Target::Featured | Target::Leaderboard) => None,
        };
        if self.target.is_none() {
            self.ranking.mark_changed();
        }
        self.target = Some(target);
        self.overlays = overlays;
        let run_id = found.as_ref().map(|following| following.channel.info.run_id.clone());
        self.send(&WatchReply::Subscribed(Subscribed { id, run_id })).await?;
        self.start(found).await
    }

    /// A run opened or ended somewhere while there was nothing to show.
    async fn follow(&mut self) -> ControlFlow<End> {
        let Some(target) = &self.target else { return ControlFlow::Continue(()) };
        let found = self.context.hub.find(target, &self.watcher).ok();
        self.start(found).await
    }

    async fn start(&mut self, found: Option<Following>) -> ControlFlow<End> {
        self.following = found;
        self.told = None;
        self.sent.clear();
        self.clocked = None;
        self.next_clock = Instant::now();
        (self.judged, self.unjudged) = (None, false);
        if let Some(following) = &mut self.following {
            following.want(self.overlays.unwrap_or_default());
            following.channel.pump();
            let scene = following.channel.scene(&self.watcher);
            self.send_text(scene).await?;
            self.show().await?;
        }
        ControlFlow::Continue(())
    }

    /// Sends the newest frame, and the score when it has changed.
    async fn show(&mut self) -> ControlFlow<End> {
        let Some(following) = &mut self.following else { return ControlFlow::Continue(()) };
        let frame = following.frames.borrow_and_update().clone();
        let run_id = following.channel.info.run_id.clone();
        let overlays = self.overlays.unwrap_or_default();
        self.unjudged = overlays.verdicts;
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
        let (tick, score) = (frame.snapshot.tick, frame.snapshot.score);
        if self.told.as_ref().is_none_or(|told| *told != (run_id.clone(), score)) {
            self.told = Some((run_id.clone(), score));
            self.send(&WatchReply::Score(Score { run_id, tick, score })).await?;
        }
        // Counted from when the viewer has taken it: a slow one gets fewer.
        self.next_frame = Instant::now() + FRAME_PERIOD;
        ControlFlow::Continue(())
    }

    /// Whether it is told what early viewers do not know of.
    fn is_told_more(&self) -> bool {
        self.binary || self.overlays.is_some()
    }

    /// Tells how time goes on.
    async fn clock(&mut self) -> ControlFlow<End> {
        let Some(following) = &self.following else { return ControlFlow::Continue(()) };
        let info = &following.channel.info;
        let newest = following.channel.snapshots.borrow().clone();
        let (now, session_now) = (Instant::now(), self.context.lifecycle.now());
        let before = self.clocked.replace((newest.tick, now));
        let real_time_factor = before.map(|(tick, then)| {
            newest.tick.saturating_sub(tick) as f64 * info.tick_s / (now - then).as_secs_f64()
        });
        let clock = self.context.clocks.get(&info.session_id);
        let message = Clock {
            run_id: info.run_id.clone(),
            session_left_s: clock.as_ref().and_then(|clock| clock.left_s(session_now)),
            elapsed_s: clock.as_ref().map(|clock| clock.elapsed_s(session_now)),
            paused: clock.as_ref().map(|clock| clock.is_paused()),
            real_time_factor: real_time_factor.filter(|factor| factor.is_finite()),
            late_s: newest.late_s,
        };
        self.next_clock = now + CLOCK_PERIOD;
        self.send(&WatchReply::Clock(message)).await
    }

    /// Tells why objects count, if it has changed.
    async fn judge(&mut self) -> ControlFlow<End> {
        self.unjudged = false;
        let Some(following) = &self.following else { return ControlFlow::Continue(()) };
        let frame = following.frames.borrow().clone();
        let Some(verdicts) = frame.verdicts() else { return ControlFlow::Continue(()) };
        if self.judged.as_ref() == Some(verdicts) {
            return ControlFlow::Continue(());
        }
        self.judged = Some(verdicts.clone());
        self.next_verdicts = Instant::now() + VERDICTS_PERIOD;
        self.send_text(frame.verdicts_text(verdicts)).await
    }

    async fn tell(&mut self, news: Result<News, RecvError>) -> ControlFlow<End> {
        match news {
            Ok(News::Message(text)) => self.send_text(text).await,
            Ok(News::Ended(text)) => {
                // The last frame, which may still wait for its time.
                if let Some(following) = &self.following {
                    following.channel.refresh();
                }
                let fresh = |following: &Following| following.frames.has_changed().unwrap_or(true);
                if self.following.as_ref().is_some_and(fresh) {
                    self.show().await?;
                }
                if self.unjudged {
                    self.judge().await?;
                }
                self.send_text(text).await?;
                self.following = None;
                self.unjudged = false;
                if matches!(self.target, Some(Target::Run(_))) {
                    self.target = None;
                    return ControlFlow::Continue(());
                }
                self.changes.mark_unchanged();
                self.follow().await
            }
            Err(RecvError::Lagged(_)) => {
                let message = "this connection is too slow for what happens; its messages were given up";
                self.refuse(None, &Refusal::new(Code::TooSlow, message).fatal()).await
            }
            Err(RecvError::Closed) => {
                self.following = None;
                ControlFlow::Continue(())
            }
        }
    }

    async fn rank(&mut self) -> ControlFlow<End> {
        self.next_ranking = Instant::now() + RANKING_PERIOD;
        match self.context.store.leaderboard(self.context.competition.rules.official()).await {
            Ok(rows) => self.send(&WatchReply::Leaderboard(Ranking { rows })).await,
            Err(error) => {
                // The viewer has the last one, and gets the next.
                tracing::error!(%error, "store failed");
                ControlFlow::Continue(())
            }
        }
    }

    async fn announce(&mut self) -> ControlFlow<End> {
        let told = self.announced.borrow_and_update().clone();
        match told {
            Some(told) => self.send(&WatchReply::Announcement(told)).await,
            None => ControlFlow::Continue(()),
        }
    }

    async fn refuse(&mut self, id: Option<u64>, refusal: &Refusal) -> ControlFlow<End> {
        METRICS.refused(refusal.code);
        self.send(&WatchReply::Error(ErrorReply::of(id, refusal))).await?;
        if refusal.fatal {
            return ControlFlow::Break(Some((refusal.code.close_code(), refusal.code.name())));
        }
        ControlFlow::Continue(())
    }

    async fn send(&mut self, message: &WatchReply) -> ControlFlow<End> {
        self.send_text(text(message)).await
    }

    async fn send_text(&mut self, text: Utf8Bytes) -> ControlFlow<End> {
        self.send_message(Message::Text(text)).await
    }

    async fn send_message(&mut self, message: Message) -> ControlFlow<End> {
        match timeout(SEND_TIMEOUT, self.socket.send(message)).await {
            Ok(Ok(())) => ControlFlow::Continue(()),
            Ok(Err(_)) | Err(_) => ControlFlow::Break(None),
        }
    }
}
