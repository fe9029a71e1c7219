//! A team's visit: what it consists of, what it tells of itself, how it ends.

use super::command::PendingCommand;
use super::finished::Finished;
use super::machine::Machine;
use super::registry::Registry;
use crate::archive::{Archive, Recording};
use crate::clock::{ClockState, SessionClocks};
use crate::competition::Competition;
use crate::compute::Compute;
use crate::lifecycle::Lifecycle;
use crate::metrics::Levels;
use crate::store::{self, ResumableSession, Store, unix_ms};
use crate::version;
use crate::watch::Hub;
use crate::world::live::Live;
use crate::world::run::World;
use palmares_protocol::Reply;
use palmares_protocol::reply::{TimeReport, Warning, Welcome};
use palmares_protocol::specs::Specs;
use palmares_tasks::Reason;
use palmares_tasks::run::Exposure;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::mpsc;

/// How often the clock is saved while nothing else saves it.
const SAVE_INTERVAL: Duration = Duration::from_secs(5);
/// How long to wait before another attempt to store a result.
const RETRY: Duration = Duration::from_secs(1);

/// What all sessions share.
#[derive(Debug)]
pub(crate) struct Sessions {
    /// The database.
    pub(crate) store: Store,
    /// What is played.
    pub(crate) competition: Arc<Competition>,
    /// What worlds are computed with.
    pub(crate) compute: Arc<Compute>,
    /// Where runs are recorded; none for a practice server that does not.
    pub(crate) archive: Option<Arc<Archive>>,
    /// Where spectators watch.
    pub(crate) hub: Arc<Hub>,
    /// Whether the server is finishing.
    pub(crate) lifecycle: Arc<Lifecycle>,
    /// Where organizers and spectators find the sessions' clocks.
    pub(crate) clocks: Arc<SessionClocks>,
    /// Where sessions wait for their clients.
    pub(crate) registry: Registry<Session>,
}

impl Sessions {
    /// What there is to be counted now, with what the store knows of runs to be verified.
    pub(crate) fn levels(&self, unverified: usize) -> Levels {
        Levels {
            worlds: self.compute.admission.open().all(),
            sessions: self.registry.len(),
            viewers: self.hub.viewers(),
            unverified,
        }
    }
}

/// A team's visit.
#[derive(Debug)]
pub(crate) struct Session {
    pub(super) shared: Arc<Sessions>,
    pub(super) session_id: String,
    /// The secret that takes the session up again.
    pub(super) resume_token: String,
    /// What it is known by.
    pub(super) token_hash: String,
    pub(super) team: String,
    /// Official sessions come first when the server is busy, and outlive it.
    pub(super) official: bool,
    pub(super) machine: Machine,
    pub(super) open_run: OpenRun,
    /// The world whose last observations may not have been taken yet.
    pub(super) stream: Option<Arc<Live>>,
    /// Pictures that the controller of a lockstep run will probably ask for next.
    pub(super) upcoming: Vec<Arc<Exposure>>,
    /// The way to the open run's replay.
    pub(super) recording: Option<Recording>,
    /// A finished run that could not be stored: `stop` tries again.
    pub(super) unstored: Option<Finished>,
    pub(super) commands: mpsc::Receiver<PendingCommand>,
    /// Void runs whose time the clock has back, and whose rows do not say so yet.
    pub(super) paid: Vec<String>,
    saved: Instant,
    /// What the team is told about its name, once.
    pub(super) note: Option<String>,
}

/// Where the open run is played.
#[derive(Debug, Default)]
pub(super) enum OpenRun {
    /// There is no run, or it is finished but not stored yet.
    #[default]
    None,
    /// The world waits for steps.
    Lockstep(Box<World>),
    /// The world follows the clock.
    Realtime(Arc<Live>),
}

/// What a session is known by.
pub(super) struct Names {
    pub(super) session_id: String,
    /// Empty when only its client has it.
    pub(super) resume_token: String,
    pub(super) token_hash: String,
    pub(super) team: String,
}

impl Session {
    /// A session without a run.
    pub(super) fn new(
        shared: &Arc<Sessions>,
        names: Names,
        official: bool,
        machine: Machine,
        commands: mpsc::Receiver<PendingCommand>,
    ) -> Box<Self> {
        let Names { session_id, resume_token, token_hash, team } = names;
        Box::new(Session {
            shared: shared.clone(),
            session_id,
            resume_token,
            token_hash,
            team,
            official,
            machine: machine.with_reset_cost(shared.competition.rules.reset_cost_s),
            open_run: OpenRun::None,
            stream: None,
            upcoming: Vec::new(),
            recording: None,
            unstored: None,
            commands,
            paid: Vec::new(),
            saved: Instant::now(),
            note: None,
        })
    }

    /// A session of an earlier process. Its clock goes on now. None when somebody else has taken it up already.
    pub(super) fn restored(shared: &Arc<Sessions>, row: ResumableSession) -> Option<Box<Self>> {
        let ResumableSession { session_id, team, token_hash, limit_s, clock, paused } = row;
        let state = ClockState::of(&clock);
        let commands = shared.registry.insert_once(&token_hash, &session_id)?;
        let left_s = limit_s.map(|s| s - state.spent.counts_s());
        tracing::info!(session = session_id, team, ?left_s, "session restored");
        let machine = Machine::restored(limit_s, &state, paused, shared.lifecycle.now());
        shared.clocks.show(&session_id, machine.clock());
        // The client that comes back brings the token.
        let names = Names { session_id, resume_token: String::new(), token_hash, team };
        Some(Session::new(shared, names, true, machine, commands))
    }

