//! Instruments of a person who measures a hand: a body that the hand closes on while the person holds it, its force between
//! halves, the torque that turns it, the force that pulls it out.

use super::setup::{Setup, ends_of_steps, ramp, steps};
use crate::engine::Engine;
use crate::recorder::Recorder;
use crate::rigs::bolted;
use anyhow::{Context, Result};
use palmares_models::hand::{Hand, MotorNumbers};
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Vec3};
use palmares_sim::{Command, Config, ContactForce, Model, Owner, State, World};
use std::f64::consts::PI;
use std::sync::Arc;

/// Mass of the body, kg. Without gravity it only sets how fast the body follows the fingers.
pub const MASS: f64 = 0.1;
/// The motors' command reaches its end after this time, s; the reading begins and ends. A motor that its load slows takes
/// seconds for the last percent of its force.
const CLOSED_S: f64 = 1.5;
const READ_S: f64 = 4.8;
const READ_END_S: f64 = 5.0;
/// The person's grasp of the body until the hand has closed: as a spring about its place, critically damped, N/m and
/// N·m/rad, with at most this force, N, and torque, N·m. It lets go between these times, s. Guesses: a hand that is let
/// alone pushes a thin body out with its first finger.
const PERSON: f64 = 500.0;
const PERSON_TURN: f64 = 1.0;
const PERSON_MOST: (f64, f64) = (20.0, 1.0);
const LETS_GO_S: (f64, f64) = (3.0, 3.5);
/// The body is lost when its centre has moved by this, m, or when less than this force holds it, N.
const LOST_M: f64 = 0.06;
const LOST_N: f64 = 0.1;
/// Planes through a cylinder's axis over which a force is averaged.
const PLANES: usize = 36;

/// Our constants without gravity, and the wrist fixed.
pub fn weightless(dt_s: f64) -> Config {
    bolted(Config { gravity: Vec3::ZERO, sleeping: false, ..Config::with_step(dt_s) })
}

/// A body of one shape for the instruments.
///
/// # Errors
/// The shape has no volume.
pub fn body(shape: &Shape, friction: f64) -> Result<Arc<Object>> {
    Ok(Arc::new(Object::new("body", vec![(Pose::IDENTITY, shape.clone())], MASS, friction, 0.0)?))
}

/// Commands of all motors before and after the closing.
#[derive(Clone, Debug)]
pub struct Closing {
    /// σ of an open hand.
    pub opened: Vec<f64>,
    /// σ of the closed one.
    pub closed: Vec<f64>,
}

impl Closing {
    /// Every motor from where it starts to the full command.
    pub fn full(hand: &Hand) -> Self {
        let opened = (0..hand.motors.len()).map(|motor| hand.start.sigma_of(motor)).collect();
        Closing { opened, closed: vec![1.0; hand.motors.len()] }
    }

    fn at(&self, part: f64, sigma: &mut [f64]) {
        for (sigma, (opened, closed)) in sigma.iter_mut().zip(self.opened.iter().zip(&self.closed)) {
            *sigma = opened + part * (closed - opened);
        }
    }
}

/// A body in a hand that has closed.
pub struct Held {
    world: Box<dyn Engine>,
    command: Command,
    placed: Pose,
}

/// The world of our engine; other engines do not report their forces and works.
///
/// # Errors
/// The engine is another.
pub fn own(world: &dyn Engine) -> Result<&World> {
    world.world().context("only our own engine reports its forces")
}

/// Force of the hand on the body at every touching point.
fn forces(world: &World) -> Vec<(Vec3, Vec3)> {
    let on_body = |c: &ContactForce| match (c.a, c.b) {
        (Owner::Object(0), _) => Some((c.position, -c.force)),
        (_, Owner::Object(0)) => Some((c.position, c.force)),
        _ => None,
    };
    world.contact_forces().iter().filter_map(on_body).collect()
}

