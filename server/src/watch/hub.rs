//! The open runs: runs publish here, viewers follow them.

use super::access::Watcher;
use super::channel::{Channel, Following, QueuedMessage, Source};
use super::frame::{self, Frame};
use super::messages::{Events, Final, WatchReply, WatchRun};
use super::places::Places;
use super::request::Target;
use super::sample::{Overlays, WatchSample};
use palmares_store::Announcement;
use palmares_tasks::{Event, Fault, Outcome, Run, Sensing};
use palmares_worlds::world::{RunObserver, Ticked};
use parking_lot::Mutex;
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};
use tokio::sync::{broadcast, watch};

/// Longest queue of messages for a viewer; a viewer that falls further behind is closed.
pub(super) const QUEUE_LENGTH: usize = 256;
/// Time between two samples of a run without viewers, for a viewer that comes while its world is not stepped.
const UNWATCHED_PERIOD: Duration = Duration::from_millis(100);
/// Window of the reported lateness, which is the maximum of this window and the one before.
const LATENESS_WINDOW: Duration = Duration::from_millis(500);
/// A run is featured for this long after an event of the referee, ms.
const FEATURED_MS: u64 = 10_000;
/// Ended sessions that are remembered.
const MAX_SESSIONS: usize = 4096;

/// Reason why a target cannot be followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FindError {
    /// The run is not open, or the session is unknown.
    Unknown,
    /// The watcher may not watch it.
    Forbidden,
    /// No run is open there now.
    Waiting,
}

#[derive(Debug, Default)]
struct OpenRuns {
    /// By run id.
    channels: BTreeMap<String, Arc<Channel>>,
    /// Ids of the sessions that have opened a run, oldest first.
    sessions: VecDeque<String>,
}

/// The open runs: runs publish here, viewers follow them.
#[derive(Debug)]
pub(crate) struct Hub {
    open: Mutex<OpenRuns>,
    /// Counts runs that open or end.
    changed: watch::Sender<u64>,
    /// Counts changes of the ranking.
    ranking: watch::Sender<u64>,
    /// The newest announcement.
    announced: watch::Sender<Option<Announcement>>,
    pub(super) places: Places,
    /// Whether other hosts can continue the runs.
    fleet: AtomicBool,
    since: Instant,
}

impl Default for Hub {
    fn default() -> Self {
        Hub {
            open: Mutex::default(),
            changed: watch::Sender::new(0),
            ranking: watch::Sender::new(0),
            announced: watch::Sender::default(),
            places: Places::default(),
            fleet: AtomicBool::new(false),
            since: Instant::now(),
        }
    }
}

impl Hub {
    /// The observer that publishes a run. `own_hand`: the team uploaded the hand.
    pub(crate) fn publisher(self: &Arc<Self>, info: WatchRun, sensing: Sensing, own_hand: bool) -> Publisher {
        let now = Instant::now();
        let lateness = Lateness { since: now, current: None, previous: None };
        let unopened = Some(UnopenedRun { info, sensing, own_hand });
        Publisher { hub: self.clone(), unopened, open: None, due: now, lateness }
    }

    /// Opens the channel of a run at tick 0.
    fn announce(&self, unopened: UnopenedRun, run: &Run) -> Published {
        let UnopenedRun { info, sensing, own_hand } = unopened;
        let samples = watch::Sender::new(Arc::new(WatchSample::of(run, Overlays::ALL, None)));
        let first = samples.borrow().clone();
        let telemetry_model = run.telemetry_model().clone();
        let channel = Arc::new(Channel {
            scenes: frame::scene(info.clone(), run),
            sensing,
            own_hand,
            frames: watch::Sender::new(Arc::new(Frame::new(&info.run_id, &telemetry_model, first))),
            source: Source::World { samples: samples.subscribe(), telemetry_model },
            overlays: Default::default(),
            pumping: AtomicBool::new(false),
            queue: broadcast::Sender::new(QUEUE_LENGTH),
            moved: AtomicU64::new(self.now_ms()),
            last_event: AtomicU64::new(0),
            info,
        });
        {
            let mut open = self.open.lock();
            open.channels.insert(channel.info.run_id.clone(), channel.clone());
            if !open.sessions.contains(&channel.info.session_id) {
                if open.sessions.len() == MAX_SESSIONS {
                    open.sessions.pop_front();
                }
                open.sessions.push_back(channel.info.session_id.clone());
            }
        }
        self.look_again();
        Published { channel, samples }
    }

