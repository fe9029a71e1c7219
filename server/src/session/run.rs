//! What a client asks of a session, and how a run is opened and played.

use super::failure::{random_hex, store_failed};
use super::machine::Playing;
use super::origin::{self, Origin};
use super::session::{OpenRun, Session};
use crate::archive::Recording;
use crate::compute::admission::Admitted;
use crate::compute::background::JobError;
use crate::config::settings::REPEAT;
use crate::store::{NewRun, unix_ms};
use crate::version;
use crate::watch::messages::WatchRun;
use crate::world::Witness;
use crate::world::live::{Live, Streamed};
use crate::world::pictures::{self, Pictures};
use crate::world::run::{OpenError, OpenedWorld, StepError, World, WorldSetup};
use palmares_models::hand::Hand;
use palmares_protocol::obs::{Obs, Opened};
use palmares_protocol::reply::Ack;
use palmares_protocol::text::shortened;
use palmares_protocol::{Act, Code, Mode, Perturb, Refusal, Reply, Request, Reset, Step};
use palmares_replay::{Header, Kind, Pacing};
use palmares_tasks::observation::{Observation, Wrench};
use palmares_tasks::overlap::{Obstacle, Overlap};
use palmares_tasks::run::{Shot, ShotError, shots};
use palmares_tasks::{Noise, Reason, SceneError, Sensing, Task};
use std::sync::Arc;
use std::time::Instant;

fn names<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.collect::<Vec<_>>().join(", ")
}

/// A run that is to be opened.
struct NewWorld {
    run_id: String,
    task: Arc<Task>,
    hand: Arc<Hand>,
    /// Of the archive of a hand that the team sent in.
    hand_sha256: Option<String>,
    origin: Origin,
    mode: Mode,
    sensing: Sensing,
    noise: Noise,
    /// Pictures of tick 0.
    shots: Vec<Shot>,
}

impl Session {
    /// Carries out a request. A run that the session's end has overtaken is closed first: here, and nowhere else as long
    /// as the client asks for something.
    ///
    /// # Errors
    /// Why it cannot be carried out.
    pub(crate) async fn answer(&mut self, id: u64, request: Request) -> Result<Reply, Refusal> {
        self.close_if_over().await;
        match request {
            Request::Reset(reset) => self.reset(id, reset).await,
            Request::Step(step) => self.step(id, step).await,
            Request::Act(act) => self.act(id, act),
            Request::Perturb(push) => self.perturb(id, push),
            Request::Stop(_) => self.stop(id).await,
            Request::Time(_) => Ok(self.time(id)),
            Request::Hello(_) => Err(Refusal::new(Code::WrongState, "hello was said already")),
            // Ends the connection before it gets here.
            Request::Bye(_) => Err(Refusal::new(Code::WrongState, "bye")),
        }
    }

    /// Whether the session's time is spent while a run is open.
    fn run_is_overdue(&self) -> bool {
        self.machine.playing().is_some() && self.machine.clock().is_over(self.now())
    }

    /// Closes the run if the session's time is spent.
    pub(super) async fn close_if_over(&mut self) {
        self.catch_up();
        if self.run_is_overdue() {
            self.close_run(Reason::SessionOver, None).await;
        }
    }

    /// Opens a run. When the server cannot, the attempt has cost no time.
    pub(super) async fn reset(&mut self, id: u64, reset: Reset) -> Result<Reply, Refusal> {
        let before = self.machine.clock().spent(self.now());
        let opened = self.open(id, reset).await;
        if opened.as_ref().is_err_and(|refusal| refusal.code == Code::Internal) {
            self.machine.forgive(before, self.now());
        }
        opened
    }

