//! What a run looks like from inside, for those who watch: motors, tendons, contacts, and the predicted equilibrium.
//!
//! Where the world is stepped it is copied as it stands ([`Readings`]); [`Instruments`], which outlive no run but may be
//! shared with any thread, make of it what is shown.

use super::Run;
use super::predictor::Predictor;
use crate::scene::Scene;
use palmares_models::Pose;
use palmares_models::hand::Hand;
use palmares_sim::state::MotorState;
use palmares_sim::{ContactForce, Model, Owner};
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A copy of what the readers of a moment need.
#[derive(Clone, Debug, PartialEq)]
pub struct Readings {
    motors: Vec<MotorState>,
    tension: Vec<f64>,
    q: Vec<f64>,
    /// None if they were not wanted.
    contacts: Option<Vec<ContactForce>>,
}

impl Readings {
    /// Whether the contacts were wanted when they were taken.
    pub fn with_contacts(&self) -> bool {
        self.contacts.is_some()
    }
}

/// What a motor is told and does.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Motor {
    /// Commanded σ.
    pub command: f64,
    /// σ the motor has reached.
    pub position: f64,
    /// Tension of its tendons, in the tendon's unit (hand.toml); negative where a drive pushes.
    pub tension: f64,
}

/// What goes on in a hand.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Telemetry {
    /// Every motor, in the hand's order.
    pub motors: Vec<Motor>,
    /// Tension of every tendon, in the tendon's unit (hand.toml).
    pub tension: Vec<f64>,
    /// The hand's coordinates, rad.
    pub q: Vec<f64>,
    /// Where the free hand would rest at the present motor position, rad; empty if that is not defined.
    pub predicted: Vec<f64>,
}

/// A touching contact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Contact {
    /// Id of the first body: those of the scene, then the hand's links.
    pub a: usize,
    /// Id of the second body.
    pub b: usize,
    /// Place in the world, m.
    pub position: [f64; 3],
    /// Force on `b`, N.
    pub force: [f64; 3],
    /// How much of its friction is used, |f_t| / (μ f_n): at 1 it slips.
    #[serde(rename = "use")]
    pub friction_use: f64,
}

/// What does not change in a run and is needed to read its [`Readings`].
#[derive(Debug)]
pub struct Instruments {
    hand: Arc<Hand>,
    predictor: Predictor,
    /// Id of the first link's body.
    first_link: usize,
    /// Body and friction coefficient by collider.
    colliders: Vec<(usize, f64)>,
}

impl Instruments {
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
        Instruments {
            colliders: colliders.collect(),
            first_link,
            predictor: Predictor::new(hand.clone()),
            hand,
        }
    }

    /// The hand.
    pub fn hand(&self) -> &Arc<Hand> {
        &self.hand
    }

    /// World poses of the bodies that can move, in the order of [`Run::poses`]: the objects as given, then the hand's
    /// links.
    pub fn poses(&self, base: Pose, q: &[f64], objects: &[Pose]) -> Vec<(usize, Pose)> {
        let links = self.hand.base_from_links(q).into_iter().map(|base_from_link| base * base_from_link);
        let links = links.enumerate().map(|(k, pose)| (self.first_link + k, pose));
        objects.iter().copied().enumerate().chain(links).collect()
    }

    /// What goes on in the hand.
    pub fn telemetry(&self, seen: &Readings) -> Telemetry {
        let motors = seen.motors.iter().enumerate().map(|(k, reached)| Motor {
            command: reached.command,
            position: reached.position,
            tension: motor_tension(&self.hand, k, &seen.tension),
        });
        Telemetry {
            motors: motors.collect(),
            tension: seen.tension.clone(),
            q: seen.q.clone(),
            predicted: self.predict(&seen.motors),
        }
    }

    /// Every touching contact.
    pub fn contacts(&self, seen: &Readings) -> Vec<Contact> {
        let side = |collider: u32| self.colliders.get(collider as usize).copied().unwrap_or_default();
        seen.contacts
            .iter()
            .flatten()
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

    /// Where the free hand would rest.
    pub(super) fn predict(&self, motors: &[MotorState]) -> Vec<f64> {
        self.predictor.predict(|motor| motors[motor].position)
    }
}

/// Tension of a motor's tendons together.
pub(super) fn motor_tension(hand: &Hand, motor: usize, tension: &[f64]) -> f64 {
    hand.tendons.iter().zip(tension).filter(|(tendon, _)| tendon.motor == motor).map(|(_, f)| f).sum()
}

/// What is beyond all measure is told as this.
const MOST_USE: f64 = 1e3;

