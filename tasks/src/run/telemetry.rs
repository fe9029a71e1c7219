//! Telemetry of a run for viewers and replays: motors, tendons, contacts, readings, and the predicted equilibrium.
//!
//! The thread that steps the world copies its state to a [`RunSample`]. A [`TelemetryModel`] computes telemetry from it, on any
//! thread.

use super::predictor::Predictor;
use crate::scene::Scene;
use palmares_models::hand::Hand;
use palmares_models::hand::fingers::Finger;
use palmares_models::{Pose, Vec3};
use palmares_senses::channels::touch;
use palmares_sim::state::MotorState;
use palmares_sim::statics::drives::wound_in;
use palmares_sim::{ContactForce, Model, Owner};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A copy of the state from which telemetry is computed.
#[derive(Clone, Debug, PartialEq)]
pub struct RunSample {
    pub(super) motors: Vec<MotorState>,
    /// Wound lengths at which clutches let go.
    pub(super) locked: Vec<Option<f64>>,
    pub(super) tension: Vec<f64>,
    pub(super) motor_work_j: Vec<f64>,
    pub(super) base: Pose,
    pub(super) q: Vec<f64>,
    pub(super) contacts: Vec<ContactForce>,
    pub(super) readings: Vec<f64>,
}

/// State of a motor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Motor {
    /// Commanded σ.
    pub command: f64,
    /// σ the motor has reached.
    pub position: f64,
    /// Tension of its tendons, in the tendon's unit (hand.toml); negative where a drive pushes.
    pub tension: f64,
    /// Work on its tendons since reset, ∫ f ds, J.
    #[serde(rename = "work")]
    pub motor_work_j: f64,
}

/// Load of a finger.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FingerWrench {
    /// Name of the finger's first link.
    pub name: String,
    /// Sum of the forces of all contacts on its links, world frame, N.
    pub force: [f64; 3],
    /// Their torque about the origin of the hand's base, world frame, N·m.
    pub torque: [f64; 3],
}

/// Telemetry of a hand.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Telemetry {
    /// Every motor, in the hand's order.
    pub motors: Vec<Motor>,
    /// Tension of every tendon, in the tendon's unit (hand.toml).
    pub tension: Vec<f64>,
    /// The hand's coordinates, rad.
    pub q: Vec<f64>,
    /// Equilibrium of the free hand at the present motor position, rad; empty if it is not defined.
    pub predicted: Vec<f64>,
    /// Load of each finger.
    pub fingers: Vec<FingerWrench>,
    /// Force on every taxel without the errors of a sensor, N: along x and y of its patch, and into it.
    pub touch: Vec<[f64; 3]>,
    /// Readings without the errors of sensors: the channels that the scene's `readings` lists, one after the other.
    pub readings: Vec<f64>,
}

/// A touching contact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Contact {
    /// Id of the first body: those of the scene, then the hand's links.
    pub a: usize,
    /// Id of the second body.
    pub b: usize,
    /// Place in the world, m.
    pub position: [f64; 3],
    /// Force on `b`, N.
    pub force: [f64; 3],
    /// Used part of its friction, |f_t| / (μ f_n): at 1 it slips.
    #[serde(rename = "use")]
    pub friction_use: f64,
}

/// The constants of a run that [`RunSample`]s are read with.
#[derive(Debug)]
pub struct TelemetryModel {
    hand: Arc<Hand>,
    fingers: Vec<Finger>,
    predictor: Predictor,
    /// Id of the first link's body.
    first_link: usize,
    /// Body and friction coefficient by collider.
    colliders: Vec<(usize, f64)>,
}

impl TelemetryModel {
    pub(super) fn new(hand: Arc<Hand>, model: &Model, scene: &Scene, names: &[String]) -> Self {
        let first_link = scene.bodies.len();
        let furniture: BTreeMap<&str, usize> =
            scene.bodies.iter().filter(|body| !body.free).map(|body| (body.name.as_str(), body.id)).collect();
        let colliders = model.colliders().iter().zip(names).map(|(collider, name)| {
            let body = match collider.owner {
                Owner::Link(link) => first_link + link,
                Owner::Object(object) => object,
                Owner::Static => furniture.get(name.as_str()).copied().unwrap_or_default(),
            };
            (body, collider.friction)
        });
        TelemetryModel {
            colliders: colliders.collect(),
            first_link,
            predictor: Predictor::new(hand.clone()),
            fingers: hand.fingers(),
            hand,
        }
    }

