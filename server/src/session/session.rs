//! A team's session: its parts, its reports, its end.

use super::after_run::AfterRun;
use super::answered::Answered;
use super::clock_rows::{self, saved_row};
use super::command::PendingCommand;
use super::machine::Machine;
use super::open_run::{OpenRun, Stage, Stream};
use super::registry::{Claims, Inbox, Registry};
use crate::archive::Archive;
use crate::competition::Competition;
use crate::fleet::lease::Lease;
use crate::fleet::shipper::Shipper;
use crate::watch::Hub;
use palmares_net::process::lifecycle::Lifecycle;
use palmares_net::process::version;
use palmares_protocol::Reply;
use palmares_protocol::reply::{TimeReport, Warning, Welcome};
use palmares_protocol::specs::Specs;
use palmares_store::{Held, ResumableSession, Store, unix_ms};
use palmares_tasks::Reason;
use palmares_worlds::clock::{Saving, SessionClocks};
use palmares_worlds::compute::Compute;
use palmares_worlds::world::backlog::Gate;
use palmares_worlds::world::realtime::RealtimeWorld;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::{Mutex, oneshot};

/// Time until the next attempt to store a result.
pub(super) const RETRY: Duration = Duration::from_secs(1);

/// Held while sessions are taken over.
#[derive(Debug, Default)]
pub(crate) struct Adopting(pub(super) tokio::sync::Mutex<()>);

/// The parts that all sessions share.
#[derive(Debug)]
pub(crate) struct Sessions {
    /// The database.
    pub(crate) store: Store,
    /// Tasks, hands and rules.
    pub(crate) competition: Arc<Competition>,
    /// Computing resources.
    pub(crate) compute: Arc<Compute>,
    /// Replays; None on a practice server that does not record.
    pub(crate) archive: Option<Arc<Archive>>,
    /// Spectators' hub.
    pub(crate) hub: Arc<Hub>,
    /// The server's stop.
    pub(crate) lifecycle: Arc<Lifecycle>,
    /// The sessions' clocks, for organizers and spectators.
    pub(crate) clocks: Arc<SessionClocks>,
    /// The open sessions.
    pub(crate) registry: Registry<Session>,
    /// Held while a change of the competition's state is applied to the sessions.
    pub(crate) following: Mutex<()>,
    /// This server's right to them.
    pub(crate) lease: Arc<Lease>,
    /// Stores the ticks of official runs, so that another host can continue them; None without a fleet.
    pub(crate) shipper: Option<Shipper>,
    /// Held while sessions are taken over.
    pub(crate) adopting: Adopting,
    /// Held while the clocks are saved, and while a clock loses time that was given back: a late save must not give it back again.
    pub(crate) saving: Mutex<()>,
}

/// A team's session.
#[derive(Debug)]
pub(crate) struct Session {
    pub(super) shared: Arc<Sessions>,
    /// This process's ownership of the session in the database.
    pub(super) held: Held,
    /// The secret that resumes the session.
    pub(super) resume_token: String,
    /// Hash of that secret.
    pub(super) token_hash: String,
    pub(super) team: String,
    /// Official sessions have priority, and outlive the server.
    pub(super) official: bool,
    pub(super) machine: Machine,
    /// The run that the machine plays.
    pub(super) open_run: Option<OpenRun>,
    /// The observations of the last realtime run, until `stop` or another run.
    pub(super) stream: Option<Stream>,
    /// While the clock of a session with a continued run stands until its client is back: whether an organizer has paused it.
    pub(super) standing: Option<bool>,
    /// For a client that has missed a reply.
    pub(super) answered: Answered,
    inbox: Inbox<Session>,
    /// Refunded runs whose rows are not updated yet.
    pub(super) refunded_runs: Vec<String>,
    /// A remark on the team's name, for the first `welcome`.
    pub(super) note: Option<String>,
}

/// Hands a session to its client's new connection.
pub(crate) type Handover = oneshot::Sender<Box<Session>>;

/// A message from an organizer or a new connection.
#[derive(Debug)]
pub(crate) enum InboxMessage {
    /// An organizer's command.
    Command(PendingCommand),
    /// A new connection wants the session.
    Claim(Handover),
}

/// The next claim with the session's present token. `held`: a connection holds the session, and keeps it when the claimant is gone by now.
/// A session that waits is given to a claimant that is gone, too: then it waits again, for others.
async fn claimed(claims: &mut Claims<Session>, token_hash: &str, held: bool) -> Handover {
    loop {
        match claims.recv().await {
            Some(claim) if claim.token_hash == token_hash && !(held && claim.to.is_closed()) => {
                return claim.to;
            }
            // Dropping it refuses it.
            Some(_) => {}
            // The registry has no session any more.
            None => return std::future::pending().await,
        }
    }
}

/// The ids of a session.
pub(super) struct SessionIds {
    pub(super) held: Held,
    /// Empty when only the client has it.
    pub(super) resume_token: String,
    pub(super) token_hash: String,
    pub(super) team: String,
}

