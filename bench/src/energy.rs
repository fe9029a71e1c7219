//! The parts of a world's energy, and the works that change it.
//!
//! Works are forces of the solved step times displacements over it, for every integrator. Works of contacts
//! are impulses times mean velocities, so that the loss of an impact counts as well.

use palmares_models::Vec3;
use palmares_sim::actuation::base::shortest_turn;
use palmares_sim::dynamics::crba::Inertias;
use palmares_sim::dynamics::jacobian::{add_link_torque, add_point_force};
use palmares_sim::dynamics::tree::Kinematics;
use palmares_sim::{Command, Model, Owner, State, World};

/// Energies of a state, J.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stored {
    /// Kinetic energy of all bodies, J.
    pub kinetic: f64,
    /// In the joint springs.
    pub springs: f64,
    /// In the tendons: `½ K x²` up to the largest tension, linear beyond.
    pub tendons: f64,
    /// Potential energy of weight, J, without that of a hand that compensates its own.
    pub height: f64,
}

impl Stored {
    /// The stored energy of a state.
    pub fn of(model: &Model, state: &State) -> Stored {
        let gravity = model.config().gravity;
        let mut sum = Stored::default();
        if let Some(hand) = model.hand() {
            let (mut kin, mut inertias, mut velocity) =
                (Kinematics::default(), Inertias::default(), Vec::new());
            kin.update(hand, state.base, &state.q);
            inertias.update(hand, &kin, 0);
            kin.velocities(hand, &state.v[..model.hand_dofs()], &mut velocity);
            for (i, link) in hand.links.iter().enumerate() {
                sum.kinetic += 0.5 * velocity[i].dot(inertias.link[i].mul(velocity[i]));
                if !hand.gravity_compensation {
                    let com = kin.pose[i].transform_point(link.inertia.com);
                    sum.height -= link.inertia.mass * gravity.dot(com);
                }
            }
            for (q, c) in state.q.iter().zip(&hand.coordinates) {
                sum.springs += 0.5 * c.stiffness * (q - c.rest).powi(2);
            }
            for spring in &hand.springs {
                sum.springs += 0.5 * spring.stiffness * spring.stretch(&state.q).powi(2);
            }
            for pin in &hand.linkages {
                sum.springs += 0.5 * pin.stiffness * pin.at(hand, &state.q).gap.length_squared();
            }
            for (tendon, (wound, s)) in hand.tendons.iter().zip(lengths(model, state)) {
                let most = tendon.force_limit / tendon.stiffness;
                let x = if tendon.both_ways { (wound - s).abs() } else { (wound - s).max(0.0) };
                sum.tendons += if x < most {
                    0.5 * tendon.stiffness * x * x
                } else {
                    tendon.force_limit * (x - 0.5 * most)
                };
            }
        }
        for (k, object) in model.objects().iter().enumerate() {
            let (linear, angular) = state.object_velocity(model, k);
            let own = state.objects[k].rotation.inverse() * angular;
            sum.kinetic += 0.5 * object.mass * linear.length_squared() + 0.5 * own.dot(object.inertia * own);
            sum.height -= object.mass * gravity.dot(state.objects[k].translation);
        }
        sum
    }

    /// The sum.
    pub fn total(&self) -> f64 {
        self.kinetic + self.springs + self.tendons + self.height
    }
}

/// Wound length and s(q) of every tendon.
fn lengths(model: &Model, state: &State) -> Vec<(f64, f64)> {
    let Some(hand) = model.hand() else { return Vec::new() };
    let of = |tendon: &palmares_models::hand::Tendon| {
        let wound = tendon.wound(&hand.motors, |motor| state.motors[motor].position);
        (wound, tendon.length(&state.q))
    };
    hand.tendons.iter().map(of).collect()
}

/// Energy that came and went since the start, J.
#[derive(Clone, Copy, Debug, Default)]
pub struct Works {
    /// By the motors on the tendons, `∮ f ds_ref`.
    pub motors: f64,
    /// By the servo on the base.
    pub servo: f64,
    /// By pushes.
    pub pushes: f64,
    /// By contact forces on the bodies: negative where impacts and friction take it.
    pub contacts: f64,
    /// By the joint dampers: never positive.
    pub dampers: f64,
}

/// Follows a world step by step.
pub struct Ledger {
    before: State,
    kin: Kinematics,
    wound: Vec<f64>,
    /// Works since the start.
    pub works: Works,
}

impl Ledger {
    /// Starts now.
    pub fn new(world: &World) -> Self {
        let (model, state) = (world.model(), world.state());
        let mut ledger = Ledger {
            before: state.clone(),
            kin: Kinematics::default(),
            wound: lengths(model, state).iter().map(|x| x.0).collect(),
            works: Works::default(),
        };
        ledger.read(model);
        ledger
    }

    fn read(&mut self, model: &Model) {
        if let Some(hand) = model.hand() {
            self.kin.update(hand, self.before.base, &self.before.q);
        }
    }

    /// Adds the step that the world has just taken under `command`.
    pub fn step(&mut self, world: &World, command: &Command) {
        let (model, state) = (world.model(), world.state());
        let h = model.config().step_s;
        let before = &self.before;
        let mean: Vec<f64> = before.v.iter().zip(&state.v).map(|(a, b)| 0.5 * (a + b)).collect();
        let mut tau = vec![0.0; model.hand_dofs()];
        for contact in world.contact_forces() {
            for (owner, sign) in [(contact.a, -1.0), (contact.b, 1.0)] {
                match (owner, model.hand()) {
                    (Owner::Link(i), Some(hand)) => {
                        for (at, force) in contact.parts() {
                            add_point_force(hand, &self.kin, i, at, force, sign, &mut tau);
                        }
                        add_link_torque(hand, &self.kin, i, contact.torque, sign, &mut tau);
                    }
                    (Owner::Object(k), _) => {
                        let v = &mean[model.object_dofs(k)..];
                        for (place, force) in contact.parts() {
                            let r = place - before.objects[k].translation;
                            let at = Vec3::new(v[0], v[1], v[2]) + Vec3::new(v[3], v[4], v[5]).cross(r);
                            self.works.contacts += h * sign * force.dot(at);
                        }
                        self.works.contacts += h * sign * contact.torque.dot(Vec3::new(v[3], v[4], v[5]));
                    }
                    _ => {}
                }
            }
        }
        self.works.contacts += h * tau.iter().zip(&mean).map(|(t, v)| t * v).sum::<f64>();
        if let Some(hand) = model.hand() {
            let links = hand.base_from_links(&state.q);
            for push in &command.pushes {
                let at = self.kin.pose[push.link].transform_point(push.point);
                let to = (state.base * links[push.link]).transform_point(push.point);
                self.works.pushes += push.force.dot(to - at);
            }
            let (force, torque) = world.servo_wrench();
            let travel = state.base.translation - before.base.translation;
            let turn = shortest_turn(before.base.rotation, state.base.rotation);
            self.works.servo += Vec3::from_array(force).dot(travel) + Vec3::from_array(torque).dot(turn);
            let wound: Vec<f64> = lengths(model, state).iter().map(|x| x.0).collect();
            for (k, tension) in state.tension.iter().enumerate() {
                self.works.motors += tension * (wound[k] - self.wound[k]);
            }
            self.wound = wound;
            for (i, c) in hand.coordinates.iter().enumerate() {
                self.works.dampers -= c.damping * (state.q[i] - before.q[i]).powi(2) / h;
            }
        }
        self.before.clone_from(state);
        self.read(model);
    }
}
