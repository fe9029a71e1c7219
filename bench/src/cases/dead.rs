//! Dead blows on what can move: with e = 0 nothing returns.

use super::case::{Case, Finding};
use super::scene::{SceneBuilder, awake, cuboid, set_velocity, settle, velocity, weightless};
use super::setup::{Setup, steps};
use crate::case_report::Figure;
use crate::engine::Engine;
use crate::recorder::Recorder;
use crate::rigs::{Finger, bolted, fingers};
use anyhow::Result;
use palmares_models::hand::{Geom, HingeKind};
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::ours("dead_plate", "a ball with e = 0 meets a free plate: what returns", dead_plate),
    Case::ours("dead_rod", "a ball with e = 0 meets a free rod off its middle", dead_rod),
    Case::ours("dead_chain", "a ball with e = 0 meets a row of such balls", dead_chain),
    Case::ours("dead_heap", "a ball with e = 0 falls on stacks at rest", dead_heap),
    Case::ours("dead_hand", "a ball with e = 0 meets a finger that slides or turns", dead_hand),
];

/// Radius, m, of the ball, and the mass of one, kg, where a case has no other; speed, m/s, where a case has no other.
const BALL_M: f64 = 0.02;
const BALL_KG: f64 = 0.05;
const SPEED: f64 = 1.0;
/// Balls, kg, and speeds, m/s, that meet free bodies: the contact's damper is critical for a fifth of a kilogram.
const BLOWS: [(f64, f64); 4] = [(0.05, 1.0), (0.05, 3.0), (0.5, 0.5), (1.0, 1.0)];
/// Gap from which it starts, m, and time after the meeting, s, at which its speed counts.
const GAPS_M: [f64; 4] = [2e-3, 2.7e-3, 3.1e-3, 4e-3];
const AFTER_S: f64 = 0.016;

fn ball() -> Shape {
    Shape::Sphere { radius: BALL_M }
}

/// Throws the last body of a scene, the ball, along −z at something whose inverse mass at the point hit is `inverse`, 1/kg.
/// `surface` tells its normal and its velocity at a point. The part of the speed of approach with which the surfaces part, or that
/// a plastic blow, of impulse `v/(1/m + inverse)`, would take and this one does not. The impulse may be larger: what turns in the
/// blow pushes on.
fn returned(
    setup: &Setup,
    recorder: &mut Recorder,
    scene: SceneBuilder,
    gap: f64,
    (mass, speed): (f64, f64),
    inverse: f64,
    surface: impl Fn(&dyn Engine, Vec3) -> (Vec3, Vec3),
) -> Result<f64> {
    let (mut engine, command) = scene.start(setup)?;
    let last = engine.model().objects().len() - 1;
    set_velocity(&mut *engine, last, Vec3::Z * -speed, Vec3::ZERO);
    let count = ((gap / speed + AFTER_S) / setup.dt_s).ceil() as u64;
    recorder.steps(&mut *engine, &command, count)?;
    let own = velocity(&*engine, last).0;
    let missing = 1.0 - mass * (own.z + speed) * (1.0 / mass + inverse) / speed;
    let (normal, of_surface) = surface(&*engine, engine.state().objects[last].translation);
    let parts = normal.dot(own - of_surface);
    Ok(missing.max(parts / speed))
}

/// A free body of these edges and mass without weight, hit `aside` from its middle.
fn free_body(setup: &Setup, recorder: &mut Recorder, edges: [f64; 3], mass: f64, aside: f64) -> Result<f64> {
    let [x, y, z] = edges;
    let inertia = mass * (x * x + z * z) / 12.0;
    let mut worst: f64 = 0.0;
    for gap in GAPS_M {
        for blow in BLOWS {
            let scene = SceneBuilder::new(weightless(setup.dt_s))?
                .body(cuboid(x, y, z), mass, 0.0, Pose::IDENTITY)?
                .body(ball(), blow.0, 0.0, Pose::translation(aside, 0.0, 0.5 * z + BALL_M + gap))?;
            let inverse = 1.0 / mass + aside * aside / inertia;
            let surface = |engine: &dyn Engine, at: Vec3| {
                let (linear, angular) = velocity(engine, 0);
                let Pose { rotation, translation, .. } = engine.state().objects[0];
                let normal = rotation * Vec3::Z;
                (normal, linear + angular.cross(at - normal * BALL_M - translation))
            };
            worst = worst.max(returned(setup, recorder, scene, gap, blow, inverse, surface)?);
        }
    }
    Ok(worst)
}

fn finding(recorder: &Recorder, worst: f64) -> Finding {
    recorder.finding(Figure::new("largest speed that returns", 100.0 * worst, "% of v"))
}

/// Largest part of the speed, in percent, that returns to balls (20 mm, 50 g to 1 kg, 0.5 to 3 m/s) from a free plate (0.3 x 0.3 x 0.02 m, 1 kg) hit
/// in its middle and 50 mm aside. Exact: 0.
pub fn dead_plate(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut worst: f64 = 0.0;
    for aside in [0.0, 0.05] {
        worst = worst.max(free_body(setup, recorder, [0.3, 0.3, 0.02], 1.0, aside)?);
    }
    Ok(finding(recorder, worst))
}

