//! Monitors a world under hard commands: finite numbers, converged steps, energy from nowhere, speeds of
//! bodies.

use crate::audit::held;
use crate::case_report::Invariants;
use crate::energy::{Ledger, Stored};
use palmares_sim::{Command, World};

/// The worst of all steps.
pub struct Monitor {
    ledger: Ledger,
    /// Energy less works, at the end of the last step, J.
    balance_j: f64,
    /// Energy in joint limits at that time, J.
    limits_j: f64,
    /// The least balance ever, with the energy in contacts and limits at that time, J.
    least_j: f64,
    /// Steps in which Newton did not reach its tolerance.
    pub unconverged: u64,
    /// Steps after which some number was not finite.
    pub broken: u64,
    /// Largest speed of an object, m/s.
    pub object_speed: f64,
    /// Largest speed of the base, m/s.
    pub base_speed: f64,
    /// Largest rate of a joint coordinate, rad/s.
    pub joint_rate: f64,
    /// Deepest overlap, m.
    pub depth_m: f64,
    /// The largest rise of the balance above an earlier value, J. The balance is the energy of bodies, springs, tendons and
    /// weight, less the net work of motors, base servo and pushes. Contacts, dampers and limits can only take energy, or
    /// return what they hold.
    pub excess_j: f64,
    /// Work of motors, servo and pushes, without the work that they took back, J: the measure for `excess_j`.
    pub given_j: f64,
}

impl Monitor {
    /// Starts now.
    pub fn new(world: &World) -> Self {
        Monitor {
            ledger: Ledger::new(world),
            balance_j: Stored::of(world.model(), world.state()).total(),
            limits_j: held_by_limits(world),
            least_j: f64::INFINITY,
            unconverged: 0,
            broken: 0,
            object_speed: 0.0,
            base_speed: 0.0,
            joint_rate: 0.0,
            depth_m: 0.0,
            excess_j: 0.0,
            given_j: 0.0,
        }
    }

    /// Adds the step that the world has just taken under `command`.
    pub fn step(&mut self, world: &World, command: &Command) {
        let (model, state) = (world.model(), world.state());
        self.unconverged += u64::from(!world.outcome().converged);
        if !state.is_finite() {
            self.broken += 1;
            return;
        }
        self.depth_m = self.depth_m.max(world.outcome().penetration_m);
        for k in 0..model.objects().len() {
            self.object_speed = self.object_speed.max(state.object_velocity(model, k).0.length());
        }
        let hand = &state.v[..model.hand_dofs()];
        if let Some((base, joints)) = hand.split_at_checked(6) {
            let speed = base[..3].iter().map(|v| v * v).sum::<f64>().sqrt();
            self.base_speed = self.base_speed.max(speed);
            self.joint_rate = joints.iter().fold(self.joint_rate, |most, v| most.max(v.abs()));
        }
        let before = self.ledger.works;
        self.ledger.step(world, command);
        let now = self.ledger.works;
        for (then, now) in
            [(before.motors, now.motors), (before.servo, now.servo), (before.pushes, now.pushes)]
        {
            self.given_j += (now - then).max(0.0);
        }
        // Overlaps are those of the start of the step, so that the energy in contacts counts there.
        self.least_j = self.least_j.min(self.balance_j + self.limits_j + held(world));
        self.balance_j = Stored::of(model, state).total() - now.motors - now.servo - now.pushes;
        self.limits_j = held_by_limits(world);
        self.excess_j = self.excess_j.max(self.balance_j - self.least_j);
    }

    /// Whether all numbers were finite and every step converged.
    pub fn sound(&self) -> bool {
        self.broken == 0 && self.unconverged == 0
    }

    /// As a case reports them.
    pub fn invariants(&self) -> Invariants {
        Invariants {
            max_penetration_mm: Some(self.depth_m * 1e3),
            newton_unconverged: Some(self.unconverged + self.broken),
            energy_gain_j: Some(self.excess_j),
            ..Invariants::default()
        }
    }
}

/// Energy in joints beyond their limits, J.
fn held_by_limits(world: &World) -> f64 {
    let Some(hand) = world.model().hand() else { return 0.0 };
    let k = world.model().config().limit_stiffness;
    let beyond = |(q, c): (&f64, &palmares_models::hand::Coordinate)| (c.lower - q).max(q - c.upper).max(0.0);
    world.state().q.iter().zip(&hand.coordinates).map(beyond).map(|x| 0.5 * k * x * x).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::grasp::closing;

    /// A hand that closes on an object and lifts it gains no energy; one whose object is kicked does, and as much.
    #[test]
    fn energy_from_nowhere_is_noticed() {
        let (mut world, command) = closing(0.2);
        let mut monitor = Monitor::new(&world);
        for _ in 0..100 {
            world.step(&command);
            monitor.step(&world, &command);
        }
        assert!(monitor.sound() && monitor.excess_j <= 1e-6, "{:e} J", monitor.excess_j);
        let at = world.model().object_dofs(0);
        let mass = world.model().objects()[0].mass;
        world.state_mut().v[at + 2] += 3.0;
        world.step(&command);
        monitor.step(&world, &command);
        assert!(monitor.excess_j >= 0.2 * 0.5 * mass * 9.0, "{:e} J", monitor.excess_j);
        assert!(monitor.object_speed > 1.0);
    }
}