impl Session {
    /// A session without a run.
    pub(super) fn new(
        shared: &Arc<Sessions>,
        ids: SessionIds,
        official: bool,
        machine: Machine,
        inbox: Inbox<Session>,
    ) -> Box<Self> {
        let SessionIds { held, resume_token, token_hash, team } = ids;
        let rules = &shared.competition.rules;
        let mut machine = machine.with_reset_cost(rules.reset_cost_s);
        machine.set_competition_paused(rules.is_paused(), shared.lifecycle.now());
        Box::new(Session {
            shared: shared.clone(),
            held,
            resume_token,
            token_hash,
            team,
            official,
            machine,
            open_run: None,
            stream: None,
            standing: None,
            answered: Answered::default(),
            inbox,
            refunded_runs: Vec::new(),
            note: None,
        })
    }

    /// A session of an earlier process. Its clock continues now. None when it is open already.
    pub(super) fn restored(shared: &Arc<Sessions>, row: ResumableSession) -> Option<Box<Self>> {
        let ResumableSession { session_id, team, token_hash, limit_s, clock, paused, epoch, .. } = row;
        let state = clock_rows::state(&clock);
        let held = Held::new(session_id.clone(), epoch);
        held.set_paused(paused);
        let inbox = shared.registry.insert(&token_hash, &held)?;
        let left_s = limit_s.map(|s| s - state.spent.counts_s());
        tracing::info!(session = session_id, team, ?left_s, "session restored");
        let machine = Machine::restored(limit_s, &state, paused, shared.lifecycle.now());
        // The client has the token.
        let ids = SessionIds { held, resume_token: String::new(), token_hash, team };
        let session = Session::new(shared, ids, true, machine, inbox);
        session.show_clock();
        Some(session)
    }

    /// Time of the sessions: since the server started.
    pub(super) fn now(&self) -> Duration {
        self.shared.lifecycle.now()
    }

    /// Gives the session another resume token.
    pub(super) fn rekey(&mut self, resume_token: String, token_hash: String) {
        (self.resume_token, self.token_hash) = (resume_token, token_hash);
        self.keep_last_observation();
    }

    /// Drops all streamed observations but the last, for a client that reconnects.
    pub(super) fn keep_last_observation(&self) {
        if let Some(stream) = &self.stream {
            stream.live.keep_last();
        }
    }

    /// Whether the session survives a long absence of its client: it has a limit and time left.
    pub(super) fn outlasts_absence(&self) -> bool {
        let clock = self.machine.clock();
        clock.limit_s().is_some() && (self.official || clock.is_started()) && !clock.is_over(self.now())
    }

    /// Whether its time is over and all its results are stored.
    pub(super) fn is_spent(&self) -> bool {
        let over = self.machine.clock().is_over(self.now());
        over && self.machine.playing().is_none()
    }

    /// The world of an open realtime run.
    pub(super) fn realtime(&self) -> Option<&Arc<RealtimeWorld>> {
        self.open_run.as_ref()?.realtime()
    }

    /// The gate of the open run.
    pub(super) fn gate(&self) -> Option<&Gate> {
        self.open_run.as_ref()?.gate.as_ref()
    }

    /// When the result that could not be stored is tried again.
    fn try_again_at(&self) -> Option<Duration> {
        match self.open_run.as_ref()?.stage {
            Stage::Unstored(_, try_again_at) => Some(try_again_at),
            Stage::Played(..) | Stage::Closing => None,
        }
    }

