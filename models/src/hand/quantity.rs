//! The quantities of a hand that `[uncertain]` can name: what has each, its range, and the numbers that it changes.

use super::Hand;
use super::number::Bounds;
use super::uncertain::{HandQuantity, Owner};

/// A quantity of a hand that can be uncertain.
#[derive(Clone, Copy)]
struct Quantity {
    /// Its name in `hand.toml`.
    name: &'static str,
    /// The part that has it.
    owner: Owner,
    /// Range of the number itself; none if only a factor of it makes sense.
    value: Option<Bounds>,
    /// Whether the part of this index has it.
    has: fn(&Hand, usize) -> bool,
    /// Changes it on the parts of these indices, ascending, from each number to a new one.
    change: fn(&mut Hand, &[usize], &dyn Fn(f64) -> f64),
}

impl HandQuantity {
    fn declaration(self) -> Quantity {
        match self {
            HandQuantity::Friction => FRICTION,
            HandQuantity::Stiffness => STIFFNESS,
            HandQuantity::Damping => DAMPING,
            HandQuantity::MomentArms => MOMENT_ARMS,
            HandQuantity::ForceLimit => FORCE_LIMIT,
            HandQuantity::SpeedLimit => SPEED_LIMIT,
            HandQuantity::TendonStiffness => TENDON_STIFFNESS,
            HandQuantity::TendonFriction => TENDON_FRICTION,
        }
    }

    /// Its name in `hand.toml`.
    pub fn name(self) -> &'static str {
        self.declaration().name
    }

    /// The part that has it.
    pub fn owner(self) -> Owner {
        self.declaration().owner
    }

    /// Range of the number itself; none if only a factor of it makes sense.
    pub(crate) fn value(self) -> Option<Bounds> {
        self.declaration().value
    }

    /// Indices of all links, joints, motors or tendons of a hand that have it.
    pub(crate) fn all_of(self, hand: &Hand) -> Vec<usize> {
        let Quantity { owner, has, .. } = self.declaration();
        (0..hand.names_of(owner).len()).filter(|k| has(hand, *k)).collect()
    }

    /// Changes it on parts of a hand, from each number to a new one.
    pub(super) fn change(self, hand: &mut Hand, on: &[usize], new: &dyn Fn(f64) -> f64) {
        (self.declaration().change)(hand, on, new);
    }
}

impl Hand {
    /// The names of all links, joints, motors or tendons.
    pub(crate) fn names_of(&self, owner: Owner) -> Vec<&str> {
        match owner {
            Owner::Link => self.links.iter().map(|link| link.name.as_str()).collect(),
            Owner::Joint => self.coordinates.iter().map(|c| c.name.as_str()).collect(),
            Owner::Motor => self.motors.iter().map(|motor| motor.name.as_str()).collect(),
            Owner::Tendon => self.tendons.iter().map(|tendon| tendon.name.as_str()).collect(),
        }
    }
}

/// Coulomb coefficients of the shapes of links, as `[uncertain]` has them. A surface without friction has none by design.
const FRICTION: Quantity = Quantity {
    name: "friction",
    owner: Owner::Link,
    value: Some(Bounds::NotNegative),
    has: |hand, k| hand.links[k].geoms.iter().any(|geom| geom.friction > 0.0),
    change: |hand, on, new| {
        for &k in on {
            let rough = hand.links[k].geoms.iter_mut().filter(|geom| geom.friction > 0.0);
            rough.for_each(|geom| geom.friction = new(geom.friction));
        }
    },
};

/// E, as `[uncertain]` has it.
const STIFFNESS: Quantity = Quantity {
    name: "stiffness",
    owner: Owner::Joint,
    value: Some(Bounds::NotNegative),
    has: |hand, k| hand.coordinates[k].stiffness > 0.0,
    change: |hand, on, new| {
        on.iter().for_each(|&k| hand.coordinates[k].stiffness = new(hand.coordinates[k].stiffness));
    },
};

/// D, as `[uncertain]` has it.
const DAMPING: Quantity = Quantity {
    name: "damping",
    owner: Owner::Joint,
    value: Some(Bounds::NotNegative),
    has: |hand, k| hand.coordinates[k].damping > 0.0,
    change: |hand, on, new| {
        on.iter().for_each(|&k| hand.coordinates[k].damping = new(hand.coordinates[k].damping));
    },
};

/// The speed without load, as `[uncertain]` has it.
const SPEED_LIMIT: Quantity = Quantity {
    name: "speed_limit",
    owner: Owner::Motor,
    value: Some(Bounds::Positive),
    has: |_, _| true,
    change: |hand, on, new| {
        on.iter().for_each(|&k| hand.motors[k].speed_limit = new(hand.motors[k].speed_limit));
    },
};

/// R at joints, as `[uncertain]` has it. The lengths change as well.
const MOMENT_ARMS: Quantity = Quantity {
    name: "moment_arms",
    owner: Owner::Joint,
    value: None,
    has: |hand, k| hand.tendons.iter().any(|tendon| tendon.coordinates().contains(&k)),
    change: |hand, on, new| {
        for &k in on {
            hand.tendons.iter_mut().for_each(|tendon| tendon.scale_arms(k, new(1.0)));
        }
    },
};

/// f_max, as `[uncertain]` has it. The tendon's holding force and the load at which its motors stall are in proportion; a motor of
/// several tendons is as strong as the first of them.
const FORCE_LIMIT: Quantity = Quantity {
    name: "force_limit",
    owner: Owner::Tendon,
    value: Some(Bounds::Positive),
    has: |_, _| true,
    change: |hand, on, new| {
        let mut strengthened = Vec::new();
        for &k in on {
            let tendon = &mut hand.tendons[k];
            let before = tendon.force_limit;
            tendon.force_limit = new(before);
            let ratio = tendon.force_limit / before;
            tendon.hold_limit = tendon.hold_limit.map(|hold| hold * ratio);
            for &(motor, _) in &tendon.motors {
                if !strengthened.contains(&motor) {
                    strengthened.push(motor);
                    let stall = &mut hand.motors[motor].stall_force;
                    *stall = stall.map(|force| force * ratio);
                }
            }
        }
    },
};

/// K, as `[uncertain]` has it. The damping is in proportion.
const TENDON_STIFFNESS: Quantity = Quantity {
    name: "tendon_stiffness",
    owner: Owner::Tendon,
    value: Some(Bounds::Positive),
    has: |_, _| true,
    change: |hand, on, new| {
        for &k in on {
            let tendon = &mut hand.tendons[k];
            let before = tendon.stiffness;
            tendon.stiffness = new(before);
            tendon.damping *= tendon.stiffness / before;
        }
    },
};

/// μ at the guides on which a tendon rubs, as `[uncertain]` has it.
const TENDON_FRICTION: Quantity = Quantity {
    name: "tendon_friction",
    owner: Owner::Tendon,
    value: Some(Bounds::NotNegative),
    has: |hand, k| hand.tendons[k].rubbing().next().is_some(),
    change: |hand, on, new| {
        for &k in on {
            let rubbing = hand.tendons[k].guides.iter_mut().filter(|guide| guide.exponent() > 0.0);
            rubbing.for_each(|guide| guide.friction = new(guide.friction));
        }
    },
};
