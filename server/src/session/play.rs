//! How a run is opened and played.

use super::driver::{Session, Stage, random_hex, store_failed};
use super::host::REPEAT;
use super::machine::Playing;
use super::official::{self, Origin};
use crate::compute::background::JobError;
use crate::protocol::obs::Obs;
use crate::protocol::obs::Opened;
use crate::protocol::reply::{Ack, ServerInfo};
use crate::protocol::request::shortened;
use crate::protocol::{Act, Code, Mode, Perturb, Refusal, Reply, Reset, Step};
use crate::store::NewRun;
use crate::watch::messages::WatchRun;
use crate::world::Witness;
use crate::world::live::{Live, Streamed};
use crate::world::run::{OpenError, Plan, StepError, World};
use palmares_models::hand::Hand;
use palmares_tasks::observation::Wrench;
use palmares_tasks::overlap::{Obstacle, Overlap};
use palmares_tasks::{Reason, Run, SceneError, Sensing, Task};
use std::sync::Arc;
use std::time::Instant;

fn names<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.collect::<Vec<_>>().join(", ")
}

impl Session {
    /// Opens a run. When the server cannot, the attempt has cost no time.
    pub(crate) async fn reset(&mut self, id: u64, reset: Reset) -> Result<Reply, Refusal> {
        let before = self.machine.clock().spent(self.host.now());
        let opened = self.open(id, reset).await;
        if opened.as_ref().is_err_and(|refusal| refusal.code == Code::Internal) {
            self.machine.forgive(before, self.host.now());
        }
        opened
    }

