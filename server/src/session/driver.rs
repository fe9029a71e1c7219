//! Carries out what a client asks of its session.

use super::background::JobError;
use super::host::{Host, LONGEST_SESSION_S, REPEAT};
use super::machine::{Machine, Playing, Stopping};
use super::registry;
use super::world::{OpenError, Plan, StepError, Witness, World};
use crate::protocol::reply::{Obs, Opened, RunResult, ServerInfo, TimeReport, Warning, Welcome};
use crate::protocol::request::shortened;
use crate::protocol::specs::Specs;
use crate::protocol::{Code, Hello, Refusal, Reply, Reset, Step};
use crate::store::{FinishedRun, NewRun, NewSession, StoreError, unix_ms};
use crate::watch::messages::WatchRun;
use palmares_models::hand::Hand;
use palmares_tasks::{Outcome, Reason, Run, Seed, Sensing, Task};
use std::sync::Arc;
use std::time::Duration;

/// A team's visit.
#[derive(Debug)]
pub(crate) struct Session {
    host: Arc<Host>,
    session_id: String,
    resume_token: String,
    team: String,
    machine: Machine,
    /// The open run's world; none when there is no run, or it is finished but not stored yet.
    world: Option<World>,
    /// A finished run that could not be stored: `stop` tries again.
    unstored: Option<Finished>,
}

/// A run that has ended.
#[derive(Debug)]
struct Finished {
    run: Playing,
    outcome: Outcome,
    status: &'static str,
    note: Option<String>,
}

/// `bytes` random bytes as lower-case hexadecimal.
fn random_hex(bytes: usize) -> Result<String, Refusal> {
    let mut buffer = vec![0; bytes];
    getrandom::fill(&mut buffer).map_err(|error| {
        tracing::error!(%error, "no randomness");
        Refusal::new(Code::Internal, "the server has no randomness")
    })?;
    Ok(buffer.iter().map(|byte| format!("{byte:02x}")).collect())
}

/// A practice seed that a person can type.
fn random_seed() -> Result<u64, Refusal> {
    let hex = random_hex(4)?;
    Ok(u64::from_str_radix(&hex, 16).unwrap_or_default())
}

/// Logs a failure of the store and words it for the client.
fn store_failed(what: &str, error: &StoreError) -> Refusal {
    tracing::error!(%error, what, "store failed");
    Refusal::new(Code::Internal, format!("{what} could not be stored; nothing was lost, try again"))
        .retry_after(1.0)
}

impl Session {
    /// Opens a new session.
    pub(crate) async fn begin(host: &Arc<Host>, hello: &Hello) -> Result<Box<Self>, Refusal> {
        let (team, client_version) = hello.client.checked()?;
        if let Some(seconds) = hello.session_s
            && !(seconds > 0.0 && seconds <= LONGEST_SESSION_S)
        {
            let message = format!("session_s: expected more than 0 and at most {LONGEST_SESSION_S} s");
            return Err(Refusal::new(Code::BadRequest, message));
        }
        let session = Box::new(Session {
            host: host.clone(),
            session_id: format!("ses_{}", random_hex(8)?),
            resume_token: random_hex(16)?,
            team: team.clone(),
            machine: Machine::new(hello.session_s),
            world: None,
            unstored: None,
        });
        let row = NewSession {
            session_id: session.session_id.clone(),
            team,
            client_version,
            limit_s: hello.session_s,
            mode: "practice",
            token_hash: None,
        };
        host.store.begin_session(&row, None).await.map_err(|error| store_failed("the session", &error))?;
        host.registry.insert(&session.resume_token);
        tracing::info!(session = session.session_id, team = session.team, "session opened");
        Ok(session)
    }

