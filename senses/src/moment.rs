//! Input of the sensors of a hand: its state at a moment.

use palmares_models::hand::Hand;
use palmares_models::{Pose, Vec3};
use palmares_sim::state::MotorState;
use palmares_sim::{ContactForce, World};
use std::cell::OnceCell;

/// The state of a hand, and the forces on it in the last step.
#[derive(Debug)]
pub struct Moment<'a> {
    /// The hand.
    pub hand: &'a Hand,
    /// World from base.
    pub base: Pose,
    /// Velocity of the base's origin, m/s.
    pub linear: Vec3,
    /// Angular velocity of the base, rad/s.
    pub angular: Vec3,
    /// The hand's coordinates, rad.
    pub q: &'a [f64],
    /// Their velocities, rad/s.
    pub velocity: &'a [f64],
    /// Every motor.
    pub motors: &'a [MotorState],
    /// Tension of every tendon, in its unit.
    pub tension: &'a [f64],
    /// Every touching contact.
    pub contacts: &'a [ContactForce],
    /// Force (N) and torque (N·m) of the base's servo, world frame, torque about the base's origin.
    pub servo: (Vec3, Vec3),
    /// m/s²
    pub gravity: Vec3,
    links: OnceCell<Vec<Pose>>,
}

impl<'a> Moment<'a> {
    /// The present moment of a world with this hand.
    pub fn of(hand: &'a Hand, world: &'a World) -> Self {
        let state = world.state();
        let v = |k: usize| Vec3::new(state.v[k], state.v[k + 1], state.v[k + 2]);
        let (force, torque) = world.servo_wrench();
        Moment {
            hand,
            base: state.base,
            linear: v(0),
            angular: v(3),
            q: &state.q,
            velocity: &state.v[6..6 + state.q.len()],
            motors: &state.motors,
            tension: &state.tension,
            contacts: world.contact_forces(),
            servo: (Vec3::from_array(force), Vec3::from_array(torque)),
            gravity: world.model().config().gravity,
            links: OnceCell::new(),
        }
    }

    /// World poses of the hand's links. Computed once, for the first channel that needs them.
    pub fn links(&self) -> &[Pose] {
        self.links.get_or_init(|| {
            let links = self.hand.base_from_links(self.q).into_iter();
            links.map(|base_from_link| self.base * base_from_link).collect()
        })
    }
}
