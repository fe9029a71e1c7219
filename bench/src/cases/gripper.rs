//! A gripper that is driven by forces alone lifts a ball and runs against its stop.

use super::case::{Case, Finding};
use super::scene::{G, SceneBuilder, cuboid, rigid};
use super::setup::{Setup, ends_of_steps};
use crate::case_report::Figure;
use crate::recorder::Recorder;
use crate::rigs::{Finger, bolted, fingers};
use anyhow::Result;
use palmares_models::hand::{Geom, Hand, HingeKind};
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[Case::ours(
    "gripper_analytic",
    "two jaws close on a ball with constant forces, lift it and hit a stop: height of the ball",
    gripper_analytic,
)];

/// Mass of the ball, kg.
const BALL_KG: f64 = 0.2;
/// Radius of the ball, m.
const RADIUS_M: f64 = 0.05;
/// Mass of a jaw, and of the carriage, kg.
const JAW_KG: f64 = 2.0;
/// Friction coefficient of jaws and ball.
const FRICTION: f64 = 0.3;
/// Force that closes a jaw, N.
const CLOSE_N: f64 = 14.0;
/// Force that lifts the carriage, N.
const LIFT_N: f64 = 10.0;
/// Gap between jaw and ball at the start, m.
const GAP_M: f64 = 0.2 * RADIUS_M;
/// Stroke of the carriage, m.
const STROKE_M: f64 = RADIUS_M;

/// Height of the carriage's top plate, m: well above the jaws.
const TOP_M: f64 = 0.15;
/// Half the thickness of a plate, m.
const HALF_PLATE_M: f64 = 0.01;

/// 6 x 6 cm, across z.
fn plate() -> Shape {
    Shape::Box { half_extents: [0.03, 0.03, HALF_PLATE_M], rounding: 0.0 }
}

/// A carriage that slides up a welded rail to its stop, and two jaws that slide on it, x towards the ball. Each is pulled
/// by a cable that is wound far beyond its largest tension, which therefore acts all the time.
fn gripper() -> Result<Hand> {
    let slide = |base_from_hinge, tension, geoms| Finger {
        kind: HingeKind::Prismatic,
        base_from_hinge,
        mass: JAW_KG,
        inertia: 1e-3,
        stiffness: 0.0,
        damping: 0.0,
        tension,
        geoms,
    };
    let jaw = |side: f64| {
        // z of the hinge is its way: towards the ball.
        let turn = Rotation::from_rotation_y(-side * FRAC_PI_2);
        let at = Vec3::new(side * (RADIUS_M + GAP_M + HALF_PLATE_M), 0.0, 0.0);
        let geom = Geom { link_from_geom: Pose::IDENTITY, shape: plate(), friction: FRICTION };
        slide(Pose::from_parts(at, turn), CLOSE_N, vec![geom])
    };
    let top = Geom { link_from_geom: Pose::translation(0.0, 0.0, TOP_M), shape: plate(), friction: 0.0 };
    let carriage = slide(Pose::IDENTITY, LIFT_N, vec![top]);
    let mut hand = fingers("gripper", Vec::new(), vec![carriage, jaw(-1.0), jaw(1.0)])?;
    hand.gravity_compensation = true;
    for jaw in &mut hand.links[2..] {
        jaw.parent = Some(1);
    }
    Ok(hand)
}

/// Rise of the ball at a time, m.
///
/// The jaws meet it at `t_g = √(2 gap m_j/u_x)`, when the weightless gripper of m_g rises with `u_z t_g/m_g`.
/// The impact leaves the common momentum, then both accelerate with `(u_z − m g)/(m + m_g)`. Once the
/// carriage hits its stop, the ball slips upwards, braked by friction and weight: `2 μ u_x/m + g`.
fn exact(t: f64) -> f64 {
    let gripper = 3.0 * JAW_KG;
    let together = gripper + BALL_KG;
    let grasp = (2.0 * GAP_M * JAW_KG / CLOSE_N).sqrt();
    let before = 0.5 * LIFT_N / gripper * grasp * grasp;
    let (v, a) = (LIFT_N * grasp / together, (LIFT_N - BALL_KG * G) / together);
    let hit = grasp + (-v + (v * v + 2.0 * a * (STROKE_M - before)).sqrt()) / a;
    let risen = |since: f64| v * since + 0.5 * a * since * since;
    if t < grasp {
        return 0.0;
    }
    if t < hit {
        return risen(t - grasp);
    }
    let (speed, brake) = (v + a * (hit - grasp), 2.0 * FRICTION * CLOSE_N / BALL_KG + G);
    let since = (t - hit).min(speed / brake);
    risen(hit - grasp) + speed * since - 0.5 * brake * since * since
}

/// Largest error of the ball's height in 0.5 s, mm (Horak & Trinkle 2019, exp_grasping.m of
/// erwincoumans/contact_models; the slip in its analytic_gripper.m leaves the ball's weight out, which makes it 0.2 mm
/// longer). Regularised convex contacts open the jaws at the stop, the more the longer the step. Contacts and stop are
/// those of rigid bodies.
pub fn gripper_analytic(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let config = bolted(rigid(setup.dt_s));
    let (mut engine, mut command) = SceneBuilder::with_hand(config, Arc::new(gripper()?), Pose::IDENTITY)?
        .fixed(&cuboid(0.02, 0.02, 0.02), Pose::translation(0.0, 0.0, -RADIUS_M - 0.01), 0.0)?
        .fixed(&plate(), Pose::translation(0.0, 0.0, TOP_M + 2.0 * HALF_PLATE_M + STROKE_M), 0.0)?
        .body(Shape::Sphere { radius: RADIUS_M }, BALL_KG, FRICTION, Pose::IDENTITY)?
        .start(setup)?;
    command.sigma.fill(1.0);
    let mut worst: f64 = 0.0;
    for t in ends_of_steps(0.5, setup.dt_s) {
        recorder.step(&mut *engine, &command)?;
        let height = engine.state().objects[0].translation.z;
        worst = worst.max((height - exact(t)).abs());
    }
    Ok(recorder.finding(Figure::new("largest error of the ball's height", worst * 1e3, "mm")))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The figures of analytic_gripper.m.
    #[test]
    fn the_ball_is_gripped_and_stopped_when_horak_and_trinkle_say() {
        assert_eq!(exact(0.05345), 0.0);
        assert!(exact(0.05346) > 0.0);
        let speed = |t: f64| (exact(t + 1e-7) - exact(t - 1e-7)) / 2e-7;
        let falls = |t: f64| speed(t + 1e-4) < speed(t - 1e-4);
        assert!(!falls(0.2655) && falls(0.2660));
    }
}