/// |f_t| / (μ f_n), at most [`MOST_USE`]; 0 without a force across.
fn friction_use(contact: &ContactForce, friction: f64) -> f64 {
    let along = contact.force.dot(contact.normal);
    let across = (contact.force - contact.normal * along).length();
    if across == 0.0 { 0.0 } else { (across / (friction * along.max(0.0))).min(MOST_USE) }
}

impl Run {
    /// What [`Run::readings`] are read with.
    pub fn instruments(&self) -> &Arc<Instruments> {
        &self.instruments
    }

    /// A copy of what watchers may ask about this moment; the contacts only if they are wanted.
    pub fn readings(&self, contacts: bool) -> Readings {
        let state = self.world.state();
        Readings {
            motors: state.motors.clone(),
            tension: state.tension.clone(),
            q: state.q.clone(),
            contacts: contacts.then(|| self.world.contact_forces().to_vec()),
        }
    }

    /// What goes on in the hand.
    pub fn telemetry(&self) -> Telemetry {
        self.instruments.telemetry(&self.readings(false))
    }

    /// Every touching contact.
    pub fn contacts(&self) -> Vec<Contact> {
        self.instruments.contacts(&self.readings(true))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observation::Sensing;
    use crate::{Action, BaseTarget, Seed, Task};
    use palmares_sim::model::pair_friction;

    fn run() -> Run {
        let task = Task::builtin().into_iter().find(|task| task.name == "balls").expect("balls");
        let mut run =
            Run::new(task, Hand::builtin("softhand").expect("built in"), Seed::from_u64(3)).expect("a scene");
        for tick in 0..150 {
            let z = (0.6 - 0.004 * f64::from(tick)).max(0.2);
            let base = BaseTarget::Pose { position: [0.0, 0.0, z], quat_xyzw: [0.0, 1.0, 0.0, 0.0] };
            run.step(&Action { base: Some(base), hand: Some(vec![0.5]) }).expect("valid");
        }
        run
    }

    #[test]
    fn it_tells_what_the_controller_is_told_with_the_bodies_ids() {
        let run = run();
        let seen = run.observe(Sensing::Truth);
        let truth = seen.truth.expect("the truth");
        let told = run.telemetry();
        assert_eq!((&told.q, &told.predicted), (&truth.joints.position.0, &truth.predicted_equilibrium.0));
        for (motor, seen) in told.motors.iter().zip(&seen.hand.actuators) {
            assert_eq!(
                (motor.command, motor.position, motor.tension),
                (seen.command, seen.position, seen.tension)
            );
        }
        let names: Vec<String> = run
            .scene()
            .bodies
            .iter()
            .map(|body| body.name.clone())
            .chain(run.hand_bodies().into_iter().map(|link| link.name))
            .collect();
        let contacts = run.contacts();
        assert_eq!(contacts.len(), truth.contacts.a.len());
        assert!(contacts.len() > 10, "the balls lie in a box");
        for (k, contact) in contacts.iter().enumerate() {
            assert_eq!((&names[contact.a], &names[contact.b]), (&truth.contacts.a[k], &truth.contacts.b[k]));
            assert_eq!(contact.force, truth.contacts.force.0[k]);
            assert!(contact.friction_use >= 0.0 && contact.friction_use < 1.001, "{contact:?}");
        }
    }

    #[test]
    fn the_poses_are_those_of_the_run() {
        let run = run();
        let (model, state) = (run.world().model(), run.world().state());
        let objects: Vec<Pose> = (0..state.objects.len()).map(|k| state.object_pose(model, k)).collect();
        let told = run.instruments().poses(state.base, &state.q, &objects);
        assert_eq!(told, run.poses().collect::<Vec<_>>());
    }

    #[test]
    fn half_of_the_friction_is_a_half() {
        let run = run();
        let (colliders, touching) = (run.world().model().colliders(), run.world().contact_forces());
        let contact = touching[0];
        let friction =
            pair_friction(&colliders[contact.colliders.0 as usize], &colliders[contact.colliders.1 as usize]);
        let across = contact.normal.any_orthonormal_vector() * 0.5 * friction * 8.0;
        let pressed = ContactForce { force: contact.normal * 8.0 + across, ..contact };
        let readings = Readings { contacts: Some(vec![pressed]), ..run.readings(false) };
        let used = run.instruments().contacts(&readings)[0].friction_use;
        assert!((used - 0.5).abs() < 1e-12, "{used}");
        let free = ContactForce { force: contact.normal * 0.0, ..contact };
        assert_eq!(friction_use(&free, friction), 0.0);
    }
}
