//! Where runs publish and viewers find them.

use super::access::Watcher;
use super::channel::{Channel, Following, News};
use super::frame::{self, Frame};
use super::messages::{Ended, Events, Final, WatchReply, WatchRun};
use super::request::Target;
use super::snapshot::{Overlays, Snapshot};
use crate::store::Announcement;
use crate::world::Witness;
use palmares_tasks::{Fault, Outcome, Run, Sensing};
use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, broadcast, watch};

/// Viewers at once.
const MAX_VIEWERS: usize = 256;
/// Messages that must not be skipped and that a viewer has not taken yet; one that lets more gather is closed.
const QUEUE: usize = 256;
/// How often a run that nobody watches shows itself, for whoever comes next while its world stands still.
const UNWATCHED_PERIOD: Duration = Duration::from_millis(100);
/// Over so much time the greatest lateness is told, twice.
const LATENESS_PERIOD: Duration = Duration::from_millis(500);
/// A world in which the referee noted something is worth watching for so long, ms.
const EXCITING_MS: u64 = 10_000;
/// Sessions that are remembered after their runs ended.
const REMEMBERED: usize = 4096;

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
    /// `own_hand`: the team sent the hand in.
    pub(crate) fn publisher(self: &Arc<Self>, info: WatchRun, sensing: Sensing, own_hand: bool) -> Publisher {
        let now = Instant::now();
        let lateness = Lateness { since: now, now: None, before: None };
        let unopened = Some(Unopened { info, sensing, own_hand });
        Publisher { hub: self.clone(), unopened, open: None, due: now, lateness }
    }

    /// Announces a run at tick 0.
    fn announce(&self, unopened: Unopened, run: &Run) -> Published {
        let Unopened { info, sensing, own_hand } = unopened;
        let snapshots = watch::Sender::new(Arc::new(Snapshot::of(run, Overlays::ALL, None)));
        let first = snapshots.borrow().clone();
        let telemetry_model = run.telemetry_model().clone();
        let channel = Arc::new(Channel {
            scenes: frame::scene(info.clone(), run),
            sensing,
            own_hand,
            frames: watch::Sender::new(Arc::new(Frame::new(&info.run_id, &telemetry_model, first))),
            telemetry_model,
            snapshots: snapshots.subscribe(),
            wanted: Default::default(),
            pumping: AtomicBool::new(false),
            news: broadcast::Sender::new(QUEUE),
            moved: AtomicU64::new(self.now_ms()),
            noted: AtomicU64::new(0),
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
        Published { channel, snapshots }
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
                let now_ms = self.now_ms();
                let worth = |channel: &&Arc<Channel>| {
                    let [moved, noted] =
                        [&channel.moved, &channel.noted].map(|ms| ms.load(Ordering::Relaxed));
                    (channel.info.official, noted > 0 && now_ms < noted + EXCITING_MS, moved)
                };
                best.max_by_key(worth).ok_or(Nothing::Waiting)?
            }
            Target::Leaderboard => return Err(Nothing::Waiting),
        };
        if !allowed(channel) {
            return Err(Nothing::Forbidden);
        }
        // Under the lock: a run leaves the map before it says its last word.
        Ok(Following::new(channel))
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
    unopened: Option<Unopened>,
    /// None before the run is there and after its end.
    open: Option<Published>,
    /// When a run that nobody watches shows itself next.
    due: Instant,
    lateness: Lateness,
}

/// A run that is to be announced.
#[derive(Debug)]
struct Unopened {
    info: WatchRun,
    sensing: Sensing,
    own_hand: bool,
}

/// A run's end of its channel.
#[derive(Debug)]
struct Published {
    channel: Arc<Channel>,
    snapshots: watch::Sender<Arc<Snapshot>>,
}

/// How late ticks begin: the greatest of the present half second and of the one before.
#[derive(Debug)]
struct Lateness {
    since: Instant,
    now: Option<Duration>,
    before: Option<Duration>,
}