/// The same from a free rod (0.3 x 0.02 x 0.02 m, 0.3 kg) hit in its middle and 100 mm aside.
pub fn dead_rod(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut worst: f64 = 0.0;
    for aside in [0.0, 0.1] {
        worst = worst.max(free_body(setup, recorder, [0.3, 0.02, 0.02], 0.3, aside)?);
    }
    Ok(finding(recorder, worst))
}

/// Largest speed, in percent of the first ball's, with which neighbours part of six balls, of which the first meets the row of the
/// others, with gaps of 0, 0.1 and 1 mm. Exact: 0, all go on together.
pub fn dead_chain(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut worst: f64 = 0.0;
    for row in [0.0, 1e-4, 1e-3] {
        for gap in GAPS_M {
            let mut scene = SceneBuilder::new(weightless(setup.dt_s))?;
            for k in 0..6 {
                let before = if k == 0 { gap - row } else { 0.0 };
                let at = (2.0 * BALL_M + row) * f64::from(k) - before;
                scene = scene.body(ball(), BALL_KG, 0.0, Pose::translation(at, 0.0, 0.0))?;
            }
            let (mut engine, command) = scene.start(setup)?;
            set_velocity(&mut *engine, 0, Vec3::X * SPEED, Vec3::ZERO);
            recorder.steps(&mut *engine, &command, steps(0.1, setup.dt_s))?;
            for k in 1..6 {
                let part = velocity(&*engine, k).0.x - velocity(&*engine, k - 1).0.x;
                worst = worst.max(part / SPEED);
            }
        }
    }
    Ok(finding(recorder, worst))
}

/// Largest speed, in percent of the blow's, with which a ball ever rises that meets a stack of one, three or five cubes (60 mm, 0.3
/// kg), which has come to rest on the floor, in the middle of its top. Exact: 0.
pub fn dead_heap(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (edge, friction) = (0.06, 0.5);
    let mut worst: f64 = 0.0;
    for high in [1, 3, 5] {
        let mut scene = SceneBuilder::new(awake(setup.dt_s))?.floor(friction)?;
        for k in 0..high {
            let place = Pose::translation(0.0, 0.0, edge * (0.5 + f64::from(k)));
            scene = scene.body(cuboid(edge, edge, edge), 0.3, friction, place)?;
        }
        let last = high as usize;
        let top = edge * f64::from(high) + BALL_M;
        scene = scene.body(ball(), BALL_KG, friction, Pose::translation(0.0, 0.0, top + 5.0))?;
        let (mut engine, command) = scene.start(setup)?;
        settle(&mut *engine, &command, 0.5)?;
        for gap in GAPS_M {
            engine.state_mut().objects[last] = Pose::translation(0.0, 0.0, top + gap);
            set_velocity(&mut *engine, last, Vec3::Z * -SPEED, Vec3::ZERO);
            for _ in 0..steps(0.15, setup.dt_s) {
                recorder.step(&mut *engine, &command)?;
                worst = worst.max(velocity(&*engine, last).0.z / SPEED);
            }
        }
    }
    Ok(finding(recorder, worst))
}

/// Largest part of the speed, in percent, that returns to a ball from a finger of a bolted hand, which slides along the blow (0.1 kg)
/// or turns about an axis 80 mm aside of it (2e-4 kg m²), without spring and damper. Exact: 0.
pub fn dead_hand(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (mass, inertia, arm, half) = (0.1, 2e-4, 0.08, 0.01);
    let mut worst: f64 = 0.0;
    for gap in GAPS_M {
        let upright = Pose::IDENTITY;
        // An axis along y turns the finger about it.
        let across = Pose::from_rotation(Rotation::from_rotation_x(std::f64::consts::FRAC_PI_2));
        let kinds = [
            (HingeKind::Prismatic, upright, 0.0, 1.0 / mass),
            (HingeKind::Revolute, across, arm, arm * arm / inertia),
        ];
        for (kind, base_from_hinge, aside, inverse) in kinds {
            let finger = Finger {
                kind,
                base_from_hinge,
                mass,
                inertia,
                stiffness: 0.0,
                damping: 0.0,
                tension: 0.0,
                geoms: vec![Geom {
                    link_from_geom: base_from_hinge.inverse(),
                    shape: cuboid(0.24, 0.04, 2.0 * half),
                    friction: 0.0,
                }],
            };
            let hand = Arc::new(fingers("struck", Vec::new(), vec![finger])?);
            let scene = SceneBuilder::with_hand(bolted(weightless(setup.dt_s)), hand, Pose::IDENTITY)?.body(
                ball(),
                BALL_KG,
                0.0,
                Pose::translation(aside, 0.0, half + BALL_M + gap),
            )?;
            let surface = |engine: &dyn Engine, at: Vec3| {
                let (q, rate) = (engine.state().q[0], engine.state().v[6]);
                let axis = base_from_hinge.rotation * Vec3::Z;
                match kind {
                    HingeKind::Prismatic => (Vec3::Z, axis * rate),
                    HingeKind::Revolute => {
                        let normal = Rotation::from_axis_angle(axis, q) * Vec3::Z;
                        (normal, (axis * rate).cross(at - normal * BALL_M))
                    }
                }
            };
            worst = worst.max(returned(setup, recorder, scene, gap, (BALL_KG, SPEED), inverse, surface)?);
        }
    }
    Ok(finding(recorder, worst))
}