    /// Takes up the session that waits for this client.
    pub(crate) async fn resume(host: &Host, token: &str) -> Result<Box<Self>, Refusal> {
        let session = host.registry.claim(token).await?;
        tracing::info!(session = session.session_id, "session taken up again");
        Ok(session)
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

    /// The secret that takes the session up again.
    pub(crate) fn resume_token(&self) -> &str {
        &self.resume_token
    }

    fn left_s(&self) -> Option<f64> {
        self.machine.clock().left_s(self.host.now())
    }

    /// The reply to `hello`.
    pub(crate) fn welcome(&self, id: u64) -> Reply {
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
            hands: self.host.hand_infos(),
            specs: Specs::new(),
            run: self.machine.run_info(),
        }))
    }

    /// The reply to `time`.
    pub(crate) fn time(&self, id: u64) -> Reply {
        let (clock, now) = (self.machine.clock(), self.host.now());
        Reply::Time(TimeReport {
            id,
            session_left_s: clock.left_s(now),
            session_s: clock.limit_s(),
            elapsed_s: clock.elapsed_s(now),
            wall_s: clock.wall_s(now),
            simulated_s: clock.simulated_s(),
            run: self.machine.run_info(),
            server_unix_ms: unix_ms().unsigned_abs(),
        })
    }

    /// Opens a run.
    pub(crate) async fn reset(&mut self, id: u64, reset: Reset) -> Result<Reply, Refusal> {
        self.machine.may_reset(self.host.now())?;
        let task = self.host.task(&reset.task).ok_or_else(|| {
            let known = names(self.host.tasks.iter().map(|task| task.name.as_str()));
            let message = format!("no task `{}`; there are: {known}", shortened(&reset.task));
            Refusal::new(Code::UnknownTask, message)
        })?;
        let hand = self.host.hand(&reset.hand).ok_or_else(|| {
            let known = names(self.host.hands.iter().map(|hand| hand.name.as_str()));
            let message = format!("no hand `{}`; there are: {known}", shortened(&reset.hand));
            Refusal::new(Code::UnknownHand, message)
        })?;
        let place = self.host.place_for_world()?;
        let number = match reset.seed {
            Some(number) => number,
            None => random_seed()?,
        };
        let (seed, run_id) = (Seed::from_u64(number), format!("run_{}", random_hex(8)?));
        let plan = Plan { task: task.clone(), hand: hand.clone(), seed, sensing: reset.sensing };
        let onlookers = self.onlookers(&run_id, task, hand, reset.sensing);
        let opened = World::open(plan, place, &self.host.background, onlookers).await.map_err(|error| {
            tracing::error!(%error, task = task.name, hand = hand.name, seed = seed.to_hex(), "no world");
            let message = match error {
                OpenError::Scene(_) | OpenError::Job(JobError::Panic(_)) => {
                    "the scene could not be built; try another seed"
                }
                OpenError::Job(JobError::Thread(_)) => "the server cannot open another world now",
            };
            Refusal::new(Code::Internal, message)
        })?;
        let own = ServerInfo::own();
        let row = NewRun {
            run_id: run_id.clone(),
            session_id: self.session_id.clone(),
            team: self.team.clone(),
            task: task.name.clone(),
            hand: hand.name.clone(),
            hand_sha256: None,
            mode: "lockstep",
            sensing: reset.sensing,
            seed_hex: seed.to_hex(),
            seed: Some(number),
            k: None,
            server_version: own.version,
            build_hash: own.build_hash,
        };
        self.host.store.begin_run(&row).await.map_err(|error| store_failed("the run", &error))?;
        let playing = Playing {
            run_id: run_id.clone(),
            task: task.name.clone(),
            hand: hand.name.clone(),
            tick_s: task.tick_s,
            tick: 0,
        };
        let run = Opened {
            task: task.name.clone(),
            hand: hand.name.clone(),
            mode: "lockstep".into(),
            sensing: reset.sensing,
            seed: Some(number),
            tick_s: task.tick_s,
            time_limit_s: task.time_limit_s,
        };
        self.world = Some(opened.world);
        self.machine.opened(playing, self.host.now());
        tracing::info!(
            session = self.session_id,
            run = run_id,
            task = row.task,
            hand = row.hand,
            "run opened"
        );
        Ok(Reply::Obs(Box::new(Obs {
            id,
            run_id,
            session_left_s: self.left_s(),
            observation: opened.observation,
            run: Some(run),
            scene: Some(opened.scene),
        })))
    }

    /// Who sees every tick of a run.
    fn onlookers(
        &self,
        run_id: &str,
        task: &Task,
        hand: &Hand,
        sensing: Sensing,
    ) -> impl FnOnce(&Run) -> Vec<Box<dyn Witness>> + Send + use<> {
        let hub = self.host.watch.clone();
        let info = WatchRun {
            run_id: run_id.to_owned(),
            session_id: self.session_id.clone(),
            team: self.team.clone(),
            task: task.name.clone(),
            hand: hand.name.clone(),
            official: false,
            tick_s: task.tick_s,
            time_limit_s: task.time_limit_s,
        };
        move |run| vec![Box::new(hub.publish(info, sensing, run))]
    }

    /// Advances the world.
    pub(crate) async fn step(&mut self, id: u64, step: Step) -> Result<Reply, Refusal> {
        self.close_if_over().await;
        let ticks = self.machine.may_step(self.host.now(), step.tick, step.repeat, REPEAT)?;
        let (Some(world), Some(run)) = (&mut self.world, self.machine.playing()) else {
            let message = "the run has ended, but its result is not stored yet; stop tries again";
            return Err(Refusal::new(Code::WrongState, message));
        };
        let run_id = run.run_id.clone();
        let (mut observation, over) = match world.step(&self.host.scheduler, false, &step.action, ticks).await
        {
            Ok(stepped) => (stepped.observation, stepped.over),
            Err(StepError::Action(error)) => return Err(Refusal::new(Code::BadAction, error.to_string())),
            Err(StepError::Fault) => {
                self.close_run(Reason::WorldFault, None).await;
                let message =
                    format!("the world of run {run_id} failed; the run is void, reset opens another");
                return Err(Refusal::new(Code::Internal, message));
            }
        };
        self.machine.stepped(observation.tick);
        if let Some(reason) = over {
            self.close_run(reason, None).await;
        } else if self.close_if_over().await {
            observation.truncated = true;
            observation.reason = Some("session_over".into());
        }
        let session_left_s = self.left_s();
        Ok(Reply::Obs(Box::new(Obs { id, run_id, session_left_s, observation, run: None, scene: None })))
    }

    /// Closes the run and tells its result, or tells the result of a run the server closed.
    pub(crate) async fn stop(&mut self, id: u64) -> Result<Reply, Refusal> {
        self.close_if_over().await;
        let mut result = match self.machine.stop()? {
            Stopping::Waiting(result) => result,
            Stopping::Open => {
                let result = Box::new(self.finish(Reason::Stopped, None).await?);
                self.machine.finished();
                result
            }
        };
        result.id = Some(id);
        result.session_left_s = self.left_s();
        Ok(Reply::Result(result))
    }

    /// When [`Session::expire`] has something to do, if the client does nothing until then.
    pub(crate) fn next_change(&self) -> Option<Duration> {
        self.machine.clock().next_change(self.host.now())
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

    /// Ends the session: an open run is finished for `reason`. Returns that run's result.
    pub(crate) async fn end(mut self: Box<Self>, reason: Reason, note: Option<&str>) -> Option<Reply> {
        let result = match self.machine.playing() {
            Some(_) => self.finish(reason, note).await.ok(),
            None => None,
        };
        if let Err(error) = self.host.store.end_session(&self.session_id).await {
            tracing::error!(%error, session = self.session_id, "the session's end could not be stored");
        }
        self.host.registry.remove(&self.resume_token);
        tracing::info!(session = self.session_id, "session ended");
        result.map(|result| Reply::Result(Box::new(result)))
    }

    async fn close_if_over(&mut self) -> bool {
        let over = self.machine.playing().is_some() && self.machine.clock().is_over(self.host.now());
        if over {
            self.close_run(Reason::SessionOver, None).await;
        }
        over
    }

    /// Finishes the open run; its result waits for `stop`. If it cannot be stored, `stop` tries again.
    async fn close_run(&mut self, reason: Reason, note: Option<&str>) {
        if let Ok(result) = self.finish(reason, note).await {
            self.machine.closed(result);
        }
    }

    /// Finishes the open run and stores its result before anybody hears of it.
    async fn finish(&mut self, reason: Reason, note: Option<&str>) -> Result<RunResult, Refusal> {
        if self.unstored.is_none() {
            let Some(run) = self.machine.playing().cloned() else {
                return Err(Refusal::new(Code::WrongState, "no run is open; send reset first"));
            };
            let outcome = match self.world.take() {
                // An unsound world has nothing to say.
                Some(world) if reason != Reason::WorldFault => {
                    world.finish(&self.host.background, reason).await
                }
                _ => None,
            };
            let finished = match outcome {
                Some(outcome) => Finished { run, outcome, status: "practice", note: note.map(str::to_owned) },
                None => {
                    tracing::error!(run = run.run_id, tick = run.tick, "world fault; run voided");
                    let note = Some("the world failed".to_owned());
                    Finished { outcome: fault(&run), run, status: "voided", note }
                }
            };
            self.unstored = Some(finished);
        }
        let Some(finished) = self.unstored.take() else {
            return Err(Refusal::new(Code::WrongState, "no run is open; send reset first"));
        };
        let row = FinishedRun {
            run_id: &finished.run.run_id,
            status: finished.status,
            outcome: &finished.outcome,
            note: finished.note.as_deref(),
            missed_ticks: 0,
        };
        if let Err(error) = self.host.store.finish_run(&row).await {
            self.unstored = Some(finished);
            return Err(store_failed("the result", &error));
        }
        self.host.watch.ranking_changed();
        let Finished { run, outcome, status, .. } = finished;
        tracing::info!(run = run.run_id, score = outcome.score, ticks = outcome.ticks, status, "run closed");
        Ok(RunResult::new(&run.run_id, &run.task, &run.hand, status, outcome))
    }
}

/// The outcome of a run whose world failed: nothing counts.
fn fault(run: &Playing) -> Outcome {
    Outcome {
        score: 0.0,
        in_goal: 0,
        outside: 0,
        reason: Reason::WorldFault,
        ticks: run.tick,
        sim_time_s: run.tick as f64 * run.tick_s,
        events: Vec::new(),
        state_hash: "0".repeat(16),
    }
}

fn names<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.collect::<Vec<_>>().join(", ")
}
