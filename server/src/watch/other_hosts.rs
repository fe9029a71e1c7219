//! The runs of the other hosts of a fleet, for the viewers of this one.
//!
//! Which runs there are is read from the database, at most once a second and only while somebody watches. A run that is watched here
//! has one connection to its host, and a channel of its own, which all its viewers follow.

use super::access::{RunAccess, Watcher};
use super::channel::{Channel, Following, QueuedMessage, Source};
use super::frame::Frame;
use super::hub::{FindError, Hub, QUEUE_LENGTH};
use super::link::{CLOCK_PERIOD, FleetKey, LinkFrame, Opened, PATH, PROOF, ToViewerHost, encoded};
use super::messages::WatchRun;
use super::request::Target;
use super::sample::Overlays;
use crate::competition::Competition;
use anyhow::{Context, bail};
use futures_util::{SinkExt, StreamExt};
use palmares_store::{OpenRun, Store};
use palmares_tasks::Sensing;
use parking_lot::Mutex;
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;
use tokio::net::TcpStream;
use tokio::sync::{broadcast, watch};
use tokio::time::{Instant, MissedTickBehavior, interval, sleep, timeout};
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;

/// Shortest time between two readings of the open runs, and between two tries to reach a host.
const PERIOD: Duration = Duration::from_secs(1);
/// Longest time for a reading, and for a connection until its first frame.
const TIMEOUT: Duration = Duration::from_secs(2);
/// A connection without viewers is closed after this time.
const UNWATCHED: Duration = Duration::from_secs(3);
/// Time between two looks at the viewers of a connection.
const VIEWERS_PERIOD: Duration = Duration::from_millis(100);
/// A connection without a message for this time is dead.
const SILENCE: Duration = CLOCK_PERIOD.saturating_mul(3);

/// An open run, as the database has it.
#[derive(Clone, Debug)]
struct ForeignRun {
    info: WatchRun,
    sensing: Sensing,
    started_at: i64,
    /// Its host; None while it has none.
    host: Option<String>,
    /// Address of its host.
    url: Option<String>,
}

impl ForeignRun {
    fn of(row: OpenRun, competition: &Competition) -> Option<Self> {
        let task = competition.task(&row.task)?;
        Some(ForeignRun {
            info: WatchRun {
                run_id: row.run_id,
                session_id: row.session_id,
                team: row.team,
                tick_s: task.tick_s,
                time_limit_s: task.time_limit_s,
                task: row.task,
                hand: row.hand,
                official: row.official,
            },
            sensing: if row.sensing == "truth" { Sensing::Truth } else { Sensing::Sensors },
            started_at: row.started_at,
            host: row.host,
            url: row.url,
        })
    }

    fn access(&self) -> RunAccess<'_> {
        RunAccess { team: &self.info.team, official: self.info.official, sensing: self.sensing }
    }
}

/// A run's connection: its channel, and the time of the last try that failed.
#[derive(Debug, Default)]
struct Shared {
    channel: Option<Arc<Channel>>,
    failed: Option<Instant>,
}

/// The runs of the other hosts of a fleet.
#[derive(Debug)]
pub(crate) struct OtherHosts {
    store: Store,
    competition: Arc<Competition>,
    hub: Arc<Hub>,
    key: FleetKey,
    /// Time of the last reading.
    read: tokio::sync::Mutex<Option<Instant>>,
    /// The open runs of all hosts.
    runs: Mutex<Arc<Vec<ForeignRun>>>,
    /// By run id.
    shared: Mutex<HashMap<String, Arc<tokio::sync::Mutex<Shared>>>>,
    /// Whether a viewer waits for something that changes without a change of the open runs.
    awaited: AtomicBool,
}

/// The reason why a connection has ended.
enum LinkEnd {
    /// It has no viewers any more.
    Unwatched,
    /// The run is over: its last message.
    Ended(String),
    /// The host is gone, or has the run no longer.
    Lost,
}

type Link = WebSocketStream<TcpStream>;

impl OtherHosts {
    /// The other hosts of the fleet, which have the same key.
    pub(crate) fn new(store: Store, competition: Arc<Competition>, hub: Arc<Hub>, key: FleetKey) -> Self {
        hub.join_fleet();
        OtherHosts {
            store,
            competition,
            hub,
            key,
            read: Default::default(),
            runs: Default::default(),
            shared: Default::default(),
            awaited: AtomicBool::new(false),
        }
    }

    /// The key that all hosts share.
    pub(super) fn key(&self) -> &FleetKey {
        &self.key
    }

