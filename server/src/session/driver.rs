//! A team's visit: how it begins, what it tells of itself, how it ends.

use super::clock::{ClockState, Spent};
use super::host::Host;
use super::machine::{Machine, Playing};
use super::official::{self, Entry};
use super::orders::Ordered;
use super::registry;
use crate::auth::{self, Identity};
use crate::protocol::reply::{ServerInfo, TimeReport, Warning, Welcome};
use crate::protocol::specs::Specs;
use crate::protocol::{Code, Hello, Refusal, Reply};
use crate::replay::{Recording, ReplayFile};
use crate::store::{self, NewSession, ResumableSession, StoreError, unix_ms};
use crate::world::live::{Course, Live};
use crate::world::run::World;
use palmares_tasks::{Outcome, Reason};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::mpsc;

/// How often the clock is saved while nothing else saves it.
const SAVE_INTERVAL: Duration = Duration::from_secs(5);

/// A team's visit.
#[derive(Debug)]
pub(crate) struct Session {
    pub(super) host: Arc<Host>,
    pub(super) session_id: String,
    resume_token: String,
    token_hash: String,
    pub(super) team: String,
    /// Official sessions come first when the server is busy, and outlive it.
    pub(super) official: bool,
    pub(super) machine: Machine,
    pub(super) stage: Stage,
    /// The world whose last observations may not have been taken yet.
    pub(super) stream: Option<Arc<Live>>,
    /// The way to the open run's replay.
    pub(super) recording: Option<Recording>,
    /// A finished run that could not be stored: `stop` tries again.
    pub(super) unstored: Option<Finished>,
    pub(super) orders: mpsc::Receiver<Ordered>,
    /// Void runs whose time the clock has back, and whose rows do not say so yet.
    pub(super) paid: Vec<String>,
    saved: Instant,
    /// What the team is told about its name, once.
    note: Option<String>,
}

/// Where the open run is played.
#[derive(Debug, Default)]
pub(super) enum Stage {
    /// There is no run, or it is finished but not stored yet.
    #[default]
    Empty,
    /// The world waits for steps.
    Lockstep(Box<World>),
    /// The world follows the clock.
    Realtime(Arc<Live>),
}

/// A run that has ended.
#[derive(Debug)]
pub(super) struct Finished {
    pub(super) run: Playing,
    pub(super) outcome: Outcome,
    pub(super) status: &'static str,
    /// Whether its time is given back when it is void.
    pub(super) refunded: bool,
    pub(super) note: Option<String>,
    pub(super) course: Course,
    pub(super) replay: Option<ReplayFile>,
    /// How the session's clock stood then: what passes until the result is stored is the server's fault.
    pub(super) ended: Spent,
}

/// `bytes` random bytes as lower-case hexadecimal.
pub(super) fn random_hex(bytes: usize) -> Result<String, Refusal> {
    auth::random_hex(bytes).map_err(|error| {
        tracing::error!(%error, "no randomness");
        Refusal::new(Code::Internal, "the server has no randomness")
    })
}

/// What the server keeps of a secret.
pub(super) fn hash_of(token: &str) -> String {
    auth::sha256_hex(token.as_bytes())
}

/// Logs a failure of the store and words it for the client.
pub(super) fn store_failed(what: &str, error: &StoreError) -> Refusal {
    tracing::error!(%error, what, "store failed");
    Refusal::new(Code::Internal, format!("{what} could not be stored; nothing was lost, try again"))
        .retry_after(1.0)
}

/// How long to wait before another attempt to store a result.
const RETRY: Duration = Duration::from_secs(1);