    /// Notes that other hosts can continue the runs: a run without an outcome may have moved.
    pub(super) fn join_fleet(&self) {
        self.fleet.store(true, Ordering::Relaxed);
    }

    /// Has waiting viewers look for their runs again.
    pub(super) fn look_again(&self) {
        self.changed.send_modify(|count| *count += 1);
    }

    /// Whether a run is open here.
    pub(super) fn has(&self, run_id: &str) -> bool {
        self.open.lock().channels.contains_key(run_id)
    }

    /// Counts a possible change of the ranking: readers get it from the database again.
    pub(crate) fn ranking_changed(&self) {
        self.ranking.send_modify(|count| *count += 1);
    }

    /// Sends an organizer's announcement to all viewers.
    pub(crate) fn announce_text(&self, announcement: &Announcement) {
        self.announced.send_if_modified(|newest| {
            let newer = newest.as_ref().is_none_or(|newest| newest.id < announcement.id);
            if newer {
                *newest = Some(announcement.clone());
            }
            newer
        });
    }

    /// Number of connected viewers.
    pub(crate) fn viewers(&self) -> usize {
        self.places.taken()
    }

    /// Changes whenever a run opens or ends.
    pub(super) fn changes(&self) -> watch::Receiver<u64> {
        self.changed.subscribe()
    }

    /// Number of changes of the ranking that were noticed.
    pub(super) fn ranking_count(&self) -> u64 {
        *self.ranking.borrow()
    }

    /// Changes whenever the ranking may have changed.
    pub(super) fn ranking_changes(&self) -> watch::Receiver<u64> {
        self.ranking.subscribe()
    }

    /// Changes with every announcement.
    pub(super) fn announcements(&self) -> watch::Receiver<Option<Announcement>> {
        self.announced.subscribe()
    }

    /// The open runs that this watcher may watch.
    pub(super) fn list(&self, watcher: &Watcher) -> Vec<WatchRun> {
        let open = self.open.lock();
        let allowed = open.channels.values().filter(|channel| watcher.may_watch(&channel.access()));
        allowed.map(|channel| channel.info.clone()).collect()
    }

    /// Follows the run that a target names.
    pub(super) fn find(&self, target: &Target, watcher: &Watcher) -> Result<Following, FindError> {
        let open = self.open.lock();
        let allowed = |channel: &Arc<Channel>| watcher.may_watch(&channel.access());
        let channel = match target {
            Target::Run(id) => open.channels.get(id).ok_or(FindError::Unknown)?,
            Target::Session(id) => {
                match open.channels.values().find(|channel| channel.info.session_id == *id) {
                    Some(channel) => channel,
                    None if open.sessions.contains(id) => return Err(FindError::Waiting),
                    None => return Err(FindError::Unknown),
                }
            }
            Target::Featured => {
                let all = open.channels.values().filter(|channel| allowed(channel));
                let now_ms = self.now_ms();
                let rank = |channel: &&Arc<Channel>| {
                    let [moved, last_event] =
                        [&channel.moved, &channel.last_event].map(|ms| ms.load(Ordering::Relaxed));
                    (channel.info.official, last_event > 0 && now_ms < last_event + FEATURED_MS, moved)
                };
                all.max_by_key(rank).ok_or(FindError::Waiting)?
            }
            Target::Leaderboard => return Err(FindError::Waiting),
        };
        if !allowed(channel) {
            return Err(FindError::Forbidden);
        }
        // Under the lock: a run leaves the map before it sends its last message.
        Ok(Following::new(channel))
    }

    fn now_ms(&self) -> u64 {
        u64::try_from(self.since.elapsed().as_millis()).unwrap_or(u64::MAX)
    }
}

/// The observer that publishes a run. When it is dropped before the run is scored, it reports that the world failed.
#[derive(Debug)]
pub(crate) struct Publisher {
    hub: Arc<Hub>,
    /// The run before its world is built.
    unopened: Option<UnopenedRun>,
    /// None before the world is built and after the run's end.
    open: Option<Published>,
    /// When a run without viewers publishes its next sample.
    due: Instant,
    lateness: Lateness,
}

/// A run before its world is built.
#[derive(Debug)]
struct UnopenedRun {
    info: WatchRun,
    sensing: Sensing,
    own_hand: bool,
}

