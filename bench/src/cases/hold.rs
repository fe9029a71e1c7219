//! Holding: a pinch at the edge of Coulomb's law, the largest step that holds.

use super::case::{Case, Finding};
use super::grasp::{CHOSEN, Grasp, kept};
use super::scene::{G, SceneBuilder, cuboid};
use super::setup::{Setup, risen, steps};
use crate::case_report::{Figure, Invariants};
use crate::recorder::Recorder;
use crate::rigs::{Finger, bolted, fingers};
use anyhow::Result;
use palmares_models::hand::{Geom, HingeKind};
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::Config;
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::ours(
        "pinch_hold",
        "two jaws press a box with 0.95, 1.05, 1.5 of m g / 2 mu: slip, and creep over 60 s; and while rising",
        pinch_hold,
    ),
    Case::new(
        "grasp_max_dt",
        "largest step, a power of two, at which SoftHand keeps a capsule through lift and shaking",
        largest_step,
    ),
];

/// Motion of the box against the jaws: its displacement from 0.5 s on, m, and its mean acceleration from 0.05
/// s to 0.35 s, m/s².
struct Slid {
    after_settling_m: f64,
    acceleration: f64,
}

/// A box between a fixed jaw and one that is pressed on it with `ratio` times the force that just holds it, while
/// the base rises at the acceleration `rise`.
fn pinch(setup: &Setup, recorder: &mut Recorder, ratio: f64, rise: f64, time_s: f64) -> Result<Slid> {
    let (mass, mu, half) = (0.2, 0.5, 0.02);
    let press = ratio * mass * (G + rise) / (2.0 * mu);
    let pad = |half_extents, pose| Geom {
        link_from_geom: pose,
        shape: Shape::Box { half_extents, rounding: 0.0 },
        friction: mu,
    };
    let fixed = pad([0.01, 0.03, 0.06], Pose::translation(-half - 0.01, 0.0, 0.0));
    let finger = Finger {
        kind: HingeKind::Prismatic,
        // z of the hinge is the world's −x: the jaw's own x then is z.
        base_from_hinge: Pose::from_parts(
            Vec3::new(half + 0.01, 0.0, 0.0),
            Rotation::from_rotation_y(-FRAC_PI_2),
        ),
        mass: 0.05,
        inertia: 1e-5,
        stiffness: 0.0,
        damping: 1.0,
        tension: press,
        geoms: vec![pad([0.06, 0.03, 0.01], Pose::IDENTITY)],
    };
    let hand = Arc::new(fingers("pinch", vec![fixed], vec![finger])?);
    let (mut world, mut command) =
        SceneBuilder::with_hand(bolted(Config::with_step(setup.dt_s)), hand, Pose::IDENTITY)?
            .body(cuboid(2.0 * half, 2.0 * half, 2.0 * half), mass, mu, Pose::IDENTITY)?
            .start(setup)?;
    // The cable is wound far beyond its largest tension, which therefore acts all the time.
    command.sigma[0] = 1.0;
    let (mut settled, mut early, mut late) = (Vec3::ZERO, 0.0, 0.0);
    let n = steps(time_s, setup.dt_s);
    let (at_early, at_late) = (steps(0.05, setup.dt_s), steps(0.35, setup.dt_s));
    for k in 1..=n {
        let t = k as f64 * setup.dt_s;
        command.base = risen(Pose::IDENTITY, 0.5 * rise * t * t, rise * t);
        recorder.step(&mut *world, &command)?;
        let state = world.state();
        let (linear, _) = state.object_velocity(world.model(), 0);
        let against = linear.z - state.v[2];
        if k == at_early {
            early = against;
        }
        if k == at_late {
            late = against;
        }
        if k == steps(0.5, setup.dt_s) {
            settled = state.objects[0].translation - state.base.translation;
        }
    }
    let state = world.state();
    let now = state.objects[0].translation - state.base.translation;
    Ok(Slid {
        after_settling_m: (now - settled).length(),
        acceleration: (late - early) / ((at_late - at_early) as f64 * setup.dt_s),
    })
}

/// Largest relative error of the slip acceleration at 0.95 of the holding force, `(g + a)(1 − N/N*)`, with the hand
/// still (a = 0) and rising at a = 5 m/s², in percent. The creep goes to `slip_mm_s`: over 60 s at 1.05 and 1.5 of
/// the holding force, and over 1.5 s of rising at 1.05. Exact: none.
pub fn pinch_hold(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (mut worst, mut creep): (f64, f64) = (0.0, 0.0);
    for rise in [0.0, 5.0] {
        let exact = -(G + rise) * 0.05;
        let slid = pinch(setup, recorder, 0.95, rise, 0.4)?;
        worst = worst.max((slid.acceleration / exact - 1.0).abs());
    }
    for (ratio, rise, time_s) in [(1.05, 0.0, 60.5), (1.5, 0.0, 60.5), (1.05, 5.0, 2.0)] {
        let slid = pinch(setup, recorder, ratio, rise, time_s)?;
        creep = creep.max(slid.after_settling_m * 1e3 / (time_s - 0.5));
    }
    let error =
        Figure::new("error of the slip acceleration at 0.95 of the holding force", 100.0 * worst, "%");
    Ok(Finding { error, invariants: Invariants { slip_mm_s: Some(creep), ..recorder.invariants() } })
}

/// The largest step of 2^−k s at which the SoftHand keeps a capsule, in ms; every smaller one from 1/4096 s on must
/// keep it as well. The step of the setup is not used.
pub fn largest_step(setup: &Setup, _: &mut Recorder) -> Result<Finding> {
    let mut largest = 0.0;
    for k in (4..=12).rev() {
        let dt_s = 0.5f64.powi(k);
        if !kept(&Setup { dt_s, ..*setup }, &Grasp::capsule(), CHOSEN)? {
            break;
        }
        largest = dt_s;
    }
    Ok(Finding {
        error: Figure::new("largest step that keeps the capsule", largest * 1e3, "ms"),
        invariants: Invariants::default(),
    })
}
