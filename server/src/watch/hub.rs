//! Where runs publish and viewers find them.

use super::access::{Watched, Watcher};
use super::frame::{self, Frame};
use super::messages::{Ended, Events, Final, WatchReply, WatchRun};
use super::request::Target;
use crate::store::Announcement;
use crate::world::Witness;
use axum::extract::ws::Utf8Bytes;
use palmares_tasks::{Outcome, Run, Sensing};
use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, broadcast, watch};

/// Viewers at once.
const MAX_VIEWERS: usize = 256;
/// Messages that must not be skipped and that a viewer has not taken yet; one that lets more gather is closed.
const QUEUE: usize = 256;
/// How often a run that nobody watches shows itself, for whoever comes next while its world stands still.
const UNWATCHED_PERIOD: Duration = Duration::from_millis(100);
/// Sessions that are remembered after their runs ended.
const REMEMBERED: usize = 4096;

/// A message that must not be skipped.
#[derive(Clone, Debug)]
pub(super) enum News {
    /// To be sent as it is.
    Message(Utf8Bytes),
    /// The last one of a run.
    Ended(Utf8Bytes),
}

/// What a run publishes.
#[derive(Debug)]
pub(super) struct Channel {
    /// The run, as spectators may know it.
    pub(super) info: WatchRun,
    sensing: Sensing,
    /// The message `scene`.
    pub(super) scene: Utf8Bytes,
    frames: watch::Sender<Arc<Frame>>,
    news: broadcast::Sender<News>,
    /// When it last moved, ms since the hub exists.
    moved: AtomicU64,
}

impl Channel {
    fn watched(&self) -> Watched<'_> {
        Watched { team: &self.info.team, official: self.info.official, sensing: self.sensing }
    }
}

/// A run that a viewer follows.
#[derive(Debug)]
pub(super) struct Following {
    pub(super) channel: Arc<Channel>,
    /// The newest frame.
    pub(super) frames: watch::Receiver<Arc<Frame>>,
    /// What must not be skipped.
    pub(super) news: broadcast::Receiver<News>,
}

/// Why there is nothing to follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Nothing {
    /// No such run is open, no such session is known.
    Unknown,
    /// Not for this watcher.
    Forbidden,
    /// Nothing is played there now.
    Waiting,
}

#[derive(Debug, Default)]
struct Open {
    /// By run.
    channels: BTreeMap<String, Arc<Channel>>,
    /// Sessions that have opened a run, oldest first.
    sessions: VecDeque<String>,
}

/// Where runs publish and viewers find them.
#[derive(Debug)]
pub(crate) struct Hub {
    open: Mutex<Open>,
    /// Counts openings and endings.
    changed: watch::Sender<u64>,
    /// Counts changes of the ranking.
    ranking: watch::Sender<u64>,
    /// The newest announcement.
    announced: watch::Sender<Option<Announcement>>,
    places: Arc<Semaphore>,
    since: Instant,
}

impl Default for Hub {
    fn default() -> Self {
        Hub {
            open: Mutex::default(),
            changed: watch::Sender::new(0),
            ranking: watch::Sender::new(0),
            announced: watch::Sender::default(),
            places: Arc::new(Semaphore::new(MAX_VIEWERS)),
            since: Instant::now(),
        }
    }
}

impl Hub {
    fn open(&self) -> MutexGuard<'_, Open> {
        // Nothing panics while it holds the lock; if something did, the maps would still be whole.
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Who announces a run and is to see every tick of it.
    pub(crate) fn publisher(self: &Arc<Self>, info: WatchRun, sensing: Sensing) -> Publisher {
        Publisher { hub: self.clone(), unopened: Some((info, sensing)), channel: None, due: Instant::now() }
    }

    /// Announces a run at tick 0.
    fn announce(&self, info: WatchRun, sensing: Sensing, run: &Run) -> Arc<Channel> {
        let channel = Arc::new(Channel {
            scene: frame::scene(info.clone(), run),
            sensing,
            frames: watch::Sender::new(Arc::new(Frame::of(&info.run_id, run))),
            news: broadcast::Sender::new(QUEUE),
            moved: AtomicU64::new(self.now_ms()),
            info,
        });
        {
            let mut open = self.open();
            open.channels.insert(channel.info.run_id.clone(), channel.clone());
            if !open.sessions.contains(&channel.info.session_id) {
                if open.sessions.len() == REMEMBERED {
                    open.sessions.pop_front();
                }
                open.sessions.push_back(channel.info.session_id.clone());
            }
        }
        self.changed.send_modify(|count| *count += 1);
        channel
    }

    /// The ranking may have changed: viewers get it anew.
    pub(crate) fn ranking_changed(&self) {
        self.ranking.send_modify(|count| *count += 1);
    }

