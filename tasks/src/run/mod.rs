//! A run: one world, one task, one hand, from tick 0 to its score.

mod arm;
mod arriving;
mod bodies;
mod cameras;
mod carrying;
mod evidence;
mod exposure;
mod failure;
mod film;
mod hand_body;
mod inspection;
mod observe;
mod outcome;
mod pictures;
mod placement;
mod placing;
pub(crate) mod predictor;
mod push;
mod push_error;
mod restore;
mod run_key;
mod shots;
mod snapshot;
mod still;
mod studio;
mod targets;
mod telemetry;
mod tick;
mod view;
mod watch;

pub use cameras::Exposure;
pub use evidence::Evidence;
pub use failure::Failure;
pub use hand_body::HandBody;
pub use outcome::{Outcome, Reason};
pub use placement::Placement;
pub use push_error::PushError;
pub use shots::{Shot, ShotError, camera_name, shots};
pub use snapshot::{Snapshot, SnapshotError};
pub use still::Still;
pub use studio::{FILM, FILM_SIZE};
pub use targets::PushedPart;
pub use telemetry::{Contact, FingerWrench, Motor, RunSample, Telemetry, TelemetryModel};
pub use view::{View, ViewError};
pub use watch::StepWatch;

use crate::action::{Action, BaseTarget};
use crate::build::build;
use crate::observation::Event;
use crate::referee::{Count, ObjectSnapshot};
use crate::scene::Scene;
use crate::seed::Seed;
use crate::sensing::Noise;
use crate::settle::SceneError;
use crate::start::hand_start;
use crate::task::{AnyReferee, REST_SPEED, Task, Variation};
use cameras::{Cameras, ImageCache, PoseHistory};
use carrying::Carrying;
use palmares_models::Pose;
use palmares_models::hand::Hand;
use palmares_senses::Sensors;
use palmares_sim::{Fault, SharedScratch, World};
use run_key::RunKey;
use std::collections::VecDeque;
use std::sync::{Arc, OnceLock};
use targets::{BaseMotion, Pushing};

/// Compute budget of the settling after a run, in the unit of [`palmares_sim::bounds`]: some seconds. Then the referee counts
/// the objects at their present poses.
pub const SETTLING_WORK: u64 = 2_000_000_000;

/// One world, one task, one hand.
pub struct Run {
    task: Arc<Task>,
    hand: Arc<Hand>,
    seed: Seed,
    noise: Noise,
    key: OnceLock<Arc<RunKey>>,
    scene: Arc<Scene>,
    body_names: Arc<[String]>,
    world: World,
    telemetry_model: Arc<TelemetryModel>,
    sensors: Sensors,
    cameras: Arc<Cameras>,
    pose_history: PoseHistory,
    image_cache: ImageCache,
    referee: AnyReferee,
    tick: u64,
    target: BaseMotion,
    /// The arm that carries the hand.
    carrying: Option<Carrying>,
    /// Pose of the base when the shake began.
    shaken_at: Option<Pose>,
    applied: Action,
    pushing: Vec<Pushing>,
    news: Vec<Event>,
    history: Vec<Event>,
    /// Work of each motor on its tendons, J.
    motor_work_j: Vec<f64>,
    /// Whether something was put elsewhere or an object pushed since tick 0.
    altered: bool,
    /// Actions that were sent and have not arrived.
    under_way: VecDeque<Action>,
    /// Digest of the state, if the next tick is prepared.
    prepared: Option<u64>,
    /// Computation of the last tick, in the unit of [`palmares_sim::bounds`].
    computed: u64,
}

/// Whether a task's arm, if it has one, reaches the start of a hand.
///
/// # Errors
/// It does not.
pub fn reaches(task: &Task, hand: &Hand) -> Result<(), SceneError> {
    Carrying::new(task, hand_start(task, hand)).map(drop)
}

