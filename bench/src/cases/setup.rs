//! The engine, the step and the start with which a case is run.

use crate::engine::limit::{self, NotFinished};
use crate::engine::{Engine, EngineFactory, OwnFactory};
use crate::random::Random;
use anyhow::Result;
use palmares_models::hand::Hand;
use palmares_models::{Pose, Vec3};
use palmares_sim::state::BaseReference;
use palmares_sim::{BaseCommand, Model, State};
use std::any::Any;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Engine, step and start of a run.
#[derive(Clone, Copy, Debug)]
pub struct Setup {
    /// The engine that steps.
    pub engine: &'static dyn EngineFactory,
    /// Step, s.
    pub dt_s: f64,
    /// Step of the reference run for cases without an analytic answer; `None` leaves it out.
    pub reference_dt_s: Option<f64>,
    /// The start: 0 is the scene as it is, in the others every object is up to [`ASIDE_M`] aside.
    pub start: u32,
    /// The hand of a case that measures one; `None` is the case's own.
    pub hand: Option<&'static Arc<Hand>>,
}

/// Largest shift of objects for another start, m, along x and along y: finer than objects can be placed by
/// hand.
pub const ASIDE_M: f64 = 1e-4;

impl Setup {
    /// The scene as it is on our engine, without a reference run.
    pub fn own(dt_s: f64) -> Self {
        Setup::new(&OwnFactory, dt_s)
    }

    /// The scene as it is, without a reference run.
    pub fn new(engine: &'static dyn EngineFactory, dt_s: f64) -> Self {
        Setup { engine, dt_s, reference_dt_s: None, start: 0, hand: None }
    }

    /// The engine of this setup, about to take its first step of the model's own length.
    pub fn start(&self, model: impl Into<Arc<Model>>, mut state: State) -> Result<Box<dyn Engine>> {
        if self.start > 0 {
            let mut random = Random::new(self.start.into());
            for pose in &mut state.objects {
                let aside = random.cube() * ASIDE_M;
                pose.translation += Vec3::new(aside.x, aside.y, 0.0);
            }
        }
        self.engine.start(model.into(), state)
    }

    /// The same engine at the step of the reference run; `None` without one.
    pub fn reference(&self) -> Option<Setup> {
        self.reference_dt_s.map(|dt_s| Setup { dt_s, reference_dt_s: None, ..*self })
    }

    /// The result of `make` with this setup, made once for each `name`, engine and step, since reference runs are long. One
    /// that did not end in its time is not started again.
    pub fn once<T: Clone + 'static>(&self, name: &str, make: impl FnOnce(&Setup) -> Result<T>) -> Result<T> {
        let Setup { engine, dt_s, start, .. } = self;
        let key = format!("{name} {} {} {dt_s:e} {start}", engine.name(), engine.settings());
        let known = MADE.with_borrow(|made| {
            made.get(&key).and_then(|it| it.downcast_ref::<Result<T, NotFinished>>()).cloned()
        });
        let made = match known {
            Some(known) => known,
            None => {
                let made = match limit::with_own_limit(|| make(self)) {
                    Ok(it) => Ok(it),
                    Err(error) => Err(error.downcast::<NotFinished>()?),
                };
                MADE.with_borrow_mut(|all| all.insert(key, Box::new(made.clone())));
                made
            }
        };
        made.map_err(|error| anyhow::Error::new(error).context("its reference run"))
    }
}

thread_local! {
    static MADE: RefCell<BTreeMap<String, Box<dyn Any>>> = const { RefCell::new(BTreeMap::new()) };
}

/// Quintic ramp from 0 to 1 over x in [0, 1], and its slope: smooth in velocity and acceleration.
pub fn ramp(x: f64) -> (f64, f64) {
    let x = x.clamp(0.0, 1.0);
    (x * x * x * (10.0 - 15.0 * x + 6.0 * x * x), 30.0 * x * x * (1.0 - x) * (1.0 - x))
}

/// Number of steps of `dt_s` in `time_s`.
pub fn steps(time_s: f64, dt_s: f64) -> u64 {
    (time_s / dt_s).round() as u64
}

/// Times at which the steps of `dt_s` in `time_s` end, s.
pub fn ends_of_steps(time_s: f64, dt_s: f64) -> impl Iterator<Item = f64> {
    (1..=steps(time_s, dt_s)).map(move |k| k as f64 * dt_s)
}

/// The base's set point risen by `height_m` from its start, and rising at `rate`, m/s.
pub fn risen(start: Pose, height_m: f64, rate: f64) -> BaseCommand {
    moved(start, Vec3::new(0.0, 0.0, height_m), Vec3::new(0.0, 0.0, rate))
}

/// The base's set point moved by `offset` from its start, and moving at `linear`.
pub fn moved(start: Pose, offset: Vec3, linear: Vec3) -> BaseCommand {
    let pose = Pose::from_parts(start.translation + offset, start.rotation);
    BaseCommand::Exact(BaseReference { pose, linear, angular: Vec3::ZERO })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::scene::{SceneBuilder, awake, cuboid};
    use palmares_models::Pose;

    #[test]
    fn another_start_stands_up_to_a_tenth_of_a_millimetre_aside() {
        let place = |start: u32| {
            let setup = Setup { start, ..Setup::own(1e-3) };
            let at = Pose::translation(0.0, 0.0, 0.5);
            let scene = SceneBuilder::new(awake(1e-3)).expect("empty");
            let scene = scene.body(cuboid(0.1, 0.1, 0.1), 1.0, 0.5, at).expect("sound");
            scene.start(&setup).expect("it starts").0.state().objects[0].translation
        };
        assert_eq!(place(0).to_array(), [0.0, 0.0, 0.5]);
        assert_ne!(place(1), place(2));
        assert_eq!(place(3), place(3));
        for start in 1..16 {
            let [x, y, z] = place(start).to_array();
            assert!(x.abs() <= ASIDE_M && y.abs() <= ASIDE_M && x != 0.0 && z == 0.5, "{x} {y} {z}");
        }
    }
}