    async fn open(&mut self, id: u64, reset: Reset) -> Result<Reply, Refusal> {
        self.machine.may_reset(self.host.now())?;
        let task = self.host.task(&reset.task).ok_or_else(|| {
            let known = names(self.host.tasks.iter().map(|task| task.name.as_str()));
            let message = format!("no task `{}`; there are: {known}", shortened(&reset.task));
            Refusal::new(Code::UnknownTask, message)
        })?;
        if self.official && reset.seed.is_some() {
            let message = "seed: official runs have hidden seeds; leave it out";
            return Err(Refusal::new(Code::BadRequest, message));
        }
        let (hand, hand_sha256) = official::hand(&self.host, &self.team, &reset.hand).await?;
        let place = self.host.compute.admit(reset.mode, self.official)?;
        let run_id = format!("run_{}", random_hex(8)?);
        let origin = official::origin(&self.host, &self.team, task, reset.seed).await?;
        let Origin { seed, number, k } = origin;
        official::provide(&self.host, &hand, hand_sha256.as_deref())?;
        let (begin, recording) = self.record(&run_id, task, &hand, &origin, &reset);
        let plan = Plan { task: task.clone(), hand: hand.clone(), seed, sensing: reset.sensing };
        let onlookers = self.onlookers(&run_id, task, &hand, reset.sensing);
        let witnesses = move |run: &Run| {
            let mut witnesses = onlookers(run);
            witnesses.extend(begin.map(|begin| begin(run)));
            witnesses
        };
        let opened = World::open(plan, place, &self.host.compute.background, witnesses).await;
        if let Err(OpenError::Scene(SceneError::HandInTheWay { overlaps, .. })) = &opened {
            // The number was not used: the same scene comes next, with a hand that fits.
            official::give_back_number(&self.host, &self.team, task, k).await?;
            let hides = self.official && reset.sensing == Sensing::Sensors;
            return Err(in_the_way(task, &hand, overlaps, hides));
        }
        let own_hand = hand_sha256.is_some();
        let opened = opened.map_err(|error| {
            tracing::error!(%error, task = task.name, hand = hand.name, number, k, "no world");
            let (code, message) = match error {
                // Not the server's fault, so that the time is not given back.
                OpenError::Scene(_) | OpenError::Job(JobError::Panic(_)) if own_hand => {
                    (Code::BadRequest, "the scene could not be built with this hand")
                }
                OpenError::Scene(_) | OpenError::Job(JobError::Panic(_)) => {
                    (Code::Internal, "the scene could not be built; try another seed")
                }
                OpenError::Job(JobError::Thread(_)) => {
                    (Code::Internal, "the server cannot open another world now")
                }
            };
            Refusal::new(code, message)
        })?;
        let own = ServerInfo::own();
        let row = NewRun {
            run_id: run_id.clone(),
            session_id: self.session_id.clone(),
            team: self.team.clone(),
            task: task.name.clone(),
            hand: hand.name.clone(),
            hand_sha256,
            mode: reset.mode.as_str(),
            sensing: reset.sensing,
            seed_hex: seed.to_hex(),
            seed: number,
            k,
            server_version: own.version,
            build_hash: own.build_hash,
        };
        self.host.store.begin_run(&row).await.map_err(|error| store_failed("the run", &error))?;
        let playing = Playing {
            run_id: run_id.clone(),
            task: task.name.clone(),
            hand: hand.name.clone(),
            own_hand,
            tick_s: task.tick_s,
            mode: reset.mode,
            tick: 0,
        };
        let run = Opened {
            task: task.name.clone(),
            hand: hand.name.clone(),
            mode: reset.mode,
            sensing: reset.sensing,
            seed: number,
            tick_s: task.tick_s,
            time_limit_s: task.time_limit_s,
        };
        let (hand, tick_s) = (hand.clone(), task.tick_s);
        self.recording = recording;
        self.machine.opened(playing, self.host.now());
        self.save(true).await;
        self.stream = None;
        self.stage = match reset.mode {
            Mode::Lockstep => Stage::Lockstep(Box::new(opened.world)),
            Mode::Realtime => {
                let compute = &self.host.compute;
                let live = Live::start(
                    opened.world,
                    hand,
                    tick_s,
                    self.official,
                    &compute.scheduler,
                    &compute.pacer,
                );
                self.stream = Some(live.clone());
                Stage::Realtime(live)
            }
        };
        tracing::info!(
            session = self.session_id,
            run = run_id,
            task = row.task,
            hand = row.hand,
            mode = row.mode,
            "run opened"
        );
        Ok(Reply::Obs(Box::new(Obs {
            id: Some(id),
            run_id,
            session_left_s: self.left_s(),
            observation: opened.observation,
            late_s: None,
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
            official: self.official,
            tick_s: task.tick_s,
            time_limit_s: task.time_limit_s,
        };
        move |run| vec![Box::new(hub.publish(info, sensing, run))]
    }

    /// Advances the world.
    pub(crate) async fn step(&mut self, id: u64, step: Step) -> Result<Reply, Refusal> {
        self.close_if_over().await;
        let ticks = self.machine.may_step(self.host.now(), step.tick, step.repeat, REPEAT)?;
        let (Stage::Lockstep(world), Some(run)) = (&mut self.stage, self.machine.playing()) else {
            return Err(ended());
        };
        let run_id = run.run_id.clone();
        let stepped = match world.step(&self.host.compute.scheduler, self.official, &step.action, ticks).await
        {
            Ok(stepped) => stepped,
            Err(StepError::Action(error)) => return Err(Refusal::new(Code::BadAction, error.to_string())),
            Err(StepError::Fault(_)) => {
                self.close_run(Reason::WorldFault, None).await;
                let message =
                    format!("the world of run {run_id} failed; the run is void, reset opens another");
                return Err(Refusal::new(Code::Internal, message));
            }
        };
        let mut observation = stepped.observation;
        self.machine.stepped(observation.tick, self.host.now());
        if let Some(reason) = stepped.over {
            self.close_run(reason, None).await;
        } else if self.close_if_over().await {
            observation.truncated = true;
            observation.reason = Some(Reason::SessionOver.as_str().into());
        }
        self.save(false).await;
        let session_left_s = self.left_s();
        let obs =
            Obs { id: Some(id), run_id, session_left_s, observation, late_s: None, run: None, scene: None };
        Ok(Reply::Obs(Box::new(obs)))
    }

    /// While the controller of a lockstep run thinks: its witnesses see what it has been told, and on a free core what can
    /// be known of the next tick is computed.
    pub(crate) fn answered(&mut self) {
        if let Stage::Lockstep(world) = &mut self.stage {
            world.tell();
            if let Some(permit) = self.host.compute.scheduler.spare() {
                world.prepare(&permit);
            }
        }
    }

    /// Tells a realtime world what to do next.
    pub(crate) async fn act(&mut self, id: u64, act: Act) -> Result<Reply, Refusal> {
        self.close_if_over().await;
        self.machine.may_act(self.host.now())?;
        let Stage::Realtime(live) = &self.stage else { return Err(ended()) };
        let taken = live.act(act.action);
        let tick = taken.map_err(|error| Refusal::new(Code::BadAction, error.to_string()))?;
        Ok(Reply::Ack(Ack { id, tick }))
    }

    /// Pushes the hand.
    pub(crate) async fn perturb(&mut self, id: u64, push: Perturb) -> Result<Reply, Refusal> {
        if self.official {
            let message = "perturb is for practice: nobody pushes the hand in a competition";
            return Err(Refusal::new(Code::WrongState, message));
        }
        self.close_if_over().await;
        self.machine.may_perturb(self.host.now())?;
        self.catch_up();
        let wrench = Wrench { force: push.wrench.force, torque: push.wrench.torque };
        let work =
            |world: &mut World| world.push(&push.link, wrench, push.duration_s).map(|()| world.next_tick());
        let pushed = match &mut self.stage {
            Stage::Empty => return Err(ended()),
            Stage::Lockstep(world) => work(world),
            Stage::Realtime(live) => live.with_world(work).ok_or_else(ended)?,
        };
        let tick = pushed.map_err(|error| Refusal::new(Code::BadRequest, error.to_string()))?;
        Ok(Reply::Ack(Ack { id, tick }))
    }

    /// The realtime world whose news the client is to get.
    pub(crate) fn stream(&self) -> Option<&Arc<Live>> {
        self.stream.as_ref()
    }

    /// The next observation to stream.
    pub(crate) fn streamed(&mut self) -> Option<Reply> {
        let Streamed { observation, due } = self.stream.as_ref()?.pop()?;
        self.catch_up();
        let run_id = self.machine.run_info().map(|run| run.run_id)?;
        let late_s = Instant::now().saturating_duration_since(due).as_secs_f64();
        let (session_left_s, late_s) = (self.left_s(), Some(late_s));
        let obs = Obs { id: None, run_id, session_left_s, observation, late_s, run: None, scene: None };
        Some(Reply::Obs(Box::new(obs)))
    }

    /// Closes a realtime run that is over by itself.
    pub(crate) async fn close_if_played_out(&mut self) {
        if let Stage::Realtime(live) = &self.stage
            && let Some(reason) = live.over()
        {
            self.close_run(reason, None).await;
        }
        self.save(false).await;
    }

    /// Brings the machine up to the tick of a realtime world.
    pub(super) fn catch_up(&mut self) {
        if let Stage::Realtime(live) = &self.stage {
            self.machine.stepped(live.tick_now(), self.host.now());
        }
    }
}

/// A hand that does not fit where it starts. `hides`: which part touches an object would tell where that is.
fn in_the_way(task: &Task, hand: &Hand, overlaps: &[Overlap], hides: bool) -> Refusal {
    let named = overlaps.iter().filter(|overlap| !hides || overlap.obstacle != Obstacle::Object);
    let mut told: Vec<String> = named.take(3).map(Overlap::to_string).collect();
    if told.is_empty() {
        told.push("it touches an object".to_owned());
    }
    let (hand, task, told) = (&hand.name, &task.name, told.join(", "));
    let message = format!("hand `{hand}` is in the way where it starts in task `{task}`: {told}");
    Refusal::new(Code::HandInTheWay, message)
}

fn ended() -> Refusal {
    let message = "the run has ended, but its result is not stored yet; stop tries again";
    Refusal::new(Code::WrongState, message)
}