impl Run {
    /// Builds the scene with the hand, at tick 0. This takes up to a second.
    ///
    /// # Errors
    /// There is no sound scene, or the hand overlaps something in its initial pose.
    pub fn new(task: Arc<Task>, hand: Arc<Hand>, seed: Seed) -> Result<Self, SceneError> {
        let built = build(&task, Some(Arc::clone(&hand)), seed)?;
        let base = hand_start(&task, &hand);
        let carrying = Carrying::new(&task, base)?;
        let at =
            BaseTarget::Pose { position: base.translation.to_array(), quat_xyzw: base.rotation.to_array() };
        let applied = Action {
            base: Some(carrying.as_ref().map_or(at, Carrying::target)),
            hand: Some((0..hand.motors.len()).map(|motor| hand.start.sigma_of(motor)).collect()),
            effort: None,
        };
        let sightings = sightings(&built.world);
        let telemetry_model =
            TelemetryModel::new(hand.clone(), built.world.model(), &built.scene, &built.body_names);
        let sensors = Sensors::new(hand.clone(), &built.world, task.tick_s, None);
        let run = Run {
            sensors,
            cameras: Arc::default(),
            pose_history: PoseHistory::default(),
            image_cache: ImageCache::default(),
            referee: task.referee(&sightings),
            telemetry_model: Arc::new(telemetry_model),
            scene: Arc::new(built.scene),
            body_names: built.body_names.into(),
            world: built.world,
            tick: 0,
            target: if carrying.is_some() {
                BaseMotion::Joints
            } else {
                BaseMotion::Pose { from: base, to: base }
            },
            carrying,
            shaken_at: None,
            applied,
            pushing: Vec::new(),
            news: Vec::new(),
            history: Vec::new(),
            motor_work_j: vec![0.0; hand.motors.len()],
            altered: false,
            under_way: VecDeque::new(),
            prepared: None,
            computed: 0,
            noise: Noise::None,
            key: OnceLock::new(),
            task,
            hand,
            seed,
        };
        Ok(run.with_noise(Noise::None))
    }

    /// This run at tick 0 with the errors of sensors that `noise` selects. The world takes the same course, bit for bit.
    #[must_use]
    pub fn with_noise(mut self, noise: Noise) -> Self {
        (self.noise, self.key) = (noise, OnceLock::new());
        let noise = (noise == Noise::Real).then(|| {
            let factor = self.task.variation().map_or(1.0, Variation::sensor_noise);
            palmares_senses::noise::Noise::new(&self.seed.0).scaled(factor)
        });
        self.sensors = Sensors::new(self.hand.clone(), &self.world, self.task.tick_s, noise.as_ref());
        let (links, start) = (self.hand_bodies(), self.poses().collect());
        self.cameras =
            Arc::new(Cameras::new(&self.task, &self.scene, (&self.hand, links), noise.as_ref(), start));
        (self.pose_history, self.image_cache) = (PoseHistory::default(), ImageCache::default());
        self.remember_poses();
        self
    }

    /// Keeps the present poses for cameras whose images come late.
    fn remember_poses(&mut self) {
        let mut pose_history = std::mem::take(&mut self.pose_history);
        pose_history.remember(&self.cameras, self.tick, self.poses());
        self.pose_history = pose_history;
    }

    /// The scene at tick 0.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The task.
    pub fn task(&self) -> &Arc<Task> {
        &self.task
    }

    /// The hand.
    pub fn hand(&self) -> &Arc<Hand> {
        &self.hand
    }

    /// The seed of the scene.
    pub fn seed(&self) -> Seed {
        self.seed
    }

    /// The errors of its sensors.
    pub fn noise(&self) -> Noise {
        self.noise
    }

    /// The world, for measurements.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Ticks since reset.
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// s since reset.
    pub fn sim_time_s(&self) -> f64 {
        self.tick as f64 * self.task.tick_s
    }

    /// The applied action of the last tick: clipped and complete. The applied actions of all ticks give the same bits in another
    /// run of the same task, hand and seed.
    pub fn applied(&self) -> &Action {
        &self.applied
    }

    /// The referee's events of the last tick.
    pub fn events(&self) -> &[Event] {
        &self.news
    }

    /// The referee's events after a tick, up to now.
    pub fn events_since(&self, tick: u64) -> impl Iterator<Item = &Event> {
        let later = self.history.partition_point(|event| event.tick <= tick);
        self.history[later..].iter()
    }

    /// Score if the run ended now, without the settling.
    pub fn score(&self) -> f64 {
        self.referee.score()
    }