impl Session {
    /// Opens a new session.
    pub(crate) async fn begin(
        host: &Arc<Host>,
        hello: &Hello,
        identity: Option<&Identity>,
    ) -> Result<Box<Self>, Refusal> {
        if let Some(session) = official::take_up(host, identity).await? {
            tracing::info!(session = session.session_id, "session taken up again by its team's token");
            return Ok(session);
        }
        let Entry { team, client_version, limit_s, mode, most, note } =
            official::entry(host, hello, identity).await?;
        let session_id = format!("ses_{}", random_hex(8)?);
        let resume_token = random_hex(16)?;
        let token_hash = hash_of(&resume_token);
        let row = NewSession {
            session_id: session_id.clone(),
            team: team.clone(),
            client_version,
            limit_s,
            mode,
            token_hash: Some(token_hash.clone()),
        };
        // Before anybody can find it in the database: whoever does finds it taken, not gone.
        let orders = host.registry.insert(&token_hash, &session_id);
        let begun = host.store.begin_session(&row, most).await;
        let begun = begun.map_err(|error| store_failed("the session", &error));
        if !matches!(begun, Ok(true)) {
            host.registry.remove(&token_hash, &session_id);
            begun?;
            // Another connection of the team may have been first.
            if let Some(session) = official::take_up(host, identity).await? {
                return Ok(session);
            }
            let message = "the team has had all its sessions; ask the organizer";
            return Err(Refusal::new(Code::SessionOver, message));
        }
        let session = Box::new(Session {
            host: host.clone(),
            session_id,
            resume_token,
            token_hash,
            team,
            official: host.rules.official(),
            machine: Machine::new(limit_s).with_reset_cost(host.rules.reset_cost_s),
            stage: Stage::Empty,
            stream: None,
            recording: None,
            unstored: None,
            orders,
            paid: Vec::new(),
            saved: Instant::now(),
            note,
        });
        tracing::info!(session = session.session_id, team = session.team, "session opened");
        Ok(session)
    }

    /// Takes up the session that waits for this client.
    pub(crate) async fn resume(
        host: &Host,
        token: &str,
        identity: Option<&Identity>,
    ) -> Result<Box<Self>, Refusal> {
        official::may_resume(host, token, identity).await?;
        let mut session = host.registry.claim(&hash_of(token)).await?;
        session.resume_token = token.to_owned();
        if let Some(live) = &session.stream {
            live.skip();
        }
        tracing::info!(session = session.session_id, "session taken up again");
        Ok(session)
    }

    /// Leaves a session of an earlier process waiting for its client. Its clock goes on now.
    pub(crate) fn restore(host: &Arc<Host>, row: ResumableSession) {
        let ResumableSession { session_id, team, token_hash, limit_s, clock, paused } = row;
        let state = ClockState::of(&clock);
        let Some(orders) = host.registry.insert_once(&token_hash, &session_id) else { return };
        tracing::info!(session = session_id, team, left_s = ?limit_s.map(|s| s - state.spent.counts_s()), "session restored");
        let machine =
            Machine::restored(limit_s, &state, paused, host.now()).with_reset_cost(host.rules.reset_cost_s);
        host.registry.show(&session_id, machine.clock());
        registry::park(Box::new(Session {
            host: host.clone(),
            session_id,
            // The client that comes back brings it.
            resume_token: String::new(),
            token_hash,
            team,
            official: true,
            machine,
            stage: Stage::Empty,
            stream: None,
            recording: None,
            unstored: None,
            orders,
            paid: Vec::new(),
            saved: Instant::now(),
            note: None,
        }));
    }

    /// Gives the session another resume token.
    pub(super) fn rekey(&mut self, resume_token: String, token_hash: String) {
        (self.resume_token, self.token_hash) = (resume_token, token_hash);
        if let Some(live) = &self.stream {
            live.skip();
        }
    }

    /// The client says bye: a practice session ends, an official one goes on without it as long as it has time.
    pub(crate) async fn leave(mut self: Box<Self>) {
        if self.official && !self.machine.clock().is_over(self.host.now()) {
            if self.machine.playing().is_some() {
                self.close_run(Reason::Stopped, Some("the client said bye")).await;
            }
            self.park();
        } else {
            self.end(Reason::Stopped, Some("the client said bye")).await;
        }
    }

    /// Leaves the session waiting for its client.
    pub(crate) fn park(self: Box<Self>) {
        tracing::info!(session = self.session_id, "connection lost; the session waits");
        registry::park(self);
    }

    /// What all sessions share.
    pub(crate) fn host(&self) -> &Arc<Host> {
        &self.host
    }

    /// What the secret that takes the session up again is known by.
    pub(super) fn token_hash(&self) -> &str {
        &self.token_hash
    }

    /// Whether the session goes on while its client is away for long: it has a limit and time left.
    pub(super) fn outlasts_absence(&self) -> bool {
        let clock = self.machine.clock();
        clock.limit_s().is_some() && (self.official || clock.is_started()) && !clock.is_over(self.host.now())
    }