/// An open run's channel and the sender of its samples.
#[derive(Debug)]
struct Published {
    channel: Arc<Channel>,
    samples: watch::Sender<Arc<WatchSample>>,
}

/// The maximum lateness of ticks in the current window and in the one before.
#[derive(Debug)]
struct Lateness {
    since: Instant,
    current: Option<Duration>,
    previous: Option<Duration>,
}

impl Lateness {
    fn record(&mut self, now: Instant, late: Duration) {
        if now >= self.since + LATENESS_WINDOW {
            *self = Lateness { since: now, current: None, previous: self.current };
        }
        self.current = self.current.max(Some(late));
    }

    fn max_s(&self) -> Option<f64> {
        self.current.max(self.previous).map(|late| late.as_secs_f64())
    }
}

impl RunObserver for Publisher {
    fn opened(&mut self, run: &Run) {
        if let Some(unopened) = self.unopened.take() {
            self.open = Some(self.hub.announce(unopened, run));
            self.due = Instant::now();
        }
    }

    fn began(&mut self, late: Duration) {
        self.lateness.record(Instant::now(), late);
    }

    /// Reads only the clock when the run has no viewers.
    fn ticked(&mut self, &Ticked { run, .. }: &Ticked<'_>) {
        let Some(Published { channel, .. }) = &self.open else { return };
        let watched = channel.frames.receiver_count() > 0;
        if !run.events().is_empty() {
            channel.last_event.store(self.hub.now_ms(), Ordering::Relaxed);
            self.send_events(run.events().to_vec());
        }
        let now = Instant::now();
        let due = now >= self.due;
        if watched || due {
            // A viewer that comes later gets all overlays, even while the world is not stepped.
            let overlays = if due { Overlays::ALL } else { channel.overlays.any() };
            self.publish(run, overlays);
        }
        if due {
            self.due = now + UNWATCHED_PERIOD;
        }
    }

    /// Publishes the current state for a viewer that comes while the controller computes.
    fn rested(&mut self, run: &Run) {
        let Some(Published { channel, samples }) = &self.open else { return };
        if channel.frames.receiver_count() == 0 && samples.borrow().tick != run.tick() {
            self.publish(run, Overlays::ALL);
        }
    }

    fn finished(&mut self, run: &Run, outcome: &Outcome) {
        self.publish(run, Overlays::ALL);
        let settling = outcome.events.iter().filter(|event| event.tick > outcome.ticks).cloned();
        self.send_events(settling.collect());
        self.end(Some(Final::of(outcome)), None);
    }

    fn failed(&mut self, fault: Fault) {
        self.end(None, Some(fault));
    }
}

impl Publisher {
    /// Sends events of the referee to the viewers, if there are any of both.
    fn send_events(&self, events: Vec<Event>) {
        let Some(Published { channel, .. }) = &self.open else { return };
        if events.is_empty() || channel.frames.receiver_count() == 0 {
            return;
        }
        let run_id = channel.info.run_id.clone();
        let message = frame::text(&WatchReply::Events(Events { run_id, events }));
        // An error means that the last viewer has gone.
        let _ = channel.queue.send(QueuedMessage::Message(message));
    }

    fn publish(&self, run: &Run, overlays: Overlays) {
        let Some(Published { channel, samples }) = &self.open else { return };
        let sample = WatchSample::of(run, overlays, self.lateness.max_s());
        samples.send_replace(Arc::new(sample));
        channel.moved.store(self.hub.now_ms(), Ordering::Relaxed);
    }

