//! Snapshots and forks of a run.

use super::Run;
use super::cameras::ImageCache;
use super::run_key::RunKey;
use super::snapshot::{Applied, Noted, Snapshot, SnapshotError, events, noted};
use super::targets::{BaseMotion, Pushed, Pushing};
use crate::action::Action;
use crate::task::MAX_DELAY;
use palmares_sim::World;
use std::sync::{Arc, OnceLock};

/// Bound on the ticks of a run.
const MAX_TICKS: u64 = 1 << 40;

impl Run {
    /// Takes a snapshot. Not between [`Run::prepare`] and the step that it prepares.
    pub fn snapshot(&self) -> Snapshot {
        Snapshot {
            taken_here: true,
            key: Arc::clone(self.key()),
            world: self.world.snapshot(),
            sensors: self.sensors.state(),
            referee: self.referee.state(),
            pose_history: self.pose_history.clone(),
            tick: self.tick,
            target: self.target,
            arm: self.carrying.as_ref().map(|carrying| carrying.state.clone()),
            shaken_at: self.shaken_at,
            applied: Applied::from(&self.applied),
            pushing: self.pushing.clone(),
            news: noted(&self.news),
            history: noted(&self.history),
            motor_work_j: self.motor_work_j.clone(),
            altered: self.altered,
            under_way: self.under_way.iter().map(Applied::from).collect(),
        }
    }

    /// Continues from a snapshot of this run or another of the same task, hand, seed and noise, bit for bit. A run with longer
    /// steps than the task's own also continues from a snapshot of the same run with these, near to how that one goes on.
    ///
    /// # Errors
    /// The snapshot is of another run, or its bytes have been changed. The run stays as it was.
    pub fn restore(&mut self, from: &Snapshot) -> Result<(), SnapshotError> {
        let own = self.key();
        let same_steps = own.is_of_task(&from.key);
        if !Arc::ptr_eq(own, &from.key)
            && let Some(what) = own.differs(&from.key)
        {
            return Err(SnapshotError::Other { what });
        }
        if !(from.taken_here && same_steps)
            && let Some(what) = self.unfit(from)
        {
            return Err(SnapshotError::Unfit { what });
        }
        match self.task.finer().filter(|_| !same_steps) {
            Some(finer) => self.world.resume_from_steps(&from.world, finer.step_s),
            None => self.world.resume(&from.world),
        }
        self.sensors.restore(&from.sensors);
        self.referee.restore(&from.referee);
        self.pose_history.clone_from(&from.pose_history);
        self.image_cache = ImageCache::default();
        (self.tick, self.target, self.shaken_at) = (from.tick, from.target, from.shaken_at);
        if let (Some(carrying), Some(state)) = (&mut self.carrying, &from.arm) {
            carrying.state.clone_from(state);
        }
        self.applied = Action::from(&from.applied);
        self.pushing.clone_from(&from.pushing);
        (self.news, self.history) = (events(&from.news), events(&from.history));
        self.motor_work_j.clone_from(&from.motor_work_j);
        self.altered = from.altered;
        self.under_way = from.under_way.iter().map(Action::from).collect();
        self.prepared = None;
        Ok(())
    }

    /// Another run that continues from here on its own. Not between [`Run::prepare`] and the step that it prepares.
    #[must_use]
    pub fn fork(&self) -> Run {
        let mut world = World::new(Arc::clone(self.world.model()), self.world.state().clone());
        world.resume(&self.world.snapshot());
        Run {
            task: Arc::clone(&self.task),
            hand: Arc::clone(&self.hand),
            seed: self.seed,
            noise: self.noise,
            key: OnceLock::from(Arc::clone(self.key())),
            scene: Arc::clone(&self.scene),
            body_names: Arc::clone(&self.body_names),
            world,
            telemetry_model: Arc::clone(&self.telemetry_model),
            sensors: self.sensors.clone(),
            cameras: Arc::clone(&self.cameras),
            pose_history: self.pose_history.clone(),
            image_cache: ImageCache::default(),
            referee: self.referee.clone(),
            tick: self.tick,
            target: self.target,
            carrying: self.carrying.clone(),
            shaken_at: self.shaken_at,
            applied: self.applied.clone(),
            pushing: self.pushing.clone(),
            news: self.news.clone(),
            history: self.history.clone(),
            motor_work_j: self.motor_work_j.clone(),
            altered: self.altered,
            under_way: self.under_way.clone(),
            prepared: None,
            computed: 0,
        }
    }

    /// The part of a snapshot that cannot be this run's, although the snapshot names this run.
    fn unfit(&self, from: &Snapshot) -> Option<&'static str> {
        let (objects, links) = (self.world.model().objects().len(), self.hand.links.len());
        let (motors, arm) = (self.hand.motors.len(), self.arm().map(|arm| arm.joints.len()));
        let known = |notes: &[Noted]| notes.iter().all(|note| note.object.is_none_or(|k| k < objects));
        let known_part = |push: &Pushing| match push.on {
            Pushed::Link(link) => link < links,
            Pushed::Object(object) => object < objects && from.altered,
        };
        let pushed = |push: &Pushing| known_part(push) && push.is_within(Run::PUSH_LIMITS);
        let parts = [
            ("world", from.world.fits(self.world.model())),
            ("sensors", self.sensors.fits(&from.sensors)),
            ("referee", self.referee.fits(&from.referee)),
            ("camera pictures", from.pose_history.fits(self.body_names.len())),
            ("tick", from.tick < MAX_TICKS),
            ("target", from.target.is_finite() && (arm.is_some() || from.target != BaseMotion::Joints)),
            ("arm", from.arm.is_some() == arm.is_some()),
            ("arm", from.arm.iter().zip(self.arm()).all(|(state, arm)| state.fits(arm))),
            ("shake", from.shaken_at.is_none_or(|pose| pose.is_finite())),
            ("action", std::iter::once(&from.applied).chain(&from.under_way).all(|it| it.fits(motors, arm))),
            ("actions under way", from.under_way.len() <= MAX_DELAY as usize),
            ("pushes", from.pushing.len() <= Run::MAX_PUSHES && from.pushing.iter().all(pushed)),
            ("events", known(&from.news) && known(&from.history)),
            ("motor work", from.motor_work_j.len() == motors),
        ];
        parts.into_iter().find(|(_, fits)| !fits).map(|(what, _)| what)
    }

    fn key(&self) -> &Arc<RunKey> {
        self.key
            .get_or_init(|| Arc::new(RunKey::new(&self.task, &self.hand, self.seed, self.noise, &self.scene)))
    }
}
