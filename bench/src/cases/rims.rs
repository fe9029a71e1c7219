//! Cylinders on their rims: other sizes, leans and speeds than the coin's of `spinning.rs`, slopes, and no friction.

use super::case::{Case, Finding};
use super::scene::{G, SceneBuilder, awake, set_velocity, tilted};
use super::setup::{Setup, steps};
use crate::audit::mechanical;
use crate::case_report::Figure;
use crate::engine::Engine;
use crate::recorder::Recorder;
use crate::rolling_disc::{RollingDisc, Turning};
use anyhow::{Context, Result, ensure};
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::Command;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::new("rim_kinds", "discs of many kinds on their rims keep their energy", rim_kinds),
    Case::new("rim_course", "a coin on its rim turns as its equations of motion say", rim_course),
    Case::new("rim_place", "the contact of a rim is its lowest point", rim_place),
];

/// A disc on its rim.
#[derive(Clone, Copy)]
struct Kind {
    radius: f64,
    half_length: f64,
    mass: f64,
    /// Angle, rad, and speeds about its own axis and the vertical, rad/s.
    lean: f64,
    spin: f64,
    vertical: f64,
    friction: f64,
    /// Slope of the ground.
    slope: f64,
    /// Whether a wide box is the ground.
    on_box: bool,
}

const COIN: Kind = Kind {
    radius: 0.04,
    half_length: 0.003,
    mass: 0.05,
    lean: 1.1,
    spin: 25.0,
    vertical: 4.0,
    friction: 1.0,
    slope: 0.0,
    on_box: false,
};

const SMALL: Kind = Kind { radius: 0.01, half_length: 7.5e-4, mass: 3e-3, spin: 50.0, vertical: 8.0, ..COIN };
const WHEEL: Kind = Kind { radius: 0.1, half_length: 0.02, mass: 1.0, spin: 20.0, vertical: 2.0, ..COIN };
const HEAVY: Kind = Kind { radius: 0.3, half_length: 0.02, mass: 20.0, spin: 10.0, vertical: 2.0, ..COIN };

const KINDS: &[Kind] = &[
    COIN,
    SMALL,
    WHEEL,
    HEAVY,
    Kind { on_box: true, ..COIN },
    Kind { slope: 0.1, ..COIN },
    Kind { friction: 0.0, ..COIN },
    Kind { lean: 0.9, ..COIN },
    Kind { lean: 1.45, ..COIN },
    Kind { spin: 10.0, ..COIN },
    Kind { spin: 100.0, friction: 2.0, ..COIN },
    Kind { vertical: 10.0, ..COIN },
];

impl Kind {
    fn disc(&self) -> RollingDisc {
        let Kind { radius, half_length, mass, friction, slope, .. } = *self;
        let cos = 1.0 / (1.0 + slope * slope).sqrt();
        let gravity = Vec3::new(G * cos * slope, 0.0, -G * cos);
        RollingDisc { radius, half_length, mass, gravity, rolls: friction > 0.0 }
    }

    fn turning(&self) -> Turning {
        Turning::leaning(self.lean, self.spin, self.vertical)
    }

    fn start(&self, setup: &Setup) -> Result<(Box<dyn Engine>, Command)> {
        let Kind { radius, half_length, mass, lean, friction, slope, on_box, .. } = *self;
        let arm = self.disc().arm(self.turning().axis);
        let place = Pose::from_parts(Vec3::new(0.0, 0.0, -arm.z), Rotation::from_rotation_x(lean));
        let scene = SceneBuilder::new(tilted(awake(setup.dt_s), slope))?;
        let scene = if on_box { scene.floor(friction)? } else { scene.ground(friction) };
        let shape = Shape::Cylinder { radius, half_length };
        let (mut engine, command) = scene.body(shape, mass, friction, place)?.start(setup)?;
        let angular = self.turning().angular;
        let rolls = -angular.cross(arm);
        let linear = if friction > 0.0 { rolls } else { Vec3::Z * rolls.z };
        set_velocity(&mut *engine, 0, linear, angular);
        Ok((engine, command))
    }
}

/// Largest change of the energy in a second, in percent, of discs of 10 to 300 mm and 3 g to 20 kg at several leans and speeds, on
/// level ground, a slope and a box, and without friction. The reference says that none of them lifts off or slips: exact is 0.
pub fn rim_kinds(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let (mut worst, mut gain): (f64, f64) = (0.0, f64::NEG_INFINITY);
    for kind in KINDS {
        let course = kind.disc().course(kind.turning(), 1.0);
        let slips = kind.friction > 0.0 && course.friction > kind.friction;
        ensure!(course.least_force > 0.0 && !slips, "a disc lifts off or slips: {course:?}");
        let (mut engine, command) = kind.start(setup)?;
        let before = mechanical(&*engine);
        recorder.steps(&mut *engine, &command, steps(1.0, setup.dt_s))?;
        let change = mechanical(&*engine) - before;
        worst = worst.max((change / before).abs());
        gain = gain.max(change / before);
    }
    Ok(recorder.finding(Figure::new("largest change of energy", 100.0 * worst, "%")).with_energy_gain(gain))
}

/// Largest angle, in degrees, in a second between the axis of a coin and that of the reference (`rolling_disc.rs`), of a coin that rolls
/// on level ground and on a slope, and of one without friction.
pub fn rim_course(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut worst: f64 = 0.0;
    for kind in [COIN, Kind { slope: 0.1, ..COIN }, Kind { friction: 0.0, ..COIN }] {
        let (mut engine, command) = kind.start(setup)?;
        let (disc, mut exact) = (kind.disc(), kind.turning());
        for _ in 0..steps(1.0, setup.dt_s) {
            recorder.step(&mut *engine, &command)?;
            exact = disc.course(exact, setup.dt_s).end;
            let axis = engine.state().objects[0].rotation * Vec3::Z;
            worst = worst.max(axis.angle_between(exact.axis));
        }
    }
    Ok(recorder.finding(Figure::new("largest angle from the reference", worst.to_degrees(), "°")))
}

/// Largest distance, in µm, of the contact of a coin that rolls on its rim from the lowest point of the rim.
pub fn rim_place(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut worst: f64 = 0.0;
    for kind in [COIN, SMALL, Kind { on_box: true, ..COIN }] {
        let (mut engine, command) = kind.start(setup)?;
        for _ in 0..steps(1.0, setup.dt_s) {
            recorder.step(&mut *engine, &command)?;
            let pose = engine.state().objects[0];
            let lowest = pose.translation + kind.disc().arm(pose.rotation * Vec3::Z);
            let world = engine.world().context("only our own engine reports its contact forces")?;
            let contacts = world.contact_forces();
            ensure!(contacts.len() == 1, "it bears on {} points", contacts.len());
            worst = worst.max(contacts[0].position.distance(lowest));
        }
    }
    Ok(recorder.finding(Figure::new("largest distance", 1e6 * worst, "µm")))
}