    /// The hand.
    pub fn hand(&self) -> &Arc<Hand> {
        &self.hand
    }

    /// World poses of the bodies that can move, in the order of [`crate::Run::poses`]: the objects as given, then the hand's
    /// links.
    pub fn poses(&self, base: Pose, q: &[f64], objects: &[Pose]) -> Vec<(usize, Pose)> {
        let links = self.hand.base_from_links(q).into_iter().map(|base_from_link| base * base_from_link);
        let links = links.enumerate().map(|(k, pose)| (self.first_link + k, pose));
        objects.iter().copied().enumerate().chain(links).collect()
    }

    /// The telemetry of a sample.
    pub fn telemetry(&self, sample: &RunSample) -> Telemetry {
        let motors = sample.motors.iter().enumerate().map(|(k, reached)| Motor {
            command: reached.command,
            position: reached.position,
            tension: self.hand.motor_load(k, &sample.tension),
            motor_work_j: sample.motor_work_j[k],
        });
        Telemetry {
            motors: motors.collect(),
            tension: sample.tension.clone(),
            q: sample.q.clone(),
            predicted: self.predict(&sample.motors, &sample.locked),
            fingers: self.fingers.iter().map(|finger| wrench(finger, sample)).collect(),
            touch: self.touch(sample),
            readings: sample.readings.clone(),
        }
    }

    fn touch(&self, sample: &RunSample) -> Vec<[f64; 3]> {
        if self.hand.tactile.is_empty() {
            return Vec::new();
        }
        let links = self.hand.base_from_links(&sample.q).into_iter().map(|link| sample.base * link);
        touch::forces(&self.hand, &links.collect::<Vec<_>>(), &sample.contacts)
    }

    /// Every touching contact.
    pub fn contacts(&self, sample: &RunSample) -> Vec<Contact> {
        let side = |collider: u32| self.colliders.get(collider as usize).copied().unwrap_or_default();
        sample
            .contacts
            .iter()
            .map(|contact| {
                let ((a, friction_a), (b, friction_b)) =
                    (side(contact.colliders.0), side(contact.colliders.1));
                Contact {
                    a,
                    b,
                    position: contact.position.to_array(),
                    force: contact.force.to_array(),
                    friction_use: friction_use(contact, (friction_a * friction_b).sqrt()),
                }
            })
            .collect()
    }

    /// The predicted equilibrium of the free hand.
    pub(super) fn predict(&self, motors: &[MotorState], locked: &[Option<f64>]) -> Vec<f64> {
        self.predictor.predict(&wound_in(&self.hand, motors, locked))
    }
}

fn wrench(finger: &Finger, sample: &RunSample) -> FingerWrench {
    let (mut force, mut torque) = (Vec3::ZERO, Vec3::ZERO);
    for contact in &sample.contacts {
        for (owner, sign) in [(contact.a, -1.0), (contact.b, 1.0)] {
            if let Owner::Link(link) = owner
                && finger.links.contains(&link)
            {
                force += contact.force * sign;
                torque += contact.torque * sign;
                for (at, part) in contact.parts() {
                    torque += (at - sample.base.translation).cross(part * sign);
                }
            }
        }
    }
    FingerWrench { name: finger.name.clone(), force: force.to_array(), torque: torque.to_array() }
}

/// Largest friction use.
const MAX_FRICTION_USE: f64 = 1e3;

/// |f_t| / (μ f_n), at most [`MAX_FRICTION_USE`]; 0 without a force across.
pub(super) fn friction_use(contact: &ContactForce, friction: f64) -> f64 {
    let along = contact.force.dot(contact.normal);
    let across = (contact.force - contact.normal * along).length();
    if across == 0.0 { 0.0 } else { (across / (friction * along.max(0.0))).min(MAX_FRICTION_USE) }
}