    pub(super) fn left_s(&self) -> Option<f64> {
        self.machine.clock().left_s(self.host.now())
    }

    /// The reply to `hello`.
    pub(crate) async fn welcome(&mut self, id: u64) -> Reply {
        let hands = match self.host.hand_infos(Some(&self.team)).await {
            Ok(hands) => hands,
            // Logged where it failed. The session begins all the same; `reset` knows the hands.
            Err(_) => self.host.hand_infos(None).await.unwrap_or_default(),
        };
        self.catch_up();
        Reply::Welcome(Box::new(Welcome {
            id,
            session_id: self.session_id.clone(),
            resume_token: self.resume_token.clone(),
            team: self.team.clone(),
            session_left_s: self.left_s(),
            competition: self.host.competition(),
            server: ServerInfo::own(),
            limits: self.host.limits(),
            tasks: self.host.task_infos(),
            hands,
            specs: Specs::new(),
            run: self.machine.run_info(),
            note: self.note.take(),
        }))
    }

    /// The reply to `time`.
    pub(crate) fn time(&mut self, id: u64) -> Reply {
        self.catch_up();
        let (clock, now) = (self.machine.clock(), self.host.now());
        Reply::Time(TimeReport {
            id,
            session_left_s: clock.left_s(now),
            session_s: clock.limit_s(),
            elapsed_s: clock.elapsed_s(now),
            wall_s: clock.wall_s(now),
            simulated_s: clock.simulated_s(),
            refunded_s: clock.refunded_s(),
            paused: clock.is_paused(),
            run: self.machine.run_info(),
            server_unix_ms: unix_ms().unsigned_abs(),
        })
    }

    /// When [`Session::expire`] has something to do, if the client does nothing until then.
    pub(crate) fn next_change(&self) -> Option<Duration> {
        let change = self.machine.next_change(self.host.now())?;
        // A result that could not be stored is tried again, but not all the time.
        Some(if self.unstored.is_some() { change.max(RETRY) } else { change })
    }

    /// Closes the run if the session's time is spent; returns the warning that is due.
    pub(crate) async fn expire(&mut self) -> Option<Reply> {
        let now = self.host.now();
        if let Some(mark_s) = self.machine.warning(now) {
            let session_left_s = self.left_s().unwrap_or_default();
            return Some(Reply::Warning(Warning { mark_s, session_left_s }));
        }
        self.close_if_over().await;
        None
    }

    /// Shows the clock to organizers, and saves it, so that the session outlives the server; `now` or when it is time
    /// again.
    pub(super) async fn save(&mut self, now: bool) {
        self.host.registry.show(&self.session_id, self.machine.clock());
        let due = self.official && (now || self.saved.elapsed() >= SAVE_INTERVAL);
        if !due && self.paid.is_empty() {
            return;
        }
        self.saved = Instant::now();
        let saved = self.machine.saved(self.host.now());
        let run_from_s = self.machine.playing().map(|_| saved.spent.counts_s());
        let row = store::ClockState { run_from_s, ..saved.row() };
        match self.host.store.save_clock(&self.session_id, &row, &self.paid).await {
            Ok(()) => self.paid.clear(),
            // The next save, a few seconds later, tries again.
            Err(error) => {
                tracing::error!(%error, session = self.session_id, "the session's clock could not be saved");
            }
        }
    }

    /// Ends the session: an open run is finished for `reason`. Returns that run's result.
    pub(crate) async fn end(mut self: Box<Self>, reason: Reason, note: Option<&str>) -> Option<Reply> {
        let result = match self.machine.playing() {
            Some(_) => self.finish(reason, note).await.ok(),
            None => None,
        };
        // Also of a session that is over: time may be granted or given back to it.
        self.save(true).await;
        if self.official && self.host.is_stopping() && self.outlasts_absence() {
            tracing::debug!(session = self.session_id, "it goes on when the server is back");
        } else if let Err(error) = self.host.store.end_session(&self.session_id).await {
            tracing::error!(%error, session = self.session_id, "the session's end could not be stored");
        }
        self.host.registry.remove(&self.token_hash, &self.session_id);
        tracing::info!(session = self.session_id, "session ended");
        result.map(|result| Reply::Result(Box::new(result)))
    }
}
