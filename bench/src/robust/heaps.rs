//! Random heaps in a box, shaken: nothing may escape, explode or gain energy.
//!
//! A heap is 3 to 12 spheres, boxes, cylinders and capsules of 10 g to 5 kg, dropped into a box and then kicked
//! out of the blue.

use super::{all_hold, rotation};
use crate::audit::{Audit, mechanical};
use crate::cases::Setup;
use crate::cases::scene::{Scene, awake, cuboid, set_velocity, velocity};
use crate::engine::{Engine, EngineKind};
use anyhow::{Context, Result, anyhow, ensure};
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::{Command, State};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;

/// Inner half width of the box, m.
const HALF_M: f64 = 0.15;
/// Height of its walls, m: what is kicked stays far below.
const HEIGHT_M: f64 = 1.0;
/// No object reaches farther than this from its centre, m.
const REACH_M: f64 = 0.045;

/// A body of a heap.
#[derive(Clone, Debug)]
pub struct Body {
    shape: Shape,
    mass: f64,
    friction: f64,
    rotation: Rotation,
}

/// A sudden change of a body's velocities.
#[derive(Clone, Debug)]
pub struct Kick {
    /// When, as a part of the run.
    at: f64,
    /// Whom; modulo the number of bodies.
    body: usize,
    /// m/s
    linear: [f64; 3],
    /// rad/s
    angular: [f64; 3],
}

/// A heap and what is done to it.
#[derive(Clone, Debug)]
pub struct Heap {
    bodies: Vec<Body>,
    kicks: Vec<Kick>,
}

/// What a run of a heap showed.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seen {
    /// How far the farthest centre got beyond a wall or the floor, m; negative when inside.
    pub escaped_m: f64,
    /// Largest rise of energy that no kick explains, J.
    pub gain_j: f64,
    /// The same in parts of all the energy there was to be moved about; see [`Audit::gain`].
    pub gain: f64,
    /// Deepest overlap, m.
    pub overlap_m: f64,
    /// Fastest body after the first impact, m/s.
    pub speed: f64,
    /// Steps in which Newton failed or a number was not finite.
    pub failed: u64,
}

fn shape() -> impl Strategy<Value = Shape> {
    let size = 0.01..0.025f64;
    prop_oneof![
        (0.01..0.04f64).prop_map(|radius| Shape::Sphere { radius }),
        [size.clone(), size.clone(), size.clone()]
            .prop_map(|half_extents| Shape::Box { half_extents, rounding: 0.0 }),
        (size.clone(), 0.01..0.035f64)
            .prop_map(|(radius, half_length)| Shape::Cylinder { radius, half_length }),
        (0.008..0.015f64, 0.005..0.025f64)
            .prop_map(|(radius, half_length)| Shape::Capsule { radius, half_length }),
    ]
}

fn body() -> impl Strategy<Value = Body> {
    let masses = 0.01f64.ln()..5f64.ln();
    (shape(), masses, 0.0..1.2f64, rotation()).prop_map(|(shape, log_mass, friction, rotation)| Body {
        shape,
        mass: log_mass.exp(),
        friction,
        rotation,
    })
}

fn kick() -> impl Strategy<Value = Kick> {
    (0.2..0.9f64, 0..12usize, prop::array::uniform3(-1.0..1.0f64), prop::array::uniform3(-20.0..20.0f64))
        .prop_map(|(at, body, linear, angular)| Kick { at, body, linear, angular })
}

/// Heaps of so many bodies.
pub fn heap(bodies: std::ops::RangeInclusive<usize>) -> impl Strategy<Value = Heap> {
    (prop::collection::vec(body(), bodies), prop::collection::vec(kick(), 0..6))
        .prop_map(|(bodies, kicks)| Heap { bodies, kicks })
}

/// A heap of thirty, always the same.
pub fn thirty() -> Result<Heap> {
    heaps_of_thirty(1)?.pop().context("one heap was asked for")
}

/// So many heaps of thirty, always the same; the first is [`thirty`].
pub fn heaps_of_thirty(count: u32) -> Result<Vec<Heap>> {
    let mut runner = TestRunner::deterministic();
    let tree = |_| heap(30..=30).new_tree(&mut runner).map_err(|reason| anyhow!("{reason}"));
    (0..count).map(tree).map(|tree| Ok(tree?.current())).collect()
}

impl Heap {
    /// How far the farthest centre is beyond a wall or the floor, m; negative when all are inside.
    pub fn escaped(&self, state: &State) -> f64 {
        let beyond = |pose: &Pose| {
            let p = pose.translation;
            (p.x.abs() - HALF_M).max(p.y.abs() - HALF_M).max(-p.z)
        };
        state.objects.iter().map(beyond).fold(f64::NEG_INFINITY, f64::max)
    }