    /// Whether the result of the open run could not be stored.
    pub(super) fn is_unstored(&self) -> bool {
        self.try_again_at().is_some()
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
            // Logged where it failed. The session begins without the team's hands in `welcome`.
            Err(_) => competition.hand_infos(store, background, None).await.unwrap_or_default(),
        };
        self.catch_up();
        let mut run = self.machine.run_info();
        // A realtime world has ticked meanwhile: these observations come after the welcome.
        if let (Some(run), Some(oldest)) = (&mut run, self.stream().and_then(|live| live.oldest_waiting())) {
            run.tick = run.tick.min(oldest);
        }
        Reply::Welcome(Box::new(Welcome {
            id,
            session_id: self.held.session_id.clone(),
            resume_token: self.resume_token.clone(),
            team: self.team.clone(),
            session_left_s: self.left_s(),
            competition: competition.info(),
            server: version::own(),
            limits: competition.limits(),
            tasks: competition.task_infos(),
            hands,
            specs: Specs::default(),
            run,
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

    /// This process's ownership of the session.
    pub(crate) fn held(&self) -> &Held {
        &self.held
    }

    /// Ends the session here without a write: another owner continues it. Its world and its recording end.
    pub(crate) fn part(mut self: Box<Self>) {
        if let Some(live) = self.realtime() {
            // Dropped: it ticks no more.
            drop(live.take(None));
        }
        self.forget_run(AfterRun::Leave);
        self.shared.registry.remove(&self.held);
        self.shared.clocks.remove(&self.held.session_id, self.held.epoch);
        tracing::info!(
            session = self.held.session_id,
            "the session ends here; it continues with another owner"
        );
    }

    /// The realtime world whose observations the client gets.
    pub(crate) fn stream(&self) -> Option<&Arc<RealtimeWorld>> {
        self.stream.as_ref().map(|stream| &stream.live)
    }

    /// Gives back the time for which the run stood at its gate, and updates the machine to the tick of a realtime world.
    pub(super) fn catch_up(&mut self) {
        let now = self.now();
        let Some(run) = &self.open_run else { return };
        if let Some(gate) = &run.gate {
            self.machine.stood(gate.take_stood(), now);
        }
        if let Some(live) = run.realtime() {
            self.machine.stepped(live.tick_now(), now);
        }
        self.tell_end();
    }

    /// Tells a realtime world when the session's time is spent.
    pub(super) fn tell_end(&self) {
        if let Some(live) = self.realtime() {
            live.end_at(self.machine.clock().ends_in(self.now()).map(|left| Instant::now() + left));
        }
    }

    /// The next message from an organizer or a new connection. `held` as in [`Session::claimed`].
    pub(crate) async fn inbox_message(&mut self, held: bool) -> InboxMessage {
        let Inbox { commands, claims } = &mut self.inbox;
        tokio::select! {
            Some(command) = commands.recv() => InboxMessage::Command(command),
            to = claimed(claims, &self.token_hash, held) => InboxMessage::Claim(to),
        }
    }

    /// The next connection that shows the resume token. `held`: a connection holds the session.
    pub(crate) async fn claimed(&mut self, held: bool) -> Handover {
        claimed(&mut self.inbox.claims, &self.token_hash, held).await
    }

    /// Time until [`Session::expire`] is due, if no request comes until then.
    pub(crate) fn next_change(&self) -> Option<Duration> {
        match self.try_again_at() {
            // A fixed moment: requests do not put it off.
            Some(moment) => Some(moment.saturating_sub(self.now())),
            None => self.machine.next_change(self.now()),
        }
    }

    /// The warning that is due.
    pub(crate) fn warning(&mut self) -> Option<Reply> {
        let mark_s = self.machine.warning(self.now())?;
        let session_left_s = self.left_s().unwrap_or_default();
        Some(Reply::Warning(Warning { mark_s, session_left_s }))
    }

    /// Closes the run if the session's time is spent or its result could not be stored, or returns the warning that is due.
    pub(crate) async fn expire(&mut self) -> Option<Reply> {
        let warning = self.warning();
        if warning.is_none() && self.is_unstored() {
            // It keeps the reason for which it has ended.
            self.close_run(Reason::Stopped, None).await;
        } else if warning.is_none() {
            self.close_if_over().await;
        }
        warning
    }

    /// Shows the clock to organizers and spectators, to a realtime world, and to [`Sessions::save_clocks`].
    pub(super) fn show_clock(&self) {
        // A clock and the refunds that it includes are saved together.
        let saving = match self.machine.before_run() {
            _ if !self.official || !self.refunded_runs.is_empty() => Saving::Own,
            Some(before) => Saving::BeforeRun(before),
            None => Saving::Present,
        };
        self.shared.clocks.show(&self.held.session_id, self.held.epoch, self.machine.clock(), saving);
        self.tell_end();
    }

    /// Shows the clock. Saves it for a later process, with `now` or while refunds are not saved yet.
    pub(super) async fn save(&mut self, now: bool) {
        self.show_clock();
        if !(self.official && now) && self.refunded_runs.is_empty() {
            return;
        }
        let row = saved_row(self.machine.saved(self.now()), self.machine.playing().is_some());
        let (shared, held, refunded) = (self.shared.clone(), self.held.clone(), self.refunded_runs.clone());
        match self.stored(shared.store.save_clock(&held, &row, &refunded)).await {
            Ok(()) => {
                self.refunded_runs.clear();
                self.show_clock();
            }
            // Without refunds the next save of all clocks tries again; otherwise the next request.
            Err(error) => {
                tracing::error!(%error, session = self.held.session_id, "the session's clock could not be saved");
            }
        }
    }

    /// Ends the session: an open run is finished for `reason`. Returns that run's result.
    pub(crate) async fn end(mut self: Box<Self>, reason: Reason, note: Option<&str>) -> Option<Reply> {
        let result = match self.machine.playing() {
            Some(_) => self.finish(reason, note).await.ok(),
            None => None,
        };
        // Even when the session is over: it may get time again.
        self.save(true).await;
        if self.official && self.shared.lifecycle.is_stopping() && self.outlasts_absence() {
            tracing::debug!(session = self.held.session_id, "the session continues after the restart");
        } else if let Err(error) = self.shared.store.end_session(&self.held).await {
            tracing::error!(%error, session = self.held.session_id, "the session's end could not be stored");
        }
        self.shared.registry.remove(&self.held);
        self.shared.clocks.remove(&self.held.session_id, self.held.epoch);
        tracing::info!(session = self.held.session_id, "session ended");
        result.map(|result| Reply::Result(Box::new(result)))
    }
}
