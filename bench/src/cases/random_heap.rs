//! Random heaps in a box: 3 to 12 spheres, boxes, cylinders and capsules of 10 g to 5 kg, and kicks.

use super::scene::{SceneBuilder, awake, cuboid};
use super::setup::Setup;
use crate::engine::Engine;
use anyhow::{Context, Result, anyhow};
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::{Command, State};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;

/// Inner half width of the box, m.
const HALF_M: f64 = 0.15;
/// Height of its walls, m: kicked bodies stay far below.
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
    /// Time, as a part of the run.
    pub(crate) at: f64,
    /// Number of the body, modulo the number of bodies.
    pub(crate) body: usize,
    /// m/s
    pub(crate) linear: [f64; 3],
    /// rad/s
    pub(crate) angular: [f64; 3],
}

/// A heap and its kicks.
#[derive(Clone, Debug)]
pub struct Heap {
    pub(crate) bodies: Vec<Body>,
    pub(crate) kicks: Vec<Kick>,
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

/// Heaps with a number of bodies in this range.
pub fn heap(bodies: std::ops::RangeInclusive<usize>) -> impl Strategy<Value = Heap> {
    (prop::collection::vec(body(), bodies), prop::collection::vec(kick(), 0..6))
        .prop_map(|(bodies, kicks)| Heap { bodies, kicks })
}

/// A heap of thirty, always the same.
pub fn thirty() -> Result<Heap> {
    heaps_of_thirty(1)?.pop().context("one heap was requested")
}

/// `count` heaps of thirty, always the same; the first is [`thirty`].
pub fn heaps_of_thirty(count: u32) -> Result<Vec<Heap>> {
    let mut runner = TestRunner::deterministic();
    let tree = |_| heap(30..=30).new_tree(&mut runner).map_err(|reason| anyhow!("{reason}"));
    (0..count).map(tree).map(|tree| Ok(tree?.current())).collect()
}

impl Heap {
    /// Largest distance of a centre beyond a wall or the floor, m; negative when all are inside.
    pub fn escaped(&self, state: &State) -> f64 {
        let beyond = |pose: &Pose| {
            let p = pose.translation;
            (p.x.abs() - HALF_M).max(p.y.abs() - HALF_M).max(-p.z)
        };
        state.objects.iter().map(beyond).fold(f64::NEG_INFINITY, f64::max)
    }

    /// The heap above its box, the bodies in layers of nine in which no two can touch.
    pub fn start(&self, setup: &Setup) -> Result<(Box<dyn Engine>, Command)> {
        let mut scene = SceneBuilder::new(awake(setup.dt_s))?;
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
}

/// An orientation, evenly over all except the corners of a cube of quaternions.
pub(crate) fn rotation() -> impl Strategy<Value = Rotation> {
    prop::array::uniform4(-1.0..1.0f64)
        .prop_filter("a direction needs a length", |q| q.iter().map(|x| x * x).sum::<f64>() > 0.01)
        .prop_map(|[x, y, z, w]| Rotation::from_xyzw(x, y, z, w).normalize())
}
