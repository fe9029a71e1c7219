//! Damping of the twist of a round contact that sticks.
//!
//! A ball that rests on a small patch turns about its normal as an inertia I, kg m², on the anchor's spring `k_t a²`, N m/rad, with the
//! arm a, m. The damper of the anchor is critical for a mass, not for this turn: its ratio is `ω τ/2` with `ω = a √(k_t/I)`, about a
//! fiftieth for a ball of 4 cm, which would ring for a second. A patch of real bodies loses that motion at once in the micro-slip
//! along its rim (Mindlin and Deresiewicz 1953). So its way back is damped critically,
//!
//! `c = 2 √(k_t a² I)`, N m s,
//!
//! with 1/I the sum over the bodies that are objects. The part of c beyond the anchor's own takes the rate at the start of the step; it
//! is within the cone of friction like the rest, and acts only where the contact stuck in the step before.

use crate::contact::narrow_phase::{ContactPair, ContactPoint};
use crate::dynamics::hand::HandDynamics;
use crate::model::{Model, Owner};
use crate::state::State;

/// The largest part of a turn's rate that the damping of one contact takes in a step: it uses the rate before the step.
const MOST: f64 = 0.1;

/// Velocity by which the damping shifts the target of spin, m/s at the arm, m, of an anchor with dissipation time τ, s.
pub(super) fn shift(
    (model, state, dynamics): (&Model, &State, &HandDynamics),
    pair: &ContactPair,
    point: &ContactPoint,
    (arm, tau): (f64, f64),
) -> f64 {
    if !point.anchor.loaded || point.anchor.slip > 0.0 {
        return 0.0;
    }
    let normal = point.normal;
    let (mut yielding, mut rate) = (0.0, 0.0);
    for (owner, sign) in [(pair.a, -1.0), (pair.b, 1.0)] {
        match owner {
            Owner::Static => {}
            Owner::Link(i) => rate += sign * dynamics.recursion.velocity[i].angular.dot(normal),
            Owner::Object(k) => {
                let local = state.objects[k].rotation.inverse() * normal;
                yielding += local.dot(model.object_inertia_inverse(k) * local);
                rate += sign * state.object_velocity(model, k).1.dot(normal);
            }
        }
    }
    // Friction alone stops a spin: only the way back is damped. Links turn with their joints, which have dampers of their own.
    if point.anchor.twist * rate >= 0.0 || yielding == 0.0 {
        return 0.0;
    }
    let config = model.config();
    let h = config.step_s;
    let stiffness = config.anchor_stiffness * arm * arm;
    let own = stiffness * (h + tau);
    let critical = 2.0 * (stiffness / yielding).sqrt();
    let more = (critical - own).clamp(0.0, MOST / (yielding * h));
    arm * rate * more / own
}

#[cfg(test)]
mod tests {
    use crate::{Command, Config, Model, State, World};
    use palmares_models::Pose;
    use palmares_models::object::Object;
    use palmares_models::shape::Shape;
    use std::sync::Arc;

    /// A ball that turns slowly about the vertical twists its contact by less than what friction holds, comes back to where
    /// it was held, and does not ring: without the damping it keeps two thirds of its rate after 0.3 s.
    #[test]
    fn a_ball_that_sticks_does_not_ring() {
        for step_s in [0.25e-3, 1e-3, 4e-3] {
            let mut model =
                Model::new(Config { sleeping: false, ..Config::with_step(step_s) }, None).expect("no hand");
            model.add_ground(0.0, 0.5);
            let parts = vec![(Pose::IDENTITY, Shape::Sphere { radius: 0.04 })];
            let ball = Object::new("ball", parts, 0.13, 0.6, 5e-4).expect("a ball");
            model
                .add_object(Arc::new(ball.with_torsional_friction(5e-4).expect("a lever")))
                .expect("it fits");
            let state = State::at_rest(&model, Pose::IDENTITY, &[Pose::translation(0.0, 0.0, 0.04)]);
            let mut world = World::new(Arc::new(model), state);
            let command = Command::stay(world.model(), Pose::IDENTITY);
            let steps = |time_s: f64| (time_s / step_s).round() as usize;
            for _ in 0..steps(0.1) {
                world.step(&command);
            }
            let mut state = world.state().clone();
            state.v[5] = 0.03;
            let mut world = World::new(Arc::clone(world.model()), state);
            for _ in 0..steps(0.3) {
                world.step(&command);
            }
            let mut most: f64 = 0.0;
            for _ in 0..steps(0.3) {
                world.step(&command);
                most = most.max(world.state().v[5].abs());
            }
            assert!(most < 0.1 * 0.03, "{most} rad/s with steps of {step_s} s");
        }
    }
}