impl Lateness {
    fn begins(&mut self, now: Instant, late: Duration) {
        if now >= self.since + LATENESS_PERIOD {
            *self = Lateness { since: now, now: None, before: self.now };
        }
        self.now = self.now.max(Some(late));
    }

    fn most_s(&self) -> Option<f64> {
        self.now.max(self.before).map(|late| late.as_secs_f64())
    }
}

impl Witness for Publisher {
    fn opened(&mut self, run: &Run) {
        if let Some(unopened) = self.unopened.take() {
            self.open = Some(self.hub.announce(unopened, run));
            self.due = Instant::now();
        }
    }

    fn began(&mut self, late: Duration) {
        self.lateness.begins(Instant::now(), late);
    }

    /// Costs a look at the clock when nobody watches.
    fn ticked(&mut self, run: &Run) {
        let Some(Published { channel, .. }) = &self.open else { return };
        let watched = channel.frames.receiver_count() > 0;
        if !run.events().is_empty() {
            channel.noted.store(self.hub.now_ms(), Ordering::Relaxed);
        }
        if watched && !run.events().is_empty() {
            let (run_id, events) = (channel.info.run_id.clone(), run.events().to_vec());
            let message = frame::text(&WatchReply::Events(Events { run_id, events }));
            // Nobody may be left to hear it.
            let _ = channel.news.send(News::Message(message));
        }
        let now = Instant::now();
        let due = now >= self.due;
        if watched || due {
            // Whoever comes next finds everything there, also while the world stands still.
            let overlays = if due { Overlays::ALL } else { channel.wanted.now() };
            self.show(run, overlays);
        }
        if due {
            self.due = now + UNWATCHED_PERIOD;
        }
    }

    /// Whoever comes next finds the world where it stands.
    fn rested(&mut self, run: &Run) {
        let Some(Published { channel, snapshots }) = &self.open else { return };
        if channel.frames.receiver_count() == 0 && snapshots.borrow().tick != run.tick() {
            self.show(run, Overlays::ALL);
        }
    }

    fn finished(&mut self, run: &Run, outcome: &Outcome) {
        self.show(run, Overlays::ALL);
        self.end(Some(Final::of(outcome)), None);
    }

    fn failed(&mut self, fault: Fault) {
        self.end(None, Some(fault));
    }
}

impl Publisher {
    fn show(&self, run: &Run, overlays: Overlays) {
        let Some(Published { channel, snapshots }) = &self.open else { return };
        let snapshot = Snapshot::of(run, overlays, self.lateness.most_s());
        snapshots.send_replace(Arc::new(snapshot));
        channel.moved.store(self.hub.now_ms(), Ordering::Relaxed);
    }

    fn end(&mut self, outcome: Option<Final>, fault: Option<Fault>) {
        let Some(Published { channel, .. }) = self.open.take() else { return };
        let run_id = channel.info.run_id.clone();
        self.hub.open().channels.remove(&run_id);
        let message = frame::text(&WatchReply::Ended(Ended { run_id, outcome, fault }));
        let _ = channel.news.send(News::Ended(message));
        self.hub.changed.send_modify(|count| *count += 1);
    }
}

impl Drop for Publisher {
    fn drop(&mut self) {
        self.end(None, None);
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
        let mut publisher = hub.publisher(info, Sensing::Truth, false);
        publisher.opened(run);
        publisher
    }

