//! What all sessions of a server share.

use super::registry::Registry;
use crate::auth::{Auth, Identity};
use crate::compute::Compute;
use crate::compute::pace::HOLD_TICKS;
use crate::config::{Config, Mode};
use crate::hands::OwnHands;
use crate::metrics::Levels;
use crate::net::{Bodies, Counts, Doors, Guard, Share};
use crate::protocol::reply::{Competition, HandInfo, Limits, TaskInfo};
use crate::protocol::{Code, Refusal};
use crate::replay::Archive;
use crate::rules::Rules;
use crate::store::Store;
use crate::watch::Hub;
use crate::world::live::STREAMED;
use crate::ws::Awake;
use palmares_models::hand::Hand;
use palmares_tasks::Task;
use std::num::NonZero;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};

/// Largest inbound message, bytes.
pub(crate) const MESSAGE_BYTES: usize = 64 << 10;
/// Largest `repeat` of a step.
pub(crate) const REPEAT: u32 = 100;
/// Longest session a practice client may ask for, s.
pub(crate) const LONGEST_SESSION_S: f64 = crate::config::LONGEST_SESSION_S;

/// What an organizer sets.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    /// Worlds that may be open at once.
    pub(crate) max_worlds: usize,
    /// Control connections that may be open at once.
    pub(crate) max_connections: usize,
    /// Those of one team, by its tokens.
    pub(crate) max_connections_per_team: usize,
    /// Sockets of any kind from one address that is not this machine's.
    pub(crate) max_connections_per_address: usize,
    /// How long a control connection may be open before it has said hello.
    pub(crate) hello_timeout: Duration,
    /// Requests per second that a connection may keep up.
    pub(crate) requests_per_s: f64,
    /// How long a session waits for its client to come back.
    pub(crate) resume_grace: Duration,
    /// A connection that is silent for this long, or does not take a message for this long, is dropped.
    pub(crate) ping_timeout: Duration,
}

/// What all sessions share.
#[derive(Debug)]
pub(crate) struct Host {
    /// The database.
    pub(crate) store: Store,
    /// Tasks that can be played.
    pub(crate) tasks: Vec<Arc<Task>>,
    /// Hands that can be played with.
    pub(crate) hands: Vec<Arc<Hand>>,
    /// Where runs are recorded; none for a practice server that does not.
    pub(crate) replays: Option<Arc<Archive>>,
    /// Hands that teams sent in.
    pub(crate) own_hands: OwnHands,
    /// The competition.
    pub(crate) rules: Rules,
    /// Who may what.
    pub(crate) auth: Auth,
    /// Keys, replays, hands.
    pub(crate) data_dir: PathBuf,
    /// Files with secrets: their names in a backup, and where they are.
    pub(crate) secrets: Vec<(&'static str, PathBuf)>,
    /// What an organizer sets.
    pub(crate) settings: Settings,
    /// Where sessions wait for their clients.
    pub(crate) registry: Registry,
    /// What worlds are computed with.
    pub(crate) compute: Arc<Compute>,
    /// Where spectators watch.
    pub(crate) watch: Arc<Hub>,
    /// Connections that wait for their next request without sleeping.
    pub(crate) awake: Awake,
    /// Who is let in.
    pub(crate) doors: Doors,
    /// Which pages may use the server.
    pub(crate) guard: Guard,
    /// What is being sent in.
    pub(crate) bodies: Bodies,
    connections: Arc<Semaphore>,
    by_team: Counts<String>,
    started: Instant,
    stopping: watch::Sender<bool>,
    alive: watch::Sender<usize>,
}

/// The place of a control connection. Dropping it gives it back.
#[derive(Debug)]
pub(crate) struct Seat {
    _of_all: OwnedSemaphorePermit,
    _of_team: Option<Share<String>>,
}

/// Keeps the server from exiting while it exists.
#[derive(Debug)]
pub(crate) struct Alive(watch::Sender<usize>);

impl Drop for Alive {
    fn drop(&mut self) {
        self.0.send_modify(|count| *count -= 1);
    }
}

impl Settings {
    /// Period of pings: three fit into the timeout.
    pub(crate) fn ping_interval(&self) -> Duration {
        self.ping_timeout / 3
    }
}

impl Host {
    /// A host with this store, competition, tasks and hands.
    pub(crate) fn new(
        store: Store,
        rules: Rules,
        config: &Config,
        tasks: Vec<Arc<Task>>,
        hands: Vec<Arc<Hand>>,
        replays: Option<Arc<Archive>>,
    ) -> Self {
        let settings = config.settings.clone();
        let cores = std::thread::available_parallelism().map_or(1, NonZero::get);
        let own_hands = OwnHands::new(&config.data_dir, config.hand_limits.clone(), tasks.clone());
        Host {
            store,
            replays,
            compute: Arc::new(Compute::new(cores, settings.max_worlds)),
            tasks,
            hands,
            own_hands,
            rules,
            auth: Auth::default(),
            data_dir: config.data_dir.clone(),
            secrets: vec![
                ("seed.secret", config.seed_secret.clone()),
                ("signing.key", config.signing_key.clone()),
            ],
            registry: Registry::default(),
            watch: Arc::default(),
            awake: Awake::default(),
            doors: Doors::new(settings.max_connections, settings.max_connections_per_address),
            guard: config.guard.clone(),
            bodies: Bodies::default(),
            connections: Arc::new(Semaphore::new(settings.max_connections)),
            by_team: Counts::default(),
            settings,
            started: Instant::now(),
            stopping: watch::Sender::new(false),
            alive: watch::Sender::new(0),
        }
    }