    /// The heap above its box, the bodies in layers of nine in which no two can touch.
    pub fn start(&self, setup: &Setup) -> Result<(Box<dyn Engine>, Command)> {
        let mut scene = Scene::new(awake(setup.dt_s))?;
        let (w, t, h) = (HALF_M, 0.05, HEIGHT_M);
        let slabs = [
            ([0.0, 0.0, -t], [w + 2.0 * t, w + 2.0 * t, t]),
            ([w + t, 0.0, 0.5 * h], [t, w + 2.0 * t, 0.5 * h]),
            ([-w - t, 0.0, 0.5 * h], [t, w + 2.0 * t, 0.5 * h]),
            ([0.0, w + t, 0.5 * h], [w, t, 0.5 * h]),
            ([0.0, -w - t, 0.5 * h], [w, t, 0.5 * h]),
        ];
        for ([x, y, z], [a, b, c]) in slabs {
            scene = scene.fixed(&cuboid(2.0 * a, 2.0 * b, 2.0 * c), Pose::translation(x, y, z), 0.5)?;
        }
        for (k, body) in self.bodies.iter().enumerate() {
            let cell = [k % 3, k / 3 % 3].map(|i| (i as f64 - 1.0) * 2.1 * REACH_M);
            let at = Vec3::new(cell[0], cell[1], (1.1 + 2.1 * (k / 9) as f64) * REACH_M);
            let pose = Pose::from_parts(at, body.rotation);
            scene = scene.body(body.shape.clone(), body.mass, body.friction, pose)?;
        }
        scene.start(setup)
    }

    /// Lets it fall for `time_s` and kicks it on the way.
    pub fn run(&self, dt_s: f64, time_s: f64) -> Result<Seen> {
        let setup = Setup::new(EngineKind::Own, dt_s);
        let (mut engine, command) = self.start(&setup)?;
        let count = (time_s / dt_s).round() as u64;
        let mut seen = Seen { escaped_m: f64::NEG_INFINITY, ..Seen::default() };
        let mut audit = Audit::default();
        for step in 0..count {
            for kick in &self.kicks {
                if (kick.at * count as f64) as u64 == step {
                    let body = kick.body % self.bodies.len();
                    let (linear, angular) = velocity(&*engine, body);
                    let before = mechanical(&*engine);
                    let (v, w) = (Vec3::from_array(kick.linear), Vec3::from_array(kick.angular));
                    set_velocity(&mut *engine, body, linear + v, angular + w);
                    let work = mechanical(&*engine) - before;
                    audit.worked(work);
                }
            }
            audit.step(&mut *engine, |engine| engine.step(&command).map(drop))?;
            let outcome = engine.outcome();
            seen.failed += u64::from(!outcome.converged || !engine.state().is_finite());
            seen.overlap_m = seen.overlap_m.max(outcome.penetration_m);
            seen.escaped_m = seen.escaped_m.max(self.escaped(engine.state()));
            for k in 0..self.bodies.len() {
                seen.speed = seen.speed.max(velocity(&*engine, k).0.length());
            }
        }
        (seen.gain_j, seen.gain) = (audit.gain_j(), audit.gain());
        Ok(seen)
    }
}

/// The worst of `count` random heaps, each as long as `time_s`; an error describes the smallest heap found that fails.
pub fn check(seed: u64, count: u32, dt_s: f64, time_s: f64) -> Result<Seen> {
    let mut worst = Seen { escaped_m: f64::NEG_INFINITY, ..Seen::default() };
    all_hold(seed, count, &heap(3..=12), |heap| {
        let seen = heap.run(dt_s, time_s)?;
        worst.escaped_m = worst.escaped_m.max(seen.escaped_m);
        worst.gain_j = worst.gain_j.max(seen.gain_j);
        worst.gain = worst.gain.max(seen.gain);
        worst.overlap_m = worst.overlap_m.max(seen.overlap_m);
        worst.speed = worst.speed.max(seen.speed);
        worst.failed += seen.failed;
        seen.judge(dt_s)
    })?;
    Ok(worst)
}

impl Seen {
    /// What must hold for every heap.
    pub fn judge(&self, dt_s: f64) -> Result<()> {
        ensure!(self.failed == 0, "{} steps failed", self.failed);
        ensure!(self.escaped_m < 0.0, "a body is {} m beyond a wall", self.escaped_m);
        // A body that turns in contact is moved by semi-implicit Euler: its energy is known to the first order of
        // h, three thousandths a millisecond.
        let known = 3.0 * dt_s;
        ensure!(self.gain <= known, "energy grew by {} J, {} of all there was", self.gain_j, self.gain);
        Ok(())
    }
}
