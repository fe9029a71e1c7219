//! A server as a host of its database, and a session as its owner has it.

use super::error::StoreError;
use super::location::Dialect;
use sqlx::{AnyConnection, AssertSqlSafe};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;
use tokio::sync::watch;

/// Length of a lease.
pub const LEASE: Duration = Duration::from_millis(2000);

/// The setting with the engine of an open competition.
pub(super) const ENGINE: &str = "engine";

/// Epoch of a new session.
pub const FIRST_EPOCH: i64 = 1;

/// Name of a host that shares its database with no other.
pub const ALONE: &str = "alone";

/// A server as it enters the database.
#[derive(Clone, Debug)]
pub struct Host {
    /// Its name in the fleet; None without a fleet.
    pub name: Option<String>,
    /// SHA-256 of everything in its configuration that all hosts of a competition must have in common.
    pub config_sha256: String,
    /// Commit of its build.
    pub build_hash: String,
    /// The address at which other hosts reach it.
    pub internal_url: Option<String>,
    /// Number of worlds that it can have open.
    pub places: usize,
}

impl Host {
    /// A server without a fleet.
    pub fn alone() -> Self {
        Host {
            name: None,
            config_sha256: String::new(),
            build_hash: String::new(),
            internal_url: None,
            places: 0,
        }
    }
}

/// Characters of the part of an incarnation that is the same as long as the process runs.
pub(super) const PROCESS_DIGITS: i64 = 16;

/// This process, as an owner of sessions.
#[derive(Debug)]
pub(super) struct HostKey {
    pub(super) host_id: String,
    /// Random for each process.
    pub(super) process: String,
    /// How often this process has given up its sessions: then it is another owner.
    generation: AtomicU64,
    pub(super) fleet: bool,
}

impl HostKey {
    pub(super) fn new(host: &Host) -> Result<Self, StoreError> {
        let mut random = [0; 8];
        getrandom::fill(&mut random).map_err(|error| sqlx::Error::Configuration(error.to_string().into()))?;
        let host_id = host.name.clone().unwrap_or_else(|| ALONE.into());
        let generation = AtomicU64::default();
        Ok(HostKey { host_id, process: hex::encode(random), generation, fleet: host.name.is_some() })
    }

    /// Makes this process another owner.
    pub(super) fn give_up(&self) {
        self.generation.fetch_add(1, Ordering::Relaxed);
    }

    /// Tells this owner from others of the same name.
    pub(super) fn incarnation(&self) -> String {
        format!("{}-{}", self.process, self.generation.load(Ordering::Relaxed))
    }
}

/// A host with a valid lease.
#[derive(Clone, Debug, PartialEq)]
pub struct HostRow {
    /// Its name.
    pub host_id: String,
    pub(super) engine: String,
    pub(super) config_sha256: String,
    /// The address at which other hosts reach it.
    pub internal_url: Option<String>,
    /// `up` or `draining`.
    pub state: String,
    /// Worlds that it can have open.
    pub places: i64,
    /// Worlds that it has open and that are not idle.
    pub taken: i64,
    /// Idle worlds that it has open.
    pub idle: i64,
    waiting: String,
}

from_row!(HostRow { host_id, engine, config_sha256, internal_url, state, places, taken, idle, waiting });

impl HostRow {
    /// The sessions that wait for a world there, in the order of its queue.
    pub fn waiting(&self) -> impl Iterator<Item = &str> {
        self.waiting.split_whitespace()
    }
}

/// The hosts whose leases are valid.
pub(super) async fn alive(
    connection: &mut AnyConnection,
    dialect: Dialect,
) -> Result<Vec<HostRow>, StoreError> {
    let now = dialect.now_ms();
    let sql = format!("SELECT * FROM hosts WHERE lease_until >= {now} ORDER BY host_id");
    Ok(sqlx::query_as(AssertSqlSafe(sql)).fetch_all(connection).await?)
}

/// A session that this process owns.
#[derive(Clone, Debug)]
pub struct Held {
    /// The session.
    pub session_id: String,
    /// The epoch of the ownership.
    pub epoch: i64,
    lost: Arc<watch::Sender<bool>>,
    paused: Arc<AtomicBool>,
}

impl Held {
    /// A session with this epoch.
    pub fn new(session_id: String, epoch: i64) -> Self {
        Held { session_id, epoch, lost: Arc::default(), paused: Arc::default() }
    }

    /// Notes whether an organizer has paused the session, as its clock has it.
    pub fn set_paused(&self, paused: bool) {
        self.paused.store(paused, Ordering::Relaxed);
    }

    /// Whether its clock has the pause of an organizer.
    pub fn is_paused(&self) -> bool {
        self.paused.load(Ordering::Relaxed)
    }

    /// Notes that the session has another owner.
    pub fn lose(&self) {
        self.lost.send_replace(true);
    }

    /// Whether the session has another owner.
    pub fn is_lost(&self) -> bool {
        *self.lost.borrow()
    }

    /// Returns when the session has another owner.
    pub async fn lost(&self) {
        // The sender is in `self`: waiting cannot fail.
        let _ = self.lost.subscribe().wait_for(|&lost| lost).await;
    }
}

/// A session of this host, as a beat finds it.
#[derive(Clone, Debug)]
pub struct OwnedSession {
    /// The session, as this process holds it.
    pub held: Held,
    /// Its present epoch.
    pub epoch: i64,
    /// Another host, to which its client has connected.
    pub wanted: Option<String>,
    /// Whether that client has shown the resume token.
    pub firmly: bool,
    /// Whether an organizer has ended it.
    pub ended: bool,
    /// Whether an organizer has paused it.
    pub paused: bool,
}

/// A lease's renewal.
#[derive(Clone, Debug, Default)]
pub struct Renewal {
    /// Worlds that the host can have open.
    pub places: usize,
    /// Worlds that it has open and that are not idle.
    pub taken: usize,
    /// Idle worlds that it has open.
    pub idle: usize,
    /// The sessions that wait for a world, in the order of the queue.
    pub waiting: Vec<String>,
    /// Whether it gives its sessions away and takes no more.
    pub draining: bool,
}