    fn end(&mut self, outcome: Option<Final>, fault: Option<Fault>) {
        let Some(Published { channel, .. }) = self.open.take() else { return };
        let run_id = channel.info.run_id.clone();
        {
            // This host may show the run again, as its next owner.
            let mut open = self.hub.open.lock();
            if open.channels.get(&run_id).is_some_and(|known| Arc::ptr_eq(known, &channel)) {
                open.channels.remove(&run_id);
            }
        }
        let unknown = outcome.is_none() && fault.is_none();
        let last = match unknown && self.hub.fleet.load(Ordering::Relaxed) {
            true => QueuedMessage::Moved,
            false => QueuedMessage::Ended(frame::ended(run_id, outcome, fault)),
        };
        let _ = channel.queue.send(last);
        self.hub.look_again();
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
    fn a_viewer_gets_the_newest_frame_and_every_message_until_the_end() {
        let (hub, mut run) = (Arc::new(Hub::default()), run());
        let mut publisher = published(&hub, info("r", "s", false), &run);
        let mut following = hub.find(&Target::Run("r".into()), &Watcher::Anybody).expect("there");
        assert_eq!(following.frames.borrow_and_update().sample.tick, 0);
        for _ in 0..3 {
            run.step(&Action::default()).expect("steps");
            publisher.ticked(&Ticked::of(&run));
        }
        following.channel.refresh();
        let frame = following.frames.borrow_and_update().clone();
        assert_eq!(frame.sample.tick, 3);
        let poses: serde_json::Value = serde_json::from_str(&frame.text(Overlays::default())).expect("JSON");
        assert_eq!(
            (&poses["tick"], poses["poses"].as_array().map(Vec::len)),
            (&3.into(), Some(run.poses().count()))
        );
        let mut outcome = run.finish(Reason::Stopped);
        // An object that came to rest while the world settled.
        outcome.events.push(Event { tick: outcome.ticks + 1, kind: "in_goal".into(), object: Some(0) });
        publisher.finished(&run, &outcome);
        drop(publisher);
        let mut said = Vec::new();
        loop {
            match following.queue.try_recv() {
                Ok(QueuedMessage::Message(text)) => said.push(text),
                Ok(QueuedMessage::Ended(text)) => {
                    assert!(text.contains(r#""reason":"stopped""#), "{text}");
                    break;
                }
                other => panic!("{other:?}"),
            }
        }
        assert!(said.iter().all(|text| text.contains(r#""op":"events""#)), "{said:?}");
        assert!(said.last().is_some_and(|text| text.contains("in_goal")), "{said:?}");
        assert_eq!(hub.find(&Target::Run("r".into()), &Watcher::Anybody).err(), Some(FindError::Unknown));
        assert_eq!(hub.find(&Target::Session("s".into()), &Watcher::Anybody).err(), Some(FindError::Waiting));
        assert_eq!(hub.find(&Target::Session("t".into()), &Watcher::Anybody).err(), Some(FindError::Unknown));
    }

    #[test]
    fn a_late_viewer_gets_the_current_state() {
        let (hub, mut run) = (Arc::new(Hub::default()), run());
        let mut publisher = published(&hub, info("r", "s", false), &run);
        publisher.ticked(&Ticked::of(&run));
        for _ in 0..3 {
            run.step(&Action::default()).expect("steps");
            publisher.ticked(&Ticked::of(&run));
        }
        publisher.rested(&run);
        let following = hub.find(&Target::Featured, &Watcher::Anybody).expect("there");
        let frame = following.frames.borrow().clone();
        assert_eq!(frame.sample.tick, 3);
        assert!(frame.sample.run_sample.is_some() && frame.sample.evidence.is_some());
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
            let last = following.queue.try_recv().expect("a message");
            let QueuedMessage::Ended(text) = &last else { panic!("{last:?}") };
            assert!(text.contains(r#""outcome":null"#), "{text}");
            assert_eq!(text.contains(r#""fault":"unsolvable""#), fault.is_some(), "{text}");
            assert!(following.queue.try_recv().is_err(), "it ends once");
        }
    }

    #[test]
    fn in_a_fleet_a_run_without_an_outcome_may_have_moved() {
        let (hub, mut run) = (Arc::new(Hub::default()), run());
        hub.join_fleet();
        let outcome = run.finish(Reason::Stopped);
        let endings: [fn(&mut Publisher, &Run, &Outcome); 3] = [
            |_, _, _| {},
            |publisher, _, _| publisher.failed(Fault::Unsolvable),
            |publisher, run, outcome| publisher.finished(run, outcome),
        ];
        let moved = endings.map(|end| {
            let mut publisher = published(&hub, info("r", "s", false), &run);
            let mut following = hub.find(&Target::Featured, &Watcher::Anybody).expect("there");
            end(&mut publisher, &run, &outcome);
            drop(publisher);
            matches!(following.queue.try_recv().expect("a message"), QueuedMessage::Moved)
        });
        assert_eq!(moved, [true, false, false]);
    }

    #[test]
    fn a_frame_is_the_same_at_another_host() {
        let (hub, run) = (Arc::new(Hub::default()), run());
        let _publisher = published(&hub, info("r", "s", false), &run);
        let following = hub.find(&Target::Featured, &Watcher::Anybody).expect("there");
        let here = following.frames.borrow().clone();
        let none = Overlays::default();
        for overlays in
            [none, Overlays { telemetry: true, ..none }, Overlays { contacts: true, ..none }, Overlays::ALL]
        {
            let sent = postcard::to_stdvec(&here.link(overlays)).expect("encodes");
            let there = Frame::linked("r", postcard::from_bytes(&sent).expect("decodes"));
            let (text, other): (serde_json::Value, serde_json::Value) = (
                serde_json::from_str(&here.text(overlays)).expect("JSON"),
                serde_json::from_str(&there.text(Overlays::ALL)).expect("JSON"),
            );
            assert_eq!(text, other);
            let bytes = |frame: &Frame| frame.bytes(overlays, &mut Vec::new(), true);
            assert_eq!(bytes(&here), bytes(&there));
            assert_eq!(there.verdicts(), here.verdicts().filter(|_| overlays.verdicts));
        }
    }

    #[test]
    fn a_viewer_that_falls_behind_is_closed_and_the_world_does_not_wait() {
        let (hub, run) = (Arc::new(Hub::default()), run());
        let publisher = published(&hub, info("r", "s", false), &run);
        let mut following = hub.find(&Target::Featured, &Watcher::Anybody).expect("there");
        for _ in 0..=QUEUE_LENGTH {
            let _ = publisher
                .open
                .as_ref()
                .expect("open")
                .channel
                .queue
                .send(QueuedMessage::Message("{}".into()));
        }
        assert_eq!(following.queue.try_recv().err(), Some(TryRecvError::Lagged(1)));
    }

    #[test]
    fn official_runs_are_featured_first_and_hidden_from_strangers() {
        let (hub, run) = (Arc::new(Hub::default()), run());
        let _official = published(&hub, info("o", "s1", true), &run);
        let mut practice = published(&hub, info("p", "s2", false), &run);
        practice.due = Instant::now();
        practice.ticked(&Ticked::of(&run));
        let featured =
            |watcher: &Watcher| hub.find(&Target::Featured, watcher).map(|f| f.channel.info.run_id.clone());
        assert_eq!(featured(&Watcher::Organizer), Ok("o".into()));
        assert_eq!(featured(&Watcher::Anybody), Ok("p".into()));
        assert_eq!(hub.list(&Watcher::Anybody).len(), 1);
        let strange = Watcher::Team("other".into());
        assert_eq!(hub.find(&Target::Session("s1".into()), &strange).err(), Some(FindError::Forbidden));
    }

    #[test]
    fn only_overlays_that_viewers_asked_for_are_copied() {
        let (hub, mut run) = (Arc::new(Hub::default()), run());
        let mut publisher = published(&hub, info("r", "s", false), &run);
        let mut following = hub.find(&Target::Featured, &Watcher::Anybody).expect("there");
        let copied = |publisher: &mut Publisher, run: &mut Run| {
            publisher.due = Instant::now() + UNWATCHED_PERIOD;
            run.step(&Action::default()).expect("steps");
            publisher.ticked(&Ticked::of(run));
            let open = publisher.open.as_ref().expect("open");
            let newest = open.samples.borrow().clone();
            (newest.run_sample.is_some(), newest.evidence.is_some())
        };
        assert_eq!(copied(&mut publisher, &mut run), (false, false));
        following.set_overlays(Overlays { verdicts: true, ..Overlays::default() });
        assert_eq!(copied(&mut publisher, &mut run), (false, true));
        following.set_overlays(Overlays { contacts: true, ..Overlays::default() });
        assert_eq!(copied(&mut publisher, &mut run), (true, false));
        let other = hub.find(&Target::Featured, &Watcher::Anybody).expect("there");
        drop(following);
        assert_eq!(copied(&mut publisher, &mut run), (false, false));
        drop(other);
    }

    #[test]
    fn the_maximum_lateness_of_two_windows_is_reported() {
        let start = Instant::now();
        let mut lateness = Lateness { since: start, current: None, previous: None };
        assert_eq!(lateness.max_s(), None);
        lateness.record(start, Duration::from_millis(8));
        lateness.record(start + LATENESS_WINDOW, Duration::from_millis(2));
        assert_eq!(lateness.max_s(), Some(0.008));
        lateness.record(start + 2 * LATENESS_WINDOW, Duration::from_millis(1));
        assert_eq!(lateness.max_s(), Some(0.002));
    }
}