    /// Reads the open runs once a second while somebody watches.
    pub(crate) async fn keep_read(self: Arc<Self>) {
        let mut ticks = interval(PERIOD);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            ticks.tick().await;
            if self.hub.viewers() > 0 {
                self.refresh().await;
                if self.awaited.swap(false, Ordering::Relaxed) {
                    self.hub.look_again();
                }
            }
        }
    }

    /// Reads the open runs, unless that was done within the last second.
    async fn refresh(&self) {
        let mut read = self.read.lock().await;
        if read.is_some_and(|then| then.elapsed() < PERIOD) {
            return;
        }
        let rows = timeout(TIMEOUT, self.store.open_runs()).await;
        *read = Some(Instant::now());
        let rows = match rows {
            Ok(Ok(rows)) => rows,
            Ok(Err(error)) => {
                tracing::warn!(%error, "the runs of other hosts could not be read");
                return;
            }
            Err(_) => {
                tracing::warn!("the runs of other hosts could not be read: the database does not answer");
                return;
            }
        };
        let runs: Vec<_> =
            rows.into_iter().filter_map(|row| ForeignRun::of(row, &self.competition)).collect();
        let places = |runs: &[ForeignRun]| -> Vec<_> {
            runs.iter().map(|run| (run.info.run_id.clone(), run.host.clone())).collect()
        };
        let before = std::mem::replace(&mut *self.runs.lock(), Arc::new(runs.clone()));
        if places(&before) != places(&runs) {
            self.hub.look_again();
        }
    }

    /// The runs of other hosts that can be reached.
    async fn runs(&self) -> Vec<ForeignRun> {
        self.refresh().await;
        let all = self.runs.lock().clone();
        let here = self.store.host_name();
        let elsewhere =
            |run: &&ForeignRun| run.host.is_some() && run.host.as_deref() != here && run.url.is_some();
        all.iter().filter(elsewhere).cloned().collect()
    }

    /// The open runs of all hosts that this watcher may watch.
    pub(super) async fn list(&self, watcher: &Watcher) -> Vec<WatchRun> {
        let mut runs = self.hub.list(watcher);
        let elsewhere = self.runs().await.into_iter().filter(|run| watcher.may_watch(&run.access()));
        runs.extend(elsewhere.map(|run| run.info));
        runs.sort_by(|a, b| a.run_id.cmp(&b.run_id));
        runs.dedup_by(|a, b| a.run_id == b.run_id);
        runs
    }

    /// Follows the run that a target names, at any host. Of equal runs one of this host is featured.
    pub(super) async fn find(
        self: &Arc<Self>,
        target: &Target,
        watcher: &Watcher,
    ) -> Result<Following, FindError> {
        let here = self.hub.find(target, watcher);
        match (target, &here) {
            (Target::Leaderboard, _) | (_, Err(FindError::Forbidden)) => return here,
            (Target::Featured, Ok(following)) if !following.channel.info.official => {
                let official = |run: &ForeignRun| run.info.official && watcher.may_watch(&run.access());
                if !self.runs().await.iter().any(official) {
                    return here;
                }
            }
            (_, Ok(_)) => return here,
            (_, Err(_)) => {}
        }
        match (here, self.find_elsewhere(target, watcher).await) {
            (_, Ok(following)) | (Ok(following), _) => Ok(following),
            (Err(FindError::Waiting), Err(FindError::Unknown)) => Err(FindError::Waiting),
            (_, Err(error)) => Err(error),
        }
    }

    /// Follows the run of another host that a target names.
    async fn find_elsewhere(
        self: &Arc<Self>,
        target: &Target,
        watcher: &Watcher,
    ) -> Result<Following, FindError> {
        let mut runs = self.runs().await;
        match target {
            Target::Run(id) => {
                runs.retain(|run| run.info.run_id == *id);
                if runs.is_empty() {
                    if !self.may_continue(id).await {
                        return Err(FindError::Unknown);
                    }
                    // It has opened or moved since the last reading.
                    sleep(PERIOD).await;
                    runs = self.runs().await;
                    runs.retain(|run| run.info.run_id == *id);
                }
            }
            Target::Session(id) => {
                runs.retain(|run| run.info.session_id == *id);
                if runs.is_empty() {
                    let known = self.store.has_opened_a_run(id).await;
                    return Err(if known.unwrap_or(true) { FindError::Waiting } else { FindError::Unknown });
                }
            }
            Target::Featured => runs.retain(|run| watcher.may_watch(&run.access())),
            Target::Leaderboard => return Err(FindError::Waiting),
        }
        // The newest one first.
        runs.sort_by_key(|run| (!run.info.official, -run.started_at));
        let Some(first) = runs.first() else {
            return Err(FindError::Waiting);
        };
        if !watcher.may_watch(&first.access()) {
            return Err(FindError::Forbidden);
        }
        for run in &runs {
            if let Some(following) = self.follow(run).await {
                return Ok(following);
            }
        }
        self.awaited.store(true, Ordering::Relaxed);
        Err(FindError::Waiting)
    }

    /// Follows a run; its first viewer opens the connection. None if its host cannot be reached, or the run is over.
    async fn follow(self: &Arc<Self>, run: &ForeignRun) -> Option<Following> {
        let run_id = &run.info.run_id;
        let slot = self.shared.lock().entry(run_id.clone()).or_default().clone();
        let mut shared = slot.lock().await;
        if let Some(channel) = &shared.channel {
            return Some(Following::new(channel));
        }
        if shared.failed.is_some_and(|then| then.elapsed() < PERIOD) {
            return None;
        }
        let opened = match timeout(TIMEOUT, self.open(run)).await {
            Ok(Ok(opened)) => Ok(opened),
            Ok(Err(error)) => Err(format!("{error:#}")),
            Err(_) => Err("it does not answer".to_owned()),
        };
        match opened {
            Ok((link, opened, frame)) => {
                let channel = channel(opened, frame);
                let following = Following::new(&channel);
                *shared = Shared { channel: Some(channel.clone()), failed: None };
                drop(shared);
                tokio::spawn(self.clone().keep(channel, slot, link));
                Some(following)
            }
            Err(error) => {
                let host = run.host.as_deref().unwrap_or_default();
                tracing::warn!(error, host, run_id, "a run of another host cannot be shown");
                shared.failed = Some(Instant::now());
                None
            }
        }
    }

    /// Connects to the run's host. Returns the connection with its first two messages.
    async fn open(&self, run: &ForeignRun) -> anyhow::Result<(Link, Opened, LinkFrame)> {
        let uri: axum::http::Uri = run.url.as_deref().context("it has no internal_url")?.parse()?;
        let authority = uri.authority().context("its internal_url has no address")?;
        let run_id = &run.info.run_id;
        let mut request = format!("ws://{authority}{PATH}{run_id}").into_client_request()?;
        request.headers_mut().insert(PROOF, self.key.proof(run_id).parse()?);
        let socket = TcpStream::connect((authority.host(), authority.port_u16().unwrap_or(80))).await?;
        socket.set_nodelay(true)?;
        let (mut link, _) = tokio_tungstenite::client_async(request, socket).await?;
        let ToViewerHost::Opened(opened) = next(&mut link).await? else {
            bail!("its first message is wrong")
        };
        let ToViewerHost::Frame(frame) = next(&mut link).await? else { bail!("its second message is wrong") };
        Ok((link, opened, frame))
    }

    /// Passes on what the run's host sends, until the run is over or has no viewers; finds the run again when it has moved.
    async fn keep(
        self: Arc<Self>,
        channel: Arc<Channel>,
        slot: Arc<tokio::sync::Mutex<Shared>>,
        mut link: Link,
    ) {
        let last = loop {
            match self.pass_on(&channel, &slot, &mut link).await {
                LinkEnd::Unwatched => return,
                LinkEnd::Ended(text) => break QueuedMessage::Ended(text.into()),
                LinkEnd::Lost => {}
            }
            match self.find_again(&channel, &slot).await {
                Again::Link(found) => link = *found,
                Again::Here => break QueuedMessage::Moved,
                Again::Unwatched => return,
            }
        };
        // As in the hub: a run leaves the map before its last message.
        self.forget(&channel, &slot).await;
        let _ = channel.queue.send(last);
        self.hub.look_again();
    }

    async fn forget(&self, channel: &Channel, slot: &tokio::sync::Mutex<Shared>) {
        let mut shared = slot.lock().await;
        // A follower that has the slot already must not connect at once again.
        *shared = Shared { channel: None, failed: Some(Instant::now()) };
        self.shared.lock().remove(&channel.info.run_id);
    }

    /// Forgets a run that nobody watches. Under the lock: a viewer that comes now finds it, or opens it anew.
    async fn left(&self, channel: &Channel, slot: &tokio::sync::Mutex<Shared>) -> bool {
        let mut shared = slot.lock().await;
        let left = !channel.is_watched();
        if left {
            *shared = Shared::default();
            self.shared.lock().remove(&channel.info.run_id);
        }
        left
    }

    async fn pass_on(
        &self,
        channel: &Channel,
        slot: &tokio::sync::Mutex<Shared>,
        link: &mut Link,
    ) -> LinkEnd {
        let mut viewers = interval(VIEWERS_PERIOD);
        viewers.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let (mut watched, mut heard) = (Instant::now(), Instant::now());
        let mut sent = Overlays::default();
        loop {
            tokio::select! {
                message = next(link) => {
                    heard = Instant::now();
                    match message {
                        Ok(ToViewerHost::Frame(frame)) => show(channel, frame),
                        Ok(ToViewerHost::Message(text)) => {
                            // An error means that the last viewer has gone.
                            let _ = channel.queue.send(QueuedMessage::Message(text.into()));
                        }
                        Ok(ToViewerHost::Ended(text)) => return LinkEnd::Ended(text),
                        Ok(ToViewerHost::Clock(clock)) => channel.set_linked_clock(clock),
                        Ok(ToViewerHost::Opened(_)) => {}
                        Err(_) => return LinkEnd::Lost,
                    }
                }
                _ = viewers.tick() => {
                    if channel.is_watched() {
                        watched = Instant::now();
                    } else if watched.elapsed() >= UNWATCHED && self.left(channel, slot).await {
                        let _ = timeout(PERIOD, link.close(None)).await;
                        return LinkEnd::Unwatched;
                    }
                    if heard.elapsed() >= SILENCE {
                        return LinkEnd::Lost;
                    }
                    let wanted = channel.overlays.any();
                    if wanted != sent {
                        sent = wanted;
                        let message = Message::Binary(encoded(&wanted).into());
                        if !matches!(timeout(PERIOD, link.send(message)).await, Ok(Ok(()))) {
                            return LinkEnd::Lost;
                        }
                    }
                }
            }
        }
    }

    /// Looks for a run whose connection was lost until it is found, or nobody waits for it.
    async fn find_again(self: &Arc<Self>, channel: &Channel, slot: &tokio::sync::Mutex<Shared>) -> Again {
        let run_id = &channel.info.run_id;
        loop {
            if !channel.is_watched() && self.left(channel, slot).await {
                return Again::Unwatched;
            }
            if self.hub.has(run_id) || !self.may_continue(run_id).await {
                return Again::Here;
            }
            let found = self.runs().await.into_iter().find(|run| run.info.run_id == *run_id);
            if let Some(run) = found
                && let Ok(Ok((link, _, frame))) = timeout(TIMEOUT, self.open(&run)).await
            {
                show(channel, frame);
                return Again::Link(Box::new(link));
            }
            sleep(PERIOD / 2).await;
        }
    }

    /// Whether a run is open at any host, or may be: the database does not answer.
    pub(super) async fn may_continue(&self, run_id: &str) -> bool {
        let open = timeout(TIMEOUT, self.store.is_run_open(run_id)).await;
        let may = !matches!(open, Ok(Ok(false)));
        if may {
            self.awaited.store(true, Ordering::Relaxed);
        }
        may
    }
}

