//! Watches a world that is treated badly: is every number finite, does every step converge, does energy come from
//! nowhere, how fast do things get?

use crate::audit::held;
use crate::case_report::Invariants;
use crate::energy::{Ledger, Stored};
use palmares_sim::{Command, World};

/// What was seen so far.
pub struct Watch {
    ledger: Ledger,
    /// Energy less what was given, at the end of the last step, J, ...
    balance_j: f64,
    /// ... what joint limits then held, ...
    limits_j: f64,
    /// ... and the least there ever was, with what contacts and limits held at that moment.
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
    /// The most by which the balance ever rose above an earlier value, J: energy of bodies, springs, tendons and
    /// weight, less what motors, base servo and pushes gave (net). Contacts, dampers and limits can only take, or
    /// give back what they held.
    pub excess_j: f64,
    /// All that motors, servo and pushes gave, without what they took back, J: what `excess_j` is to be held against.
    pub given_j: f64,
}

impl Watch {
    /// Begins now.
    pub fn new(world: &World) -> Self {
        Watch {
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

    /// Looks at the step the world has just taken under `command`.
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
        // Overlaps are those of the start of the step: what contacts hold is booked with it.
        self.least_j = self.least_j.min(self.balance_j + self.limits_j + held(world));
        self.balance_j = Stored::of(model, state).total() - now.motors - now.servo - now.pushes;
        self.limits_j = held_by_limits(world);
        self.excess_j = self.excess_j.max(self.balance_j - self.least_j);
    }

    /// Nothing broke, every step converged.
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

/// What joints that are beyond their limits hold, J.
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
        let mut watch = Watch::new(&world);
        for _ in 0..100 {
            world.step(&command);
            watch.step(&world, &command);
        }
        assert!(watch.sound() && watch.excess_j <= 1e-6, "{:e} J", watch.excess_j);
        let at = world.model().object_dofs(0);
        let mass = world.model().objects()[0].mass;
        world.state_mut().v[at + 2] += 3.0;
        world.step(&command);
        watch.step(&world, &command);
        assert!(watch.excess_j >= 0.2 * 0.5 * mass * 9.0, "{:e} J", watch.excess_j);
        assert!(watch.object_speed > 1.0);
    }
}
