//! Small hands built in code, and a base that does not yield, for cases with textbook answers.

use anyhow::{Context, Result};
use palmares_models::hand::{
    Coordinate, CoordinateSettings, Geom, Hand, Hinge, HingeKind, Inertia, Joint, Link, MotorSettings,
    Tendon, TendonNumbers,
};
use palmares_models::read::{self, LoadOptions};
use palmares_models::{Mat3, Pose, Vec3};
use palmares_sim::Config;
use palmares_sim::config::BaseConfig;
use std::path::Path;
use std::sync::Arc;

/// Springs of the firm SoftHand, in those of the built-in hand; its drive: N·m at R = 1, 1/s.
const FIRM_SPRINGS: f64 = 2.0;
const FIRM_DRIVE: (f64, f64) = (2.0, 2.0);

/// The SoftHand of the cases: the built-in hand with the springs of its published URDF, and a drive four times as strong as the
/// real one's. So the figures of a case do not change when the built-in hand is calibrated anew, and a hand that presses hard
/// is the harder test of an engine.
pub fn softhand() -> Result<Arc<Hand>> {
    let mut hand = Hand::clone(&*Hand::builtin("softhand").context("the SoftHand is built in")?);
    hand.coordinates.iter_mut().for_each(|coordinate| coordinate.stiffness *= FIRM_SPRINGS);
    (hand.tendons[0].force_limit, hand.motors[0].speed_limit) = FIRM_DRIVE;
    // No load slows it: other engines have no such motors.
    (hand.motors[0].stall_force, hand.motors[0].power_limit) = (None, None);
    Ok(Arc::new(hand))
}

/// How [`softhand`] differs from the built-in hand, for pages whose scenes have it.
pub fn softhand_in_words() -> String {
    Hand::builtin("softhand").map_or_else(String::new, |built_in| {
        format!(
            "The SoftHand of these scenes is firmer than the built-in one, a harder test: its springs are {FIRM_SPRINGS} times as stiff, \
             and its drive has {} N·m instead of {}, which no load slows, since the other engines have no such motors.",
            FIRM_DRIVE.0, built_in.tendons[0].force_limit
        )
    })
}

/// A built-in hand by its name, or one from a folder.
///
/// # Errors
/// There is neither.
pub fn hand(name: &str) -> Result<Arc<Hand>> {
    match Hand::builtin(name) {
        Some(hand) => Ok(hand),
        None => Ok(Arc::new(read::hand(Path::new(name), &LoadOptions::default())?.hand)),
    }
}

/// Limits that are never reached, rad or m.
pub const WIDE: f64 = 1e3;

/// Constants under which the base is bolted to its set point.
pub fn bolted(config: Config) -> Config {
    Config { base: BaseConfig { bolted: true, ..config.base }, ..config }
}

/// The stock SoftHand as a bare chain: no shapes to touch with, no dampers, no limits, its weight not compensated,
/// the tendon paid out. With or without its springs.
pub fn bare_chain(springs: bool) -> Result<Hand> {
    let mut hand = Hand::clone(&*softhand()?);
    hand.gravity_compensation = false;
    for link in &mut hand.links {
        link.geoms.clear();
    }
    for c in &mut hand.coordinates {
        (c.lower, c.upper, c.damping) = (-WIDE, WIDE, 0.0);
        if !springs {
            c.stiffness = 0.0;
        }
    }
    for motor in &mut hand.motors {
        motor.offset = WIDE;
    }
    Ok(hand)
}

/// A part that moves against the base along or about z, and the tendon that pulls it.
pub struct Finger {
    /// Whether it turns or slides.
    pub kind: HingeKind,
    /// Pose of its joint in the base; the axis is z.
    pub base_from_hinge: Pose,
    /// kg; its centre of mass is in the joint.
    pub mass: f64,
    /// About the joint, kg·m².
    pub inertia: f64,
    /// Stiffness, N·m/rad or N/m.
    pub stiffness: f64,
    /// Damping, N·m·s/rad or N·s/m.
    pub damping: f64,
    /// The largest tension of the tendon that pulls on it alone with R = 1.
    pub tension: f64,
    /// Its shapes.
    pub geoms: Vec<Geom>,
}

/// A base of 1 kg with fingers of one joint, each with a motor and a tendon of its own. A motor winds a unit of
/// length at once at σ = 1 and has paid out a unit at σ = 0.
pub fn fingers(name: &str, base_geoms: Vec<Geom>, fingers: Vec<Finger>) -> Result<Hand> {
    let stock = softhand()?;
    let body = |mass: f64, inertia: f64| Inertia {
        mass,
        com: Vec3::ZERO,
        about_com: Mat3::from_diagonal(Vec3::splat(inertia)),
    };
    let base = Link {
        name: "base".to_owned(),
        inertia: body(1.0, 1e-3),
        geoms: base_geoms,
        ..stock.links[0].clone()
    };
    let mut hand = Hand {
        name: name.to_owned(),
        links: vec![base],
        coordinates: Vec::new(),
        tendons: Vec::new(),
        motors: Vec::new(),
        no_collision: Vec::new(),
        tactile: Vec::new(),
        sensors: Default::default(),
        pads: Vec::new(),
        ..Hand::clone(&stock)
    };
    for (i, finger) in fingers.into_iter().enumerate() {
        let hinge = Hinge {
            parent_from_hinge: finger.base_from_hinge,
            axis: Vec3::Z,
            kind: finger.kind,
            ratio: 1.0,
            offset: 0.0,
        };
        hand.links.push(Link {
            name: format!("finger_{i}"),
            parent: Some(0),
            joint: Some(Joint { name: format!("joint_{i}"), coordinate: i, hinges: vec![hinge] }),
            inertia: body(finger.mass, finger.inertia),
            geoms: finger.geoms,
        });
        let (stiffness, damping) = (Some(finger.stiffness), Some(finger.damping));
        let stated = CoordinateSettings { stiffness, damping, ..CoordinateSettings::default() };
        let (name, numbers) = (format!("joint_{i}"), stated.numbers());
        hand.coordinates.push(Coordinate { name, lower: -WIDE, upper: WIDE, numbers });
        let cable = stock.tendons[0].clone();
        hand.tendons.push(Tendon {
            name: format!("tendon_{i}"),
            motors: vec![(i, 1.0)],
            moment_arms: vec![(i, 1.0)],
            numbers: TendonNumbers { force_limit: finger.tension, ..cable.numbers },
            ..cable
        });
        hand.motors.push(MotorSettings::plain(2.0, 0.5, 1e6).motor(&format!("motor_{i}")));
    }
    Ok(hand)
}