    /// The sessions' time: since the server started.
    pub(crate) fn now(&self) -> Duration {
        self.started.elapsed()
    }

    /// The task of that name.
    pub(crate) fn task(&self, name: &str) -> Option<&Arc<Task>> {
        self.tasks.iter().find(|task| task.name == name)
    }

    /// The hand of that name.
    pub(crate) fn hand(&self, name: &str) -> Option<&Arc<Hand>> {
        self.hands.iter().find(|hand| hand.name == name)
    }

    /// A place for another connection of a team.
    pub(crate) fn place_for_connection(&self, identity: Option<&Identity>) -> Result<Seat, Refusal> {
        let full = |message: String| Refusal::new(Code::Capacity, message).retry_after(5.0);
        let mut of_team = identity.and_then(|identity| identity.team.clone()).map(|t| self.by_team.share(t));
        let most = self.settings.max_connections_per_team;
        if of_team.as_mut().is_some_and(|share| !share.grow(1, most)) {
            return Err(full(format!("all {most} connections of this team are in use")));
        }
        let of_all = self.connections.clone().try_acquire_owned().map_err(|_| {
            full(format!("all {} connections of this server are in use", self.settings.max_connections))
        })?;
        Ok(Seat { _of_all: of_all, _of_team: of_team })
    }

    /// A guard that the server waits for before it exits.
    pub(crate) fn alive(&self) -> Alive {
        self.alive.send_modify(|count| *count += 1);
        Alive(self.alive.clone())
    }

    /// Tells everyone to finish.
    pub(crate) fn stop(&self) {
        self.stopping.send_replace(true);
    }

    /// Returns when the server is to finish.
    pub(crate) async fn stopping(&self) {
        // The sender lives in `self`: waiting cannot fail.
        let _ = self.stopping.subscribe().wait_for(|&stopping| stopping).await;
    }

    /// Whether the server is finishing.
    pub(crate) fn is_stopping(&self) -> bool {
        *self.stopping.borrow()
    }

    /// Returns when nobody is left.
    pub(crate) async fn deserted(&self) {
        let _ = self.alive.subscribe().wait_for(|&count| count == 0).await;
    }

    /// What there is to be counted now, with what the store knows of runs to be verified.
    pub(crate) fn levels(&self, unverified: usize) -> Levels {
        Levels {
            worlds: self.compute.admission.open().all(),
            sessions: self.registry.len(),
            viewers: self.watch.viewers(),
            unverified,
        }
    }

    /// The competition.
    pub(crate) fn competition(&self) -> Competition {
        let mode = match self.rules.mode {
            Mode::Practice => "practice",
            Mode::Official => "official",
        };
        Competition {
            name: self.rules.name.clone(),
            mode: mode.into(),
            session_s: self.rules.session_s,
            reset_cost_s: self.rules.reset_cost_s,
        }
    }

    /// What a client must keep to.
    pub(crate) fn limits(&self) -> Limits {
        Limits {
            message_bytes: MESSAGE_BYTES,
            repeat: REPEAT,
            requests_per_s: self.settings.requests_per_s,
            requests_burst: 2.0 * self.settings.requests_per_s,
            resume_grace_s: self.settings.resume_grace.as_secs_f64(),
            ping_interval_s: self.settings.ping_interval().as_secs_f64(),
            ping_timeout_s: self.settings.ping_timeout.as_secs_f64(),
            hello_timeout_s: self.settings.hello_timeout.as_secs_f64(),
            hold_ticks: HOLD_TICKS,
            outbox_obs: STREAMED,
        }
    }

    /// The names of the tasks.
    pub(crate) fn task_names(&self) -> Vec<String> {
        self.tasks.iter().map(|task| task.name.clone()).collect()
    }

    /// The tasks in short.
    pub(crate) fn task_infos(&self) -> Vec<TaskInfo> {
        self.tasks.iter().map(|task| TaskInfo::of(task)).collect()
    }

    /// The hands in short that a team can play: everybody's, then its own.
    pub(crate) async fn hand_infos(&self, team: Option<&str>) -> Result<Vec<HandInfo>, Refusal> {
        let own = match team {
            Some(team) => {
                self.own_hands.all(&self.store, &self.compute.background, team, self.rules.official()).await?
            }
            None => Vec::new(),
        };
        // A hand given with --hand comes before a team's own of the same name, as in `reset`.
        let own = own.iter().filter(|own| self.hand(&own.name).is_none());
        Ok(self.hands.iter().chain(own).map(|hand| HandInfo::of(hand)).collect())
    }
}

impl TaskInfo {
    /// A task in short.
    pub(crate) fn of(task: &Task) -> Self {
        TaskInfo {
            name: task.name.clone(),
            description: task.description.clone(),
            tick_s: task.tick_s,
            step_s: task.step_s,
            time_limit_s: task.time_limit_s,
        }
    }
}

impl HandInfo {
    /// A hand in short.
    pub(crate) fn of(hand: &Hand) -> Self {
        HandInfo {
            name: hand.name.clone(),
            description: hand.description.clone(),
            motors: hand.motors.iter().map(|motor| motor.name.clone()).collect(),
            joints: hand.coordinates.iter().map(|coordinate| coordinate.name.clone()).collect(),
        }
    }
}