/// The force that a sensor between the halves of a body reads, pressed together positive. The plane through `centre` with
/// this normal splits the body; each half passes on what presses on it. Half the sum, as both halves are at rest.
pub fn between_halves(forces: &[(Vec3, Vec3)], centre: Vec3, normal: Vec3) -> f64 {
    let on = |(at, force): &(Vec3, Vec3)| {
        let along = force.dot(normal);
        if (*at - centre).dot(normal) > 0.0 { -along } else { along }
    };
    0.5 * forces.iter().map(on).sum::<f64>()
}

impl Held {
    /// Plays the closing of the hand of `model` on its only object, which a person holds and then lets go.
    ///
    /// # Errors
    /// The engine fails.
    pub fn close(
        setup: &Setup,
        recorder: &mut Recorder,
        (model, state, base): (Model, State, Pose),
        closing: &Closing,
    ) -> Result<Held> {
        let world = setup.start(model, state)?;
        let command = Command::stay(world.model(), base);
        let placed = world.state().objects[0];
        let mut held = Held { world, command, placed };
        for t in ends_of_steps(READ_S, setup.dt_s) {
            closing.at(ramp(t / CLOSED_S).0, &mut held.command.sigma);
            let (from, to) = LETS_GO_S;
            held.person(((to - t) / (to - from)).clamp(0.0, 1.0));
            held.step(recorder)?;
        }
        Ok(held)
    }

    /// A person holds the body at its place during the next step, with this part of the full grasp.
    fn person(&mut self, part: f64) {
        if part == 0.0 {
            return;
        }
        let (state, model) = (self.world.state(), self.world.model());
        let (pose, (linear, angular)) = (state.objects[0], state.object_velocity(model, 0));
        let inertia = model.objects()[0].inertia;
        let least = inertia.x_axis.x.min(inertia.y_axis.y).min(inertia.z_axis.z);
        let damping = |stiffness: f64, mass: f64| 2.0 * (stiffness * mass).sqrt();
        let away = pose.translation - self.placed.translation;
        // Twice the vector part is the turn of a small angle; its sign makes the shorter way.
        let q = pose.rotation * self.placed.rotation.inverse();
        let turned = 2.0 * q.w.signum() * Vec3::new(q.x, q.y, q.z);
        let force = -PERSON * away - damping(PERSON, MASS) * linear;
        let torque = -PERSON_TURN * turned - damping(PERSON_TURN, least) * angular;
        let force = force.clamp_length_max(PERSON_MOST.0) * part;
        self.world.push(0, force, torque.clamp_length_max(PERSON_MOST.1) * part);
    }

    fn step(&mut self, recorder: &mut Recorder) -> Result<()> {
        recorder.step(&mut *self.world, &self.command)
    }

    /// Whether the hand has not kept the body.
    ///
    /// # Errors
    /// The engine does not report its forces.
    pub fn lost(&self) -> Result<bool> {
        let pressed: f64 = forces(own(&*self.world)?).iter().map(|(_, force)| force.length()).sum();
        let moved = self.world.state().objects[0].translation - self.placed.translation;
        Ok(moved.length() > LOST_M || pressed < LOST_N)
    }

    /// Force between the halves of a cylinder at rest, N: the mean over the planes through its axis, then that over the
    /// plane with this normal in the hand's frame.
    ///
    /// # Errors
    /// The engine fails or does not report its forces.
    pub fn split_force(&mut self, setup: &Setup, recorder: &mut Recorder, plane: Vec3) -> Result<[f64; 2]> {
        let n = steps(READ_END_S - READ_S, setup.dt_s).max(1);
        let (mut all, mut one) = (0.0, 0.0);
        for _ in 0..n {
            self.step(recorder)?;
            let state = self.world.state();
            let (pose, base) = (state.objects[0], state.base);
            let forces = forces(own(&*self.world)?);
            for k in 0..PLANES {
                let (sin, cos) = libm::sincos(PI * k as f64 / PLANES as f64);
                let normal = pose.rotation * Vec3::new(cos, sin, 0.0);
                all += between_halves(&forces, pose.translation, normal);
            }
            one += between_halves(&forces, pose.translation, base.rotation * plane);
        }
        Ok([all / (n as usize * PLANES) as f64, one / n as f64])
    }