    /// Number of objects by place, by the events of the referee.
    pub fn count(&self) -> Count {
        self.referee.count()
    }

    /// The reason if the run is over: `Complete` or `TimeLimit`. Cheap.
    pub fn over(&self) -> Option<Reason> {
        if self.referee.complete() {
            Some(Reason::Complete)
        } else if self.sim_time_s() >= self.task.time_limit_s {
            Some(Reason::TimeLimit)
        } else {
            None
        }
    }

    /// Exchanges a part of the world's scratch memory with what is lent to it; see [`World::exchange`].
    pub fn exchange(&mut self, lent: &mut SharedScratch) {
        self.world.exchange(lent);
    }

    fn sightings(&self) -> Vec<ObjectSnapshot> {
        sightings(&self.world)
    }

    /// Computes the part of the next tick that does not depend on its action, while the server waits for it. The tick gives the same
    /// bits, sooner.
    pub fn prepare(&mut self) {
        if self.prepared.is_none() {
            self.prepared = Some(self.world.state().hash());
            self.world.prepare();
        }
    }

    /// Digest of the state after the last tick.
    pub fn digest(&self) -> u64 {
        self.prepared.unwrap_or_else(|| self.world.state().hash())
    }

    /// [`Run::digest`] as 16 hexadecimal digits.
    pub fn state_hash(&self) -> String {
        format!("{:016x}", self.digest())
    }

    /// Whether the world is still sound. A run that is not must be voided.
    pub fn healthy(&self) -> bool {
        self.fault().is_none()
    }

    /// The fault of the world, if it has one. A world with a fault makes no more steps.
    pub fn fault(&self) -> Option<Fault> {
        self.world.fault()
    }

    /// Fault and time of a failed world.
    pub fn failure(&self) -> Option<Failure> {
        let (tick, step) = (self.tick, Some(self.steps()));
        self.fault().map(|fault| Failure { fault, tick, step })
    }

    /// Steps of the physics since reset. A failed world makes no more of them.
    pub fn steps(&self) -> u64 {
        self.world.state().step
    }

    /// Computation of the last tick, in the unit of [`palmares_sim::bounds`].
    pub fn computed(&self) -> u64 {
        self.computed
    }

    /// Ends the run: freezes the hand, lets the objects settle, counts. If the world fails meanwhile, the outcome's reason
    /// is `WorldFault`.
    pub fn finish(&mut self, reason: Reason) -> Outcome {
        let (ticks, sim_time_s) = (self.tick, self.sim_time_s());
        let here = self.world.state().reference.pose;
        self.target = BaseMotion::Pose { from: here, to: here };
        self.pushing.clear();
        let mut work = 0;
        if reason != Reason::WorldFault {
            for _ in 0..(self.task.rules.settle_s() / self.task.tick_s).ceil() as u64 {
                let still = self.sightings().iter().all(|object| object.at_rest) && self.tick > ticks;
                if still || work > SETTLING_WORK || !self.healthy() {
                    break;
                }
                work += self.advance(&mut ());
                self.tick += 1;
                let objects = self.sightings();
                self.history.extend(self.referee.watch(self.tick, &objects));
            }
        }
        let fault = self.fault();
        let reason = if fault.is_none() { reason } else { Reason::WorldFault };
        let (count, score) = match reason {
            Reason::WorldFault => (Count::default(), 0.0),
            _ => self.referee.final_result(&self.sightings()),
        };
        Outcome {
            score,
            in_goal: count.in_goal,
            outside: count.outside,
            reason,
            fault,
            ticks,
            sim_time_s,
            events: self.history.clone(),
            state_hash: self.state_hash(),
        }
    }
}

/// The objects as the referee gets them.
fn sightings(world: &World) -> Vec<ObjectSnapshot> {
    let state = world.state();
    let hand_from_world = state.base.inverse();
    (0..state.objects.len())
        .map(|k| {
            let (linear, _) = state.object_velocity(world.model(), k);
            let at = state.objects[k].translation;
            ObjectSnapshot {
                position: at.to_array(),
                in_hand: hand_from_world.transform_point(at).to_array(),
                at_rest: state.sleep[k].asleep || linear.length() < REST_SPEED,
                frame: state.object_pose(world.model(), k),
            }
        })
        .collect()
}