    #[test]
    fn a_viewer_gets_the_newest_frame_and_every_word_until_the_end() {
        let (hub, mut run) = (Arc::new(Hub::default()), run());
        let mut publisher = published(&hub, info("r", "s", false), &run);
        let mut following = hub.find(&Target::Run("r".into()), &Watcher::Anybody).expect("there");
        assert_eq!(following.frames.borrow_and_update().snapshot.tick, 0);
        for _ in 0..3 {
            run.step(&Action::default()).expect("steps");
            publisher.ticked(&run);
        }
        following.channel.refresh();
        let frame = following.frames.borrow_and_update().clone();
        assert_eq!(frame.snapshot.tick, 3);
        let told: serde_json::Value = serde_json::from_str(&frame.text(Overlays::default())).expect("JSON");
        assert_eq!(
            (&told["tick"], told["poses"].as_array().map(Vec::len)),
            (&3.into(), Some(run.poses().count()))
        );
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
    fn who_comes_late_finds_the_world_where_it_stands() {
        let (hub, mut run) = (Arc::new(Hub::default()), run());
        let mut publisher = published(&hub, info("r", "s", false), &run);
        publisher.ticked(&run);
        for _ in 0..3 {
            run.step(&Action::default()).expect("steps");
            publisher.ticked(&run);
        }
        publisher.rested(&run);
        let following = hub.find(&Target::Featured, &Watcher::Anybody).expect("there");
        let frame = following.frames.borrow().clone();
        assert_eq!(frame.snapshot.tick, 3);
        assert!(frame.snapshot.sample.is_some() && frame.snapshot.evidence.is_some());
    }

    #[test]
    fn a_world_that_failed_ends_too() {
        let (hub, run) = (Arc::new(Hub::default()), run());
        for fault in [None, Some(Fault::Unsolvable)] {
            let mut publisher = published(&hub, info("r", "s", false), &run);
            let mut following = hub.find(&Target::Featured, &Watcher::Anybody).expect("there");
            if let Some(fault) = fault {
                publisher.failed(fault);
            }
            drop(publisher);
            let last = following.news.try_recv().expect("a word");
            let News::Ended(text) = &last else { panic!("{last:?}") };
            assert!(text.contains(r#""outcome":null"#), "{text}");
            assert_eq!(text.contains(r#""fault":"unsolvable""#), fault.is_some(), "{text}");
            assert!(following.news.try_recv().is_err(), "it ends once");
        }
    }

    #[test]
    fn who_falls_behind_is_told_so_and_nobody_waits() {
        let (hub, run) = (Arc::new(Hub::default()), run());
        let publisher = published(&hub, info("r", "s", false), &run);
        let mut following = hub.find(&Target::Featured, &Watcher::Anybody).expect("there");
        for _ in 0..=QUEUE {
            let _ = publisher.open.as_ref().expect("open").channel.news.send(News::Message("{}".into()));
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

    #[test]
    fn what_nobody_wants_to_see_is_not_copied() {
        let (hub, mut run) = (Arc::new(Hub::default()), run());
        let mut publisher = published(&hub, info("r", "s", false), &run);
        let mut following = hub.find(&Target::Featured, &Watcher::Anybody).expect("there");
        let copied = |publisher: &mut Publisher, run: &mut Run| {
            publisher.due = Instant::now() + UNWATCHED_PERIOD;
            run.step(&Action::default()).expect("steps");
            publisher.ticked(run);
            let open = publisher.open.as_ref().expect("open");
            let newest = open.snapshots.borrow().clone();
            (newest.sample.is_some(), newest.evidence.is_some())
        };
        assert_eq!(copied(&mut publisher, &mut run), (false, false));
        following.want(Overlays { verdicts: true, ..Overlays::default() });
        assert_eq!(copied(&mut publisher, &mut run), (false, true));
        following.want(Overlays { contacts: true, ..Overlays::default() });
        assert_eq!(copied(&mut publisher, &mut run), (true, false));
        let other = hub.find(&Target::Featured, &Watcher::Anybody).expect("there");
        drop(following);
        assert_eq!(copied(&mut publisher, &mut run), (false, false));
        drop(other);
    }

    #[test]
    fn the_greatest_lateness_of_a_second_is_told() {
        let start = Instant::now();
        let mut lateness = Lateness { since: start, now: None, before: None };
        assert_eq!(lateness.most_s(), None);
        lateness.begins(start, Duration::from_millis(8));
        lateness.begins(start + LATENESS_PERIOD, Duration::from_millis(2));
        assert_eq!(lateness.most_s(), Some(0.008));
        lateness.begins(start + 2 * LATENESS_PERIOD, Duration::from_millis(1));
        assert_eq!(lateness.most_s(), Some(0.002));
    }
}
