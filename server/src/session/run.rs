//! Requests of a client to its session: opening and playing a run.

use super::after_run::AfterRun;
use super::failure::{random_hex, store_failed};
use super::machine::Playing;
use super::open_run::{LockstepRun, OpenRun, PlayedWorld, Stage, Stream};
use super::run_inputs::{self, RunKey};
use super::session::Session;
use crate::archive::Recording;
use crate::watch::messages::WatchRun;
use palmares_models::hand::Hand;
use palmares_net::config::settings::MAX_REPEAT;
use palmares_net::process::version;
use palmares_protocol::obs::{Obs, Opened};
use palmares_protocol::reply::Ack;
use palmares_protocol::text::shortened;
use palmares_protocol::{Act, Code, Mode, Perturb, Refusal, Reply, Request, Reset, Step};
use palmares_replay::{CompetitionMode, Header, Pacing};
use palmares_store::{NewRun, unix_ms};
use palmares_tasks::observation::{Observation, Wrench};
use palmares_tasks::overlap::{Obstacle, Overlap};
use palmares_tasks::run::{Shot, ShotError, shots};
use palmares_tasks::{Noise, Reason, SceneError, Sensing, Task};
use palmares_worlds::compute::admission::Admitted;
use palmares_worlds::compute::background::JobError;
use palmares_worlds::compute::open_worlds::WorldRequest;
use palmares_worlds::compute::queue::WAIT;
use palmares_worlds::world::RunObserver;
use palmares_worlds::world::backlog::Gate;
use palmares_worlds::world::images::{self, StepImages};
use palmares_worlds::world::realtime::{RealtimeWorld, StreamedObservation};
use palmares_worlds::world::run::{Missing, OpenError, OpenedWorld, StepError, World, WorldSetup};
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
    /// SHA-256 of the hand's archive, if the team uploaded it.
    hand_sha256: Option<String>,
    key: RunKey,
    mode: Mode,
    sensing: Sensing,
    noise: Noise,
    /// The ranges from which the seed draws numbers of the hand, as their hash.
    hand_drawn: Option<String>,
    /// Camera images of tick 0.
    shots: Vec<Shot>,
}

/// A world that was built for a run that is stored as open.
struct Built {
    opened: OpenedWorld,
    recording: Option<Recording>,
    gate: Option<Gate>,
}

impl Session {
    /// Carries out a request. First it closes an open run whose session is over.
    ///
    /// # Errors
    /// Reason why the request is refused.
    pub(crate) async fn answer(&mut self, id: u64, request: Request) -> Result<Reply, Refusal> {
        if let Some(answer) = self.answered.again(id, &request) {
            return answer;
        }
        self.close_if_over().await;
        let answer = self.carry_out(id, request.clone()).await;
        self.answered.carried_out(id, request, &answer);
        answer
    }

    /// Keeps a reply that was sent, for a client that has not received it.
    pub(crate) fn keep(&mut self, reply: Reply) {
        self.answered.keep(reply);
    }