    /// The sessions' time.
    pub(super) fn now(&self) -> Duration {
        self.shared.lifecycle.now()
    }

    /// Gives the session another resume token.
    pub(super) fn rekey(&mut self, resume_token: String, token_hash: String) {
        (self.resume_token, self.token_hash) = (resume_token, token_hash);
        self.skip_old_observations();
    }

    /// A client that comes back begins with the last observation.
    pub(super) fn skip_old_observations(&self) {
        if let Some(live) = &self.stream {
            live.skip();
        }
    }

    /// Whether the session goes on while its client is away for long: it has a limit and time left.
    pub(super) fn outlasts_absence(&self) -> bool {
        let clock = self.machine.clock();
        clock.limit_s().is_some() && (self.official || clock.is_started()) && !clock.is_over(self.now())
    }

    pub(super) fn left_s(&self) -> Option<f64> {
        self.machine.clock().left_s(self.now())
    }

    /// The reply to `hello`.
    pub(crate) async fn welcome(&mut self, id: u64) -> Reply {
        let (competition, store) = (self.shared.competition.clone(), &self.shared.store);
        let background = &self.shared.compute.background;
        let hands = match competition.hand_infos(store, background, Some(&self.team)).await {
            Ok(hands) => hands,
            // Logged where it failed. The session begins all the same; `reset` knows the hands.
            Err(_) => competition.hand_infos(store, background, None).await.unwrap_or_default(),
        };
        self.catch_up();
        Reply::Welcome(Box::new(Welcome {
            id,
            session_id: self.session_id.clone(),
            resume_token: self.resume_token.clone(),
            team: self.team.clone(),
            session_left_s: self.left_s(),
            competition: competition.info(),
            server: version::own(),
            limits: competition.limits(),
            tasks: competition.task_infos(),
            hands,
            specs: Specs::default(),
            run: self.machine.run_info(),
            note: self.note.take(),
        }))
    }

    /// The reply to `time`.
    pub(super) fn time(&self, id: u64) -> Reply {
        let (clock, now) = (self.machine.clock(), self.now());
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

    /// The realtime world whose news the client is to get.
    pub(crate) fn stream(&self) -> Option<&Arc<Live>> {
        self.stream.as_ref()
    }

    /// Brings the machine up to the tick of a realtime world.
    pub(super) fn catch_up(&mut self) {
        if let OpenRun::Realtime(live) = &self.open_run {
            self.machine.stepped(live.tick_now(), self.now());
        }
    }

    /// The next thing an organizer asks.
    pub(crate) async fn command(&mut self) -> PendingCommand {
        match self.commands.recv().await {
            Some(command) => command,
            // The registry holds the other end as long as the session exists.
            None => std::future::pending().await,
        }
    }

    /// When [`Session::expire`] has something to do, if the client does nothing until then.
    pub(crate) fn next_change(&self) -> Option<Duration> {
        let change = self.machine.next_change(self.now())?;
        // A result that could not be stored is tried again, but not all the time.
        Some(if self.unstored.is_some() { change.max(RETRY) } else { change })
    }

    /// The warning that is due.
    pub(crate) fn warning(&mut self) -> Option<Reply> {
        let mark_s = self.machine.warning(self.now())?;
        let session_left_s = self.left_s().unwrap_or_default();
        Some(Reply::Warning(Warning { mark_s, session_left_s }))
    }

    /// Closes the run if the session's time is spent; returns the warning that is due.
    pub(crate) async fn expire(&mut self) -> Option<Reply> {
        let warning = self.warning();
        if warning.is_none() {
            self.close_if_over().await;
        }
        warning
    }

    /// Shows the clock to organizers, and saves it, so that the session outlives the server; `now` or when it is time
    /// again.
    pub(super) async fn save(&mut self, now: bool) {
        self.shared.clocks.show(&self.session_id, self.machine.clock());
        let due = self.official && (now || self.saved.elapsed() >= SAVE_INTERVAL);
        if !due && self.paid.is_empty() {
            return;
        }
        self.saved = Instant::now();
        let saved = self.machine.saved(self.now());
        let run_from_s = self.machine.playing().map(|_| saved.spent.counts_s());
        let row = store::ClockState { run_from_s, ..saved.row() };
        match self.shared.store.save_clock(&self.session_id, &row, &self.paid).await {
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
        if self.official && self.shared.lifecycle.is_stopping() && self.outlasts_absence() {
            tracing::debug!(session = self.session_id, "it goes on when the server is back");
        } else if let Err(error) = self.shared.store.end_session(&self.session_id).await {
            tracing::error!(%error, session = self.session_id, "the session's end could not be stored");
        }
        self.shared.registry.remove(&self.token_hash, &self.session_id);
        self.shared.clocks.remove(&self.session_id);
        tracing::info!(session = self.session_id, "session ended");
        result.map(|result| Reply::Result(Box::new(result)))
    }
}