    async fn open(&mut self, id: u64, reset: Reset) -> Result<Reply, Refusal> {
        self.machine.may_reset(self.now())?;
        let (shared, team) = (self.shared.clone(), &self.team);
        let task = shared.competition.task(&reset.task).ok_or_else(|| {
            let known = names(shared.competition.tasks.iter().map(|task| task.name.as_str()));
            let message = format!("no task `{}`; there are: {known}", shortened(&reset.task));
            Refusal::new(Code::UnknownTask, message)
        })?;
        if self.official && reset.seed.is_some() {
            let message = "seed: official runs have hidden seeds; leave it out";
            return Err(Refusal::new(Code::BadRequest, message));
        }
        let noise = self.shared.competition.sensing.noise(reset.noise)?;
        self.shared.competition.sensing.may_see(&task.name, reset.sensing)?;
        let (hand, hand_sha256) = origin::hand(&shared, team, &reset.hand).await?;
        let shots = shots(task, &hand, &reset.cameras, reset.sensing).map_err(bad_camera)?;
        let admitted = shared.compute.admit(reset.mode, self.official)?;
        let run_id = format!("run_{}", random_hex(8)?);
        let origin = origin::origin(&shared, team, task, reset.seed).await?;
        let (k, task) = (origin.k, task.clone());
        let (mode, sensing) = (reset.mode, reset.sensing);
        let task_of = task.clone();
        let new = NewWorld { run_id, task: task_of, hand, hand_sha256, origin, mode, sensing, noise, shots };
        match self.build(&new, admitted).await {
            Ok((opened, recording)) => Ok(self.begin(id, new, opened, recording).await),
            // Nothing of the scene was told: the number is the next run's.
            Err(refusal) if matches!(refusal.code, Code::HandInTheWay | Code::Internal) => {
                match origin::give_back_number(&shared, &self.team, &task, k).await {
                    Err(failed) if refusal.code == Code::HandInTheWay => Err(failed),
                    _ => Err(refusal),
                }
            }
            Err(refusal) => Err(refusal),
        }
    }

    /// Builds the world of a run and stores that it begins.
    async fn build(
        &mut self,
        new: &NewWorld,
        admitted: Admitted,
    ) -> Result<(OpenedWorld, Option<Recording>), Refusal> {
        let NewWorld { task, hand, origin, .. } = new;
        origin::provide(&self.shared, hand, new.hand_sha256.as_deref())?;
        let hub = &self.shared.hub;
        let mut witnesses: Vec<Box<dyn Witness>> =
            vec![Box::new(hub.publisher(self.shown(new), new.sensing, new.hand_sha256.is_some()))];
        let recorded = self.shared.archive.as_ref().map(|archive| archive.record(self.header(new)));
        let recording = recorded.map(|(scribe, recording)| {
            witnesses.push(Box::new(scribe));
            recording
        });
        let (task, seed) = (task.clone(), origin.seed);
        let (sensing, noise) = (new.sensing, new.noise);
        let shots = new.shots.clone();
        let setup = WorldSetup { task, hand: hand.clone(), seed, sensing, noise, shots };
        let opened = World::open(setup, admitted, &self.shared.compute.background, witnesses).await;
        let opened = opened.map_err(|error| self.not_opened(new, error))?;
        self.store_opened(new).await?;
        Ok((opened, recording))
    }

    /// What spectators are told of a run.
    fn shown(&self, new: &NewWorld) -> WatchRun {
        WatchRun {
            run_id: new.run_id.clone(),
            session_id: self.session_id.clone(),
            team: self.team.clone(),
            task: new.task.name.clone(),
            hand: new.hand.name.clone(),
            official: self.official,
            tick_s: new.task.tick_s,
            time_limit_s: new.task.time_limit_s,
        }
    }

    /// What a replay says of its run.
    fn header(&self, new: &NewWorld) -> Header {
        let now = unix_ms().unsigned_abs();
        Header {
            kind: if self.official { Kind::Official } else { Kind::Practice },
            pacing: match new.mode {
                Mode::Lockstep => Pacing::Lockstep,
                Mode::Realtime => Pacing::Realtime,
            },
            sensing: new.sensing,
            noise: new.noise,
            seed_number: new.origin.number,
            k: new.origin.k,
            build_hash: version::BUILD_HASH.into(),
            ..Header::new(&new.run_id, &self.team, &new.task, &new.hand, new.origin.seed, now)
        }
    }