    /// An organizer told everybody something: viewers get it.
    pub(crate) fn announce_text(&self, told: &Announcement) {
        self.announced.send_if_modified(|newest| {
            let newer = newest.as_ref().is_none_or(|newest| newest.id < told.id);
            if newer {
                *newest = Some(told.clone());
            }
            newer
        });
    }

    /// A place for another viewer.
    pub(super) fn place(&self) -> Option<OwnedSemaphorePermit> {
        self.places.clone().try_acquire_owned().ok()
    }

    /// Viewers now.
    pub(crate) fn viewers(&self) -> usize {
        MAX_VIEWERS - self.places.available_permits()
    }

    /// Changes whenever a run opens or ends.
    pub(super) fn changes(&self) -> watch::Receiver<u64> {
        self.changed.subscribe()
    }

    /// Changes whenever the ranking does.
    pub(super) fn ranking_changes(&self) -> watch::Receiver<u64> {
        self.ranking.subscribe()
    }

    /// Changes with every announcement.
    pub(super) fn announcements(&self) -> watch::Receiver<Option<Announcement>> {
        self.announced.subscribe()
    }

    /// The open runs that this watcher may see.
    pub(super) fn list(&self, watcher: &Watcher) -> Vec<WatchRun> {
        let open = self.open();
        let seen = open.channels.values().filter(|channel| watcher.may_watch(&channel.watched()));
        seen.map(|channel| channel.info.clone()).collect()
    }

    /// What there is to follow.
    pub(super) fn find(&self, target: &Target, watcher: &Watcher) -> Result<Following, Nothing> {
        let open = self.open();
        let allowed = |channel: &Arc<Channel>| watcher.may_watch(&channel.watched());
        let channel = match target {
            Target::Run(id) => open.channels.get(id).ok_or(Nothing::Unknown)?,
            Target::Session(id) => {
                match open.channels.values().find(|channel| channel.info.session_id == *id) {
                    Some(channel) => channel,
                    None if open.sessions.contains(id) => return Err(Nothing::Waiting),
                    None => return Err(Nothing::Unknown),
                }
            }
            Target::Featured => {
                let best = open.channels.values().filter(|channel| allowed(channel));
                let worth =
                    |channel: &&Arc<Channel>| (channel.info.official, channel.moved.load(Ordering::Relaxed));
                best.max_by_key(worth).ok_or(Nothing::Waiting)?
            }
        };
        if !allowed(channel) {
            return Err(Nothing::Forbidden);
        }
        // Under the lock: a run leaves the map before it says its last word.
        Ok(Following {
            channel: channel.clone(),
            frames: channel.frames.subscribe(),
            news: channel.news.subscribe(),
        })
    }

    fn now_ms(&self) -> u64 {
        u64::try_from(self.since.elapsed().as_millis()).unwrap_or(u64::MAX)
    }
}

/// A run's way to its viewers. Dropped before the run was counted, it says that the world failed.
#[derive(Debug)]
pub(crate) struct Publisher {
    hub: Arc<Hub>,
    /// What is announced when the run is there.
    unopened: Option<(WatchRun, Sensing)>,
    /// None before the run is there and after its end.
    channel: Option<Arc<Channel>>,
    /// When a run that nobody watches shows itself next.
    due: Instant,
}

impl Witness for Publisher {
    fn opened(&mut self, run: &Run) {
        if let Some((info, sensing)) = self.unopened.take() {
            self.channel = Some(self.hub.announce(info, sensing, run));
            self.due = Instant::now();
        }
    }

    /// Costs a look at the clock when nobody watches.
    fn ticked(&mut self, run: &Run) {
        let Some(channel) = &self.channel else { return };
        let watched = channel.frames.receiver_count() > 0;
        if watched && !run.events().is_empty() {
            let (run_id, events) = (channel.info.run_id.clone(), run.events().to_vec());
            let message = frame::text(&WatchReply::Events(Events { run_id, events }));
            // Nobody may be left to hear it.
            let _ = channel.news.send(News::Message(message));
        }
        let now = Instant::now();
        if watched || now >= self.due {
            self.show(run);
            self.due = now + UNWATCHED_PERIOD;
        }
    }

    fn finished(&mut self, run: &Run, outcome: &Outcome) {
        self.show(run);
        self.end(Some(Final::of(outcome)));
    }
}

impl Publisher {
    fn show(&self, run: &Run) {
        let Some(channel) = &self.channel else { return };
        channel.frames.send_replace(Arc::new(Frame::of(&channel.info.run_id, run)));
        channel.moved.store(self.hub.now_ms(), Ordering::Relaxed);
    }

    fn end(&mut self, outcome: Option<Final>) {
        let Some(channel) = self.channel.take() else { return };
        let run_id = channel.info.run_id.clone();
        self.hub.open().channels.remove(&run_id);
        let message = frame::text(&WatchReply::Ended(Ended { run_id, outcome }));
        let _ = channel.news.send(News::Ended(message));
        self.hub.changed.send_modify(|count| *count += 1);
    }
}