    /// The largest torque about the body's axis before it has turned by `angle`, N·m: it grows by `rate`, N·m/s, up to
    /// `most`.
    ///
    /// # Errors
    /// The engine fails.
    pub fn turning_torque(
        &mut self,
        setup: &Setup,
        recorder: &mut Recorder,
        (rate, angle, most): (f64, f64, f64),
    ) -> Result<f64> {
        let start = self.world.state().objects[0].rotation;
        let axis = start * Vec3::Z;
        let half_turn = libm::cos(0.5 * angle);
        let mut torque = 0.0;
        while torque < most {
            self.world.push(0, Vec3::ZERO, axis * torque);
            self.step(recorder)?;
            let turn = self.world.state().objects[0].rotation * start.inverse();
            if turn.w.abs() < half_turn {
                break;
            }
            torque += rate * setup.dt_s;
        }
        Ok(torque)
    }

    /// The largest force along `direction` of the hand's frame before the body has moved by `travel`, m, N: it grows by
    /// `rate`, N/s, up to `most`.
    ///
    /// # Errors
    /// The engine fails.
    pub fn pulling_force(
        &mut self,
        setup: &Setup,
        recorder: &mut Recorder,
        direction: Vec3,
        (rate, travel, most): (f64, f64, f64),
    ) -> Result<f64> {
        let start = self.world.state().objects[0].translation;
        let along = self.world.state().base.rotation * direction;
        let mut force = 0.0;
        while force < most {
            self.world.push(0, along * force, Vec3::ZERO);
            self.step(recorder)?;
            if (self.world.state().objects[0].translation - start).length() > travel {
                break;
            }
            force += rate * setup.dt_s;
        }
        Ok(force)
    }

    /// Winds the motors back until every tendon of one motor has half its largest tension, and lets the hand come to rest:
    /// beyond the limit a motor's motion has no effect.
    ///
    /// # Errors
    /// The engine fails, or there is no hand.
    pub fn ease(&mut self, setup: &Setup, recorder: &mut Recorder) -> Result<()> {
        let hand = Arc::clone(self.world.model().hand().context("a hand holds the body")?);
        for tendon in &hand.tendons {
            let [(motor, weight)] = tendon.motors[..] else { continue };
            let wound = tendon.length(&self.world.state().q) + 0.5 * tendon.force_limit / tendon.stiffness;
            let MotorNumbers { scaling, offset, .. } = hand.motors[motor].numbers;
            self.command.sigma[motor] = offset + (wound - tendon.rest) / (weight * scaling);
        }
        (0..steps(1.0, setup.dt_s)).try_for_each(|_| self.step(recorder))
    }

    /// Displacement of the body in the hand's frame after a motor has moved by `sigma` within half a second, m.
    ///
    /// # Errors
    /// The engine fails.
    pub fn moved_by(
        &mut self,
        setup: &Setup,
        recorder: &mut Recorder,
        motor: usize,
        sigma: f64,
    ) -> Result<Vec3> {
        let (from, before) = (self.command.sigma[motor], self.world.state().objects[0].translation);
        for t in ends_of_steps(1.0, setup.dt_s) {
            self.command.sigma[motor] = from + sigma * ramp(t / 0.5).0;
            self.step(recorder)?;
        }
        let state = self.world.state();
        Ok(state.base.rotation.inverse() * (state.objects[0].translation - before))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two jaws press a body with 7 N each: a plane between them passes 7 N, one along them nothing, and friction along the
    /// plane does not count.
    #[test]
    fn a_split_passes_what_presses_its_halves_together() {
        let forces = [
            (Vec3::new(0.02, 0.0, 0.0), Vec3::new(-7.0, 0.0, 1.0)),
            (Vec3::new(-0.02, 0.0, 0.0), Vec3::new(7.0, 0.0, -1.0)),
        ];
        assert_eq!(between_halves(&forces, Vec3::ZERO, Vec3::X), 7.0);
        assert_eq!(between_halves(&forces, Vec3::ZERO, Vec3::Y), 0.0);
    }
}