    /// Why a world could not be opened.
    fn not_opened(&self, new: &NewWorld, error: OpenError) -> Refusal {
        let NewWorld { task, hand, origin: Origin { number, k, .. }, .. } = new;
        let error = match error {
            OpenError::Scene(SceneError::HandInTheWay { overlaps, .. }) => {
                let hides = self.official && new.sensing == Sensing::Sensors;
                return in_the_way(task, hand, &overlaps, hides);
            }
            error => error,
        };
        tracing::error!(%error, task = task.name, hand = hand.name, number, k, "no world");
        let (code, message) = match error {
            // Not the server's fault, so that the time is not given back.
            OpenError::Scene(_) | OpenError::Job(JobError::Panic(_)) if new.hand_sha256.is_some() => {
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
    }

    async fn store_opened(&mut self, new: &NewWorld) -> Result<(), Refusal> {
        let own = version::own();
        let row = NewRun {
            run_id: new.run_id.clone(),
            session_id: self.session_id.clone(),
            team: self.team.clone(),
            task: new.task.name.clone(),
            hand: new.hand.name.clone(),
            hand_sha256: new.hand_sha256.clone(),
            mode: new.mode.as_str(),
            sensing: new.sensing,
            seed_hex: new.origin.seed.to_hex(),
            seed: new.origin.number,
            k: new.origin.k,
            server_version: own.version,
            build_hash: own.build_hash,
        };
        self.shared.store.begin_run(&row).await.map_err(store_failed("the run"))
    }

    /// The run begins: its clock runs, and a realtime world ticks.
    async fn begin(
        &mut self,
        id: u64,
        new: NewWorld,
        opened: OpenedWorld,
        recording: Option<Recording>,
    ) -> Reply {
        let NewWorld { run_id, task, hand, .. } = new;
        let playing = Playing {
            run_id: run_id.clone(),
            task: task.name.clone(),
            task_hash: task.content_hash().to_owned(),
            hand: hand.name.clone(),
            hand_sha256: new.hand_sha256,
            seed: new.origin.number,
            k: new.origin.k,
            tick_s: task.tick_s,
            mode: new.mode,
            tick: 0,
        };
        let run = Opened {
            task: task.name.clone(),
            hand: hand.name.clone(),
            mode: new.mode,
            sensing: new.sensing,
            noise: new.noise,
            seed: new.origin.number,
            tick_s: task.tick_s,
            time_limit_s: task.time_limit_s,
        };
        self.recording = recording;
        self.machine.opened(playing, self.now());
        self.save(true).await;
        self.stream = None;
        tracing::info!(
            session = self.session_id,
            run = run_id,
            task = task.name,
            hand = hand.name,
            mode = new.mode.as_str(),
            "run opened"
        );
        self.open_run = match new.mode {
            Mode::Lockstep => OpenRun::Lockstep(Box::new(opened.world)),
            Mode::Realtime => {
                let live = Live::start(opened.world, hand, task.tick_s, self.official, &self.shared.compute);
                self.stream = Some(live.clone());
                OpenRun::Realtime(live)
            }
        };
        let (run, scene) = (Some(run), Some(opened.scene));
        Reply::Obs(Box::new(Obs { run, scene, ..self.obs(Some(id), run_id, opened.observation) }))
    }

    /// An observation as it is told.
    fn obs(&self, id: Option<u64>, run_id: String, observation: Observation) -> Obs {
        let session_left_s = self.left_s();
        Obs { id, run_id, session_left_s, observation, late_s: None, run: None, scene: None }
    }

    /// Advances the world.
    pub(super) async fn step(&mut self, id: u64, step: Step) -> Result<Reply, Refusal> {
        let ticks = self.machine.may_step(self.now(), step.tick, step.repeat, REPEAT)?;
        let (OpenRun::Lockstep(world), Some(run)) = (&mut self.open_run, self.machine.playing()) else {
            return Err(ended());
        };
        let run_id = run.run_id.clone();
        let shots = world.shots(&step.cameras).map_err(bad_camera)?;
        let scheduler = &self.shared.compute.scheduler;
        let stepped = match world.step(scheduler, self.official, &step.action, ticks).await {
            Ok(stepped) => stepped,
            Err(StepError::Action(error)) => return Err(Refusal::new(Code::BadAction, error.to_string())),
            Err(StepError::Failed(failure)) => {
                self.close_run(Reason::WorldFault, None).await;
                let message = format!("{failure}. Run {run_id} is void; reset opens another");
                return Err(Refusal::new(Code::Internal, message).by(failure.fault));
            }
        };
        let mut observation = stepped.observation;
        let Pictures { wanted, upcoming } = world.expose(&shots);
        self.upcoming = upcoming;
        self.machine.stepped(observation.tick, self.now());
        if let Some(reason) = stepped.over {
            self.close_run(reason, None).await;
        } else if self.run_is_overdue() {
            self.close_run(Reason::SessionOver, None).await;
            observation.truncated = true;
            observation.reason = Some(Reason::SessionOver.as_str().into());
        }
        observation.cameras = pictures::render(&self.shared.compute, wanted).await;
        self.save(false).await;
        Ok(Reply::Obs(Box::new(self.obs(Some(id), run_id, observation))))
    }

    /// While the controller of a lockstep run thinks: its witnesses see what it has been told, and on a free core what can
    /// be known of the next tick is computed, and the pictures that it will ask for are drawn.
    pub(crate) fn answered(&mut self) {
        if let OpenRun::Lockstep(world) = &mut self.open_run {
            world.tell();
            if let Some(permit) = self.shared.compute.scheduler.spare() {
                world.prepare(&permit);
            }
        }
        pictures::prepare(&self.shared.compute, std::mem::take(&mut self.upcoming));
    }

    /// Tells a realtime world what to do next.
    pub(super) fn act(&mut self, id: u64, act: Act) -> Result<Reply, Refusal> {
        self.machine.may_act(self.now())?;
        let OpenRun::Realtime(live) = &self.open_run else { return Err(ended()) };
        let shots = live.shots(&act.cameras).map_err(bad_camera)?;
        let taken = live.act(act.action, shots);
        let tick = taken.map_err(|error| Refusal::new(Code::BadAction, error.to_string()))?;
        Ok(Reply::Ack(Ack { id, tick }))
    }

    /// Pushes the hand.
    pub(super) fn perturb(&mut self, id: u64, push: Perturb) -> Result<Reply, Refusal> {
        if self.official {
            let message = "perturb is for practice: nobody pushes the hand in a competition";
            return Err(Refusal::new(Code::WrongState, message));
        }
        self.machine.may_perturb(self.now())?;
        self.catch_up();
        let wrench = Wrench { force: push.wrench.force, torque: push.wrench.torque };
        let work =
            |world: &mut World| world.push(&push.link, wrench, push.duration_s).map(|()| world.next_tick());
        let pushed = match &mut self.open_run {
            OpenRun::None => return Err(ended()),
            OpenRun::Lockstep(world) => work(world),
            OpenRun::Realtime(live) => live.with_world(work).ok_or_else(ended)?,
        };
        let tick = pushed.map_err(|error| Refusal::new(Code::BadRequest, error.to_string()))?;
        Ok(Reply::Ack(Ack { id, tick }))
    }

    /// The next observation to stream.
    pub(crate) async fn streamed(&mut self) -> Option<Reply> {
        let Streamed { mut observation, pictures: Pictures { wanted, upcoming }, due } =
            self.stream.as_ref()?.pop()?;
        observation.cameras = pictures::render(&self.shared.compute, wanted).await;
        pictures::prepare(&self.shared.compute, upcoming);
        self.catch_up();
        let run_id = self.machine.run_info().map(|run| run.run_id)?;
        let late_s = Some(Instant::now().saturating_duration_since(due).as_secs_f64());
        Some(Reply::Obs(Box::new(Obs { late_s, ..self.obs(None, run_id, observation) })))
    }

    /// Closes a realtime run that is over by itself.
    pub(crate) async fn close_if_played_out(&mut self) {
        if let OpenRun::Realtime(live) = &self.open_run
            && let Some(reason) = live.over()
        {
            self.close_run(reason, None).await;
        }
        self.save(false).await;
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

fn bad_camera(error: ShotError) -> Refusal {
    Refusal::new(Code::UnknownCamera, format!("cameras: {error}"))
}

fn ended() -> Refusal {
    let message = "the run has ended, but its result is not stored yet; stop tries again";
    Refusal::new(Code::WrongState, message)
}

#[cfg(test)]
mod tests {
    use super::*;
    use palmares_models::builtin::builtin_hands;

    #[test]
    fn a_hand_in_the_way_is_told_where_but_on_sensors_not_where_the_objects_are() {
        let (task, hand) = (Task::builtin()[0].clone(), builtin_hands()[0].clone());
        let touches = |obstacle, name: &str| Overlap { link: "palm".into(), obstacle, name: name.into() };
        let both = [touches(Obstacle::Object, "ball_3"), touches(Obstacle::Furniture, "table")];
        let told = |overlaps: &[Overlap], hides| {
            let refusal = in_the_way(&task, &hand, overlaps, hides);
            assert_eq!(refusal.code, Code::HandInTheWay);
            refusal.message
        };
        assert!(told(&both, false).ends_with("link `palm` touches `ball_3`, link `palm` touches `table`"));
        assert!(told(&both, true).ends_with(": link `palm` touches `table`"));
        assert!(told(&both[..1], true).ends_with(": it touches an object"));
        let many = [both.clone(), both].concat();
        assert_eq!(told(&many, false).matches("touches").count(), 3, "not all of them");
    }
}