impl Drop for Publisher {
    fn drop(&mut self) {
        self.end(None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palmares_models::builtin::builtin_hands;
    use palmares_tasks::{Action, Reason, Seed, Task};
    use tokio::sync::broadcast::error::TryRecvError;

    fn run() -> Run {
        let task = Task::builtin().into_iter().find(|task| task.name == "balls").expect("balls");
        let hand = builtin_hands().iter().find(|hand| hand.name == "pinch").expect("pinch").clone();
        Run::new(task, hand, Seed::from_u64(1)).expect("a scene")
    }

    fn info(run_id: &str, session_id: &str, official: bool) -> WatchRun {
        WatchRun {
            run_id: run_id.into(),
            session_id: session_id.into(),
            team: "team".into(),
            task: "balls".into(),
            hand: "pinch".into(),
            official,
            tick_s: 0.01,
            time_limit_s: 600.0,
        }
    }

    fn published(hub: &Arc<Hub>, info: WatchRun, run: &Run) -> Publisher {
        let mut publisher = hub.publisher(info, Sensing::Truth);
        publisher.opened(run);
        publisher
    }

    #[test]
    fn a_viewer_gets_the_newest_frame_and_every_word_until_the_end() {
        let (hub, mut run) = (Arc::new(Hub::default()), run());
        let mut publisher = published(&hub, info("r", "s", false), &run);
        let mut following = hub.find(&Target::Run("r".into()), &Watcher::Anybody).expect("there");
        assert_eq!(following.frames.borrow_and_update().poses.tick, 0);
        for _ in 0..3 {
            run.step(&Action::default()).expect("steps");
            publisher.ticked(&run);
        }
        let frame = following.frames.borrow_and_update().clone();
        assert_eq!(frame.poses.tick, 3);
        assert_eq!(frame.poses.poses.len(), run.poses().count());
        let outcome = run.finish(Reason::Stopped);
        publisher.finished(&run, &outcome);
        drop(publisher);
        let mut said = Vec::new();
        loop {
            match following.news.try_recv() {
                Ok(News::Message(text)) => said.push(text),
                Ok(News::Ended(text)) => {
                    assert!(text.contains(r#""reason":"stopped""#), "{text}");
                    break;
                }
                Err(error) => panic!("{error}"),
            }
        }
        assert!(said.iter().all(|text| text.contains(r#""op":"events""#)), "{said:?}");
        assert_eq!(hub.find(&Target::Run("r".into()), &Watcher::Anybody).err(), Some(Nothing::Unknown));
        assert_eq!(hub.find(&Target::Session("s".into()), &Watcher::Anybody).err(), Some(Nothing::Waiting));
        assert_eq!(hub.find(&Target::Session("t".into()), &Watcher::Anybody).err(), Some(Nothing::Unknown));
    }

    #[test]
    fn a_world_that_failed_ends_too() {
        let (hub, run) = (Arc::new(Hub::default()), run());
        let publisher = published(&hub, info("r", "s", false), &run);
        let mut following = hub.find(&Target::Featured, &Watcher::Anybody).expect("there");
        drop(publisher);
        let last = following.news.try_recv().expect("a word");
        assert!(matches!(&last, News::Ended(text) if text.contains(r#""outcome":null"#)), "{last:?}");
    }

    #[test]
    fn who_falls_behind_is_told_so_and_nobody_waits() {
        let (hub, run) = (Arc::new(Hub::default()), run());
        let publisher = published(&hub, info("r", "s", false), &run);
        let mut following = hub.find(&Target::Featured, &Watcher::Anybody).expect("there");
        for _ in 0..=QUEUE {
            let _ = publisher.channel.as_ref().expect("open").news.send(News::Message("{}".into()));
        }
        assert_eq!(following.news.try_recv().err(), Some(TryRecvError::Lagged(1)));
    }

    #[test]
    fn official_runs_are_featured_first_and_hidden_from_strangers() {
        let (hub, run) = (Arc::new(Hub::default()), run());
        let _official = published(&hub, info("o", "s1", true), &run);
        let mut practice = published(&hub, info("p", "s2", false), &run);
        practice.due = Instant::now();
        practice.ticked(&run);
        let featured =
            |watcher: &Watcher| hub.find(&Target::Featured, watcher).map(|f| f.channel.info.run_id.clone());
        assert_eq!(featured(&Watcher::Organizer), Ok("o".into()));
        assert_eq!(featured(&Watcher::Anybody), Ok("p".into()));
        assert_eq!(hub.list(&Watcher::Anybody).len(), 1);
        let strange = Watcher::Team("other".into());
        assert_eq!(hub.find(&Target::Session("s1".into()), &strange).err(), Some(Nothing::Forbidden));
    }
}