    async fn carry_out(&mut self, id: u64, request: Request) -> Result<Reply, Refusal> {
        match request {
            Request::Reset(reset) => self.reset(id, reset).await,
            Request::Step(step) => self.step(id, step).await,
            Request::Act(act) => self.act(id, act),
            Request::Perturb(push) => self.perturb(id, push),
            Request::Stop(_) => self.stop(id).await,
            Request::Time(_) => Ok(self.time(id)),
            Request::Hello(_) => Err(Refusal::new(Code::WrongState, "one hello per connection")),
            // The connection handles it.
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

    /// Opens a run. A failure of the server costs the session no time.
    pub(super) async fn reset(&mut self, id: u64, reset: Reset) -> Result<Reply, Refusal> {
        let before = self.machine.clock().spent(self.now());
        let opened = self.open(id, reset).await;
        if opened.as_ref().is_err_and(|refusal| refusal.code == Code::Internal) {
            self.machine.refund_since(before, self.now());
            self.show_clock();
        }
        opened
    }

    async fn open(&mut self, id: u64, reset: Reset) -> Result<Reply, Refusal> {
        self.machine.may_reset(self.now())?;
        let length_s = self.length_in_slot().await?;
        let (shared, team) = (self.shared.clone(), self.team.clone());
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
        self.shared.competition.sensing.check_sensing(&task.name, reset.sensing)?;
        let (hand, hand_sha256) = run_inputs::hand(&shared, &team, &reset.hand).await?;
        let hand_drawn = shared.competition.ranges(&hand)?;
        let shots = shots(task, &hand, &reset.cameras, reset.sensing).map_err(bad_camera)?;
        let admitted = match (self.place(reset.mode), length_s) {
            (Err(refusal), Some(length_s)) => {
                self.wait_in_slot(length_s).await?;
                return Err(refusal);
            }
            (admitted, _) => admitted?,
        };
        let run_id = format!("run_{}", random_hex(8)?);
        let key = self.stored(run_inputs::run_key(&shared, &team, task, reset.seed)).await?;
        let (k, task) = (key.k, task.clone());
        let (mode, sensing) = (reset.mode, reset.sensing);
        let task_of = task.clone();
        let new = NewWorld {
            run_id,
            task: task_of,
            hand,
            hand_sha256,
            key,
            mode,
            sensing,
            noise,
            hand_drawn,
            shots,
        };
        let built = self.build(&new, admitted, length_s).await;
        if built.is_err() {
            self.forget_ticks(&new.run_id, AfterRun::Leave);
        }
        match built {
            Ok(built) => Ok(self.begin(id, new, built).await),
            // The scene was not shown: the next run gets the number.
            Err(refusal) if matches!(refusal.code, Code::HandInTheWay | Code::Internal) => {
                match run_inputs::give_back_number(&shared, &team, &task, k).await {
                    Err(failed) if refusal.code == Code::HandInTheWay => Err(failed),
                    _ => Err(refusal),
                }
            }
            Err(refusal) => Err(refusal),
        }
    }

    /// Takes a place for a world. The clock is stopped while the session waits for one.
    fn place(&mut self, mode: Mode) -> Result<Admitted, Refusal> {
        let request = WorldRequest { session_id: &self.held.session_id, mode, official: self.official };
        let admitted = self.shared.compute.admit(request);
        let now = self.now();
        self.machine.hold(if admitted.is_ok() { now } else { now + WAIT }, now);
        self.show_clock();
        admitted
    }

    /// Builds the world of a run and stores the run as open, with the session's length if that changes.
    async fn build(
        &mut self,
        new: &NewWorld,
        admitted: Admitted,
        length_s: Option<f64>,
    ) -> Result<Built, Refusal> {
        let NewWorld { task, hand, key, .. } = new;
        run_inputs::provide(&self.shared, hand, new.hand_sha256.as_deref()).await?;
        let hub = &self.shared.hub;
        let mut observers: Vec<Box<dyn RunObserver>> =
            vec![Box::new(hub.publisher(self.watch_run(new), new.sensing, new.hand_sha256.is_some()))];
        let header = self.header(new);
        let drawn = header.hand_of_run(hand.clone()).map_err(|error| {
            tracing::error!(%error, hand = hand.name, "a hand could not be drawn");
            Refusal::new(Code::Internal, "server fault: the hand could not be drawn")
        })?;
        let shipper = self.shared.shipper.as_ref().filter(|_| self.official);
        let shipped = shipper.map(|shipper| shipper.follow(&new.run_id, &self.held));
        let stored_header = shipped.as_ref().map(|_| header.to_json());
        let gate = shipped.map(|(observer, gate)| {
            observers.push(Box::new(observer));
            gate
        });
        let recorded = self.shared.archive.as_ref().map(|archive| archive.record(header));
        let recording = recorded.map(|(recorder, recording)| {
            observers.push(Box::new(recorder));
            recording
        });
        let (task, seed) = (task.clone(), key.seed);
        let (sensing, noise) = (new.sensing, new.noise);
        let shots = new.shots.clone();
        let setup = WorldSetup { task, hand: drawn, seed, sensing, noise, shots };
        let opened = World::open(setup, admitted, &self.shared.compute.background, observers).await;
        let opened = opened.map_err(|error| self.not_opened(new, error))?;
        if let Some(length_s) = length_s {
            self.shorten(length_s).await?;
        }
        self.store_opened(new, stored_header).await?;
        Ok(Built { opened, recording, gate })
    }

    /// The run for spectators.
    fn watch_run(&self, new: &NewWorld) -> WatchRun {
        WatchRun {
            run_id: new.run_id.clone(),
            session_id: self.held.session_id.clone(),
            team: self.team.clone(),
            task: new.task.name.clone(),
            hand: new.hand.name.clone(),
            official: self.official,
            tick_s: new.task.tick_s,
            time_limit_s: new.task.time_limit_s,
        }
    }

    /// The header of the run's replay.
    fn header(&self, new: &NewWorld) -> Header {
        let now = unix_ms().unsigned_abs();
        Header {
            mode: if self.official { CompetitionMode::Official } else { CompetitionMode::Practice },
            pacing: match new.mode {
                Mode::Lockstep => Pacing::Lockstep,
                Mode::Realtime => Pacing::Realtime,
            },
            sensing: new.sensing,
            noise: new.noise,
            hand_drawn: new.hand_drawn.clone(),
            seed_number: new.key.number,
            k: new.key.k,
            build_hash: version::own().build_hash,
            ..Header::new(&new.run_id, &self.team, &new.task, &new.hand, new.key.seed, now)
        }
    }

    /// The refusal for a world that could not be opened.
    fn not_opened(&self, new: &NewWorld, error: OpenError) -> Refusal {
        let NewWorld { task, hand, key: RunKey { number, k, .. }, .. } = new;
        let error = match error {
            OpenError::Scene(SceneError::HandInTheWay { overlaps, .. }) => {
                let hides = self.official && new.sensing == Sensing::Sensors;
                return in_the_way(task, hand, &overlaps, hides);
            }
            error => error,
        };
        tracing::error!(%error, task = task.name, hand = hand.name, number, k, "a world could not be opened");
        let (code, message) = match error {
            // The team's fault, so that the time is not given back.
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

    async fn store_opened(&mut self, new: &NewWorld, header: Option<String>) -> Result<(), Refusal> {
        let own = version::own();
        let row = NewRun {
            run_id: new.run_id.clone(),
            team: self.team.clone(),
            task: new.task.name.clone(),
            hand: new.hand.name.clone(),
            hand_sha256: new.hand_sha256.clone(),
            mode: new.mode.as_str(),
            sensing: new.sensing,
            seed_hex: new.key.seed.to_hex(),
            seed: new.key.number,
            k: new.key.k,
            server_version: own.version,
            build_hash: own.build_hash,
            header,
        };
        let (shared, held) = (self.shared.clone(), self.held.clone());
        self.stored(shared.store.begin_run(&held, &row)).await.map_err(store_failed("the run"))?;
        if new.sensing == Sensing::Truth {
            // The team no longer uses sensors only.
            self.shared.hub.ranking_changed();
        }
        Ok(())
    }

    /// Starts the run's clock, and a realtime world.
    async fn begin(&mut self, id: u64, new: NewWorld, built: Built) -> Reply {
        let Built { opened, recording, gate } = built;
        let NewWorld { run_id, task, hand, .. } = new;
        let playing = Playing {
            run_id: run_id.clone(),
            task: task.name.clone(),
            task_hash: task.content_hash().to_owned(),
            hand: hand.name.clone(),
            hand_sha256: new.hand_sha256,
            seed: new.key.number,
            k: new.key.k,
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
            seed: new.key.number,
            tick_s: task.tick_s,
            time_limit_s: task.time_limit_s,
        };
        self.machine.opened(playing, self.now());
        self.save(true).await;
        tracing::info!(
            session = self.held.session_id,
            run = run_id,
            task = task.name,
            hand = hand.name,
            mode = new.mode.as_str(),
            "run opened"
        );
        self.stream = None;
        let world = match new.mode {
            Mode::Lockstep => PlayedWorld::Lockstep(LockstepRun::new(opened.world, false)),
            Mode::Realtime => {
                let compute = &self.shared.compute;
                let gate = gate.clone();
                let live =
                    RealtimeWorld::start(opened.world, hand, task.tick_s, self.official, gate, compute);
                self.stream = Some(Stream { live: live.clone(), went_back: false });
                PlayedWorld::Realtime(live)
            }
        };
        self.open_run = Some(OpenRun { stage: Stage::Played(world, recording), gate });
        self.tell_end();
        let (run, scene) = (Some(run), Some(opened.scene));
        Reply::Obs(Box::new(Obs { run, scene, ..self.obs(Some(id), run_id, opened.observation) }))
    }

    /// The message for an observation.
    fn obs(&self, id: Option<u64>, run_id: String, observation: Observation) -> Obs {
        let session_left_s = self.left_s();
        Obs { id, run_id, session_left_s, observation, late_s: None, resumed: false, run: None, scene: None }
    }

    /// Advances a lockstep world.
    pub(super) async fn step(&mut self, id: u64, step: Step) -> Result<Reply, Refusal> {
        let made = self.made_elsewhere(&step);
        let ticks =
            self.machine.may_step(self.now(), step.tick + u64::from(made), step.repeat, MAX_REPEAT)?;
        let lockstep = self.open_run.as_mut().and_then(OpenRun::lockstep);
        let (Some(lockstep), Some(run)) = (lockstep, self.machine.playing()) else { return Err(ended()) };
        let run_id = run.run_id.clone();
        let shots = lockstep.world.shots(&step.cameras).map_err(bad_camera)?;
        let scheduler = &self.shared.compute.scheduler;
        let rest = step.repeat.saturating_sub(made);
        let missing = Missing { ticks: ticks.max(1).min(rest), since: step.tick };
        let stepped = match lockstep.world.step(scheduler, self.official, &step.action, missing).await {
            Ok(stepped) => stepped,
            Err(StepError::Action(error)) => return Err(Refusal::new(Code::BadAction, error.to_string())),
            Err(StepError::Failed(failure)) => {
                self.close_run(Reason::WorldFault, None).await;
                let message = format!("{failure}. Run {run_id} is void; reset opens another");
                return Err(Refusal::new(Code::Internal, message).by(failure.fault));
            }
        };
        lockstep.taken_over = false;
        let mut observation = stepped.observation;
        let StepImages { requested, upcoming } = lockstep.world.expose(&shots);
        lockstep.upcoming = upcoming;
        self.machine.stepped(observation.tick, self.now());
        if let Some(reason) = stepped.over {
            self.close_run(reason, None).await;
        } else if self.run_is_overdue() {
            self.close_run(Reason::SessionOver, None).await;
            observation.truncated = true;
            observation.reason = Some(Reason::SessionOver.as_str().into());
        }
        // A run whose result is stored has no gate any more.
        self.pass_gate(observation.tick).await?;
        observation.cameras = images::render(&self.shared.compute, requested).await;
        self.save(false).await;
        Ok(Reply::Obs(Box::new(self.obs(Some(id), run_id, observation))))
    }

    /// Ticks of a step that another host has made before this one took the run over. Its client has missed their observation and sends
    /// the step again.
    fn made_elsewhere(&mut self, step: &Step) -> u32 {
        let now = self.machine.playing().map_or(0, |run| run.tick);
        let made = now.checked_sub(step.tick).and_then(|made| u32::try_from(made).ok());
        let lockstep = self.open_run.as_mut().and_then(OpenRun::lockstep);
        let taken_over = lockstep.is_some_and(|run| run.taken_over);
        made.filter(|made| taken_over && *made <= step.repeat).unwrap_or(0)
    }

    /// Waits until so few ticks are unstored that the client may see this one. The time is given back.
    async fn pass_gate(&mut self, tick: u64) -> Result<(), Refusal> {
        let Some(gate) = self.gate() else { return Ok(()) };
        let opened = tokio::select! {
            biased;
            opened = gate.open(tick) => opened.map_err(|lost| lost.to_string()),
            () = self.held.lost() => Err("the session has another owner".to_owned()),
            () = self.shared.lifecycle.stopping() => Err("the server stops".to_owned()),
        };
        self.catch_up();
        opened.map_err(|why| {
            Refusal::new(Code::Internal, format!("{why}; connect again to go on")).retry_after(1.0)
        })
    }

    /// After a reply, while the controller computes: notifies the observers, and on a free core prepares the next tick and renders
    /// upcoming images.
    pub(crate) fn after_reply(&mut self) {
        let compute = &self.shared.compute;
        if let Some(run) = self.open_run.as_mut().and_then(OpenRun::lockstep) {
            run.world.notify_observers();
            if let Some(permit) = compute.scheduler.spare() {
                run.world.prepare(&permit);
            }
            images::render_ahead(compute, std::mem::take(&mut run.upcoming));
        }
    }

    /// Sets the next action of a realtime world.
    pub(super) fn act(&mut self, id: u64, act: Act) -> Result<Reply, Refusal> {
        self.machine.may_act(self.now())?;
        let live = self.realtime().ok_or_else(ended)?;
        let shots = live.shots(&act.cameras).map_err(bad_camera)?;
        let accepted = live.act(act.action, shots);
        let tick = accepted.map_err(|error| Refusal::new(Code::BadAction, error.to_string()))?;
        Ok(Reply::Ack(Ack { id, tick }))
    }

    /// Pushes the hand.
    pub(super) fn perturb(&mut self, id: u64, push: Perturb) -> Result<Reply, Refusal> {
        if self.official {
            let message = "perturb is for practice, not for a competition";
            return Err(Refusal::new(Code::WrongState, message));
        }
        self.machine.may_perturb(self.now())?;
        self.catch_up();
        let wrench = Wrench { force: push.wrench.force, torque: push.wrench.torque };
        let work =
            |world: &mut World| world.push(&push.link, wrench, push.duration_s).map(|()| world.next_tick());
        let pushed = self.open_run.as_mut().and_then(|run| run.with_world(work)).ok_or_else(ended)?;
        let tick = pushed.map_err(|error| Refusal::new(Code::BadRequest, error.to_string()))?;
        Ok(Reply::Ack(Ack { id, tick }))
    }

    /// The next observation of a realtime world.
    pub(crate) async fn next_streamed(&mut self) -> Option<Reply> {
        let StreamedObservation { mut observation, images, due } = self.stream()?.pop()?;
        let StepImages { requested, upcoming } = images;
        observation.cameras = images::render(&self.shared.compute, requested).await;
        images::render_ahead(&self.shared.compute, upcoming);
        self.catch_up();
        let run_id = self.machine.run_info().map(|run| run.run_id)?;
        let resumed = self.stream.as_mut().is_some_and(|stream| std::mem::take(&mut stream.went_back));
        let late_s = Some(Instant::now().saturating_duration_since(due).as_secs_f64());
        Some(Reply::Obs(Box::new(Obs { late_s, resumed, ..self.obs(None, run_id, observation) })))
    }

    /// Closes a realtime run whose world is over.
    pub(crate) async fn close_if_world_over(&mut self) {
        if let Some(reason) = self.realtime().and_then(|live| live.over()) {
            self.close_run(reason, None).await;
        }
        self.save(false).await;
    }
}

/// The refusal for a hand that touches something where it starts. With `hides`, objects are not named, since that would reveal their
/// places.
fn in_the_way(task: &Task, hand: &Hand, overlaps: &[Overlap], hides: bool) -> Refusal {
    let named = overlaps.iter().filter(|overlap| !hides || overlap.obstacle != Obstacle::Object);
    let mut overlaps: Vec<String> = named.take(3).map(Overlap::to_string).collect();
    if overlaps.is_empty() {
        overlaps.push("it touches an object".to_owned());
    }
    let (hand, task, overlaps) = (&hand.name, &task.name, overlaps.join(", "));
    let message = format!("hand `{hand}` is in the way where it starts in task `{task}`: {overlaps}");
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
    fn a_refused_hand_gets_the_overlaps_but_on_sensors_no_object() {
        let (task, hand) = (Task::builtin()[0].clone(), builtin_hands()[0].clone());
        let touches = |obstacle, name: &str| Overlap { link: "palm".into(), obstacle, name: name.into() };
        let both = [touches(Obstacle::Object, "ball_3"), touches(Obstacle::Furniture, "table")];
        let message = |overlaps: &[Overlap], hides| {
            let refusal = in_the_way(&task, &hand, overlaps, hides);
            assert_eq!(refusal.code, Code::HandInTheWay);
            refusal.message
        };
        assert!(message(&both, false).ends_with("link `palm` touches `ball_3`, link `palm` touches `table`"));
        assert!(message(&both, true).ends_with(": link `palm` touches `table`"));
        assert!(message(&both[..1], true).ends_with(": it touches an object"));
        let many = [both.clone(), both].concat();
        assert_eq!(message(&many, false).matches("touches").count(), 3, "not all of them");
    }
}