/// The outcome of the search for a run whose connection was lost.
enum Again {
    /// A host has it.
    Link(Box<Link>),
    /// This host has it, or nobody: the viewers look themselves.
    Here,
    /// It has no viewers any more.
    Unwatched,
}

/// The next message of a connection.
async fn next(link: &mut Link) -> anyhow::Result<ToViewerHost> {
    loop {
        match link.next().await.context("the connection has ended")?? {
            Message::Binary(bytes) => return Ok(postcard::from_bytes(&bytes)?),
            Message::Close(_) => bail!("the host has closed the connection"),
            _ => {}
        }
    }
}

/// The channel of a run of another host.
fn channel(opened: Opened, frame: LinkFrame) -> Arc<Channel> {
    let Opened { info, sensing, own_hand, scenes } = opened;
    Arc::new(Channel {
        frames: watch::Sender::new(Arc::new(Frame::linked(&info.run_id, frame))),
        sensing,
        own_hand,
        scenes: scenes.map(Into::into),
        source: Source::Host { clock: Mutex::default() },
        queue: broadcast::Sender::new(QUEUE_LENGTH),
        overlays: Default::default(),
        moved: AtomicU64::new(0),
        last_event: AtomicU64::new(0),
        pumping: AtomicBool::new(false),
        info,
    })
}

fn show(channel: &Channel, frame: LinkFrame) {
    channel.frames.send_replace(Arc::new(Frame::linked(&channel.info.run_id, frame)));
}
