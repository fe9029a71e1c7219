//! Declaration of a quantity that `[uncertain]` can name, beside the numbers that it changes. `uncertain.rs` lists all.

use super::Hand;
use super::number::Bounds;

/// A quantity of a hand that can be uncertain.
#[derive(Clone, Copy)]
pub(super) struct Quantity {
    /// Its name in `hand.toml`.
    pub(super) name: &'static str,
    /// What has it.
    pub(super) owner: Owner,
    /// Range of the number itself; none if only a factor of it makes sense.
    pub(super) value: Option<Bounds>,
    /// Whether the part of this index has it.
    pub(super) has: fn(&Hand, usize) -> bool,
    /// Changes it on the parts of these indices, ascending, from each number to a new one.
    pub(super) change: fn(&mut Hand, &[usize], &dyn Fn(f64) -> f64),
}

/// What has a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Owner {
    /// Links of the hand.
    Link,
    /// Joint coordinates.
    Joint,
    /// Motors.
    Motor,
    /// Tendons.
    Tendon,
}

impl Owner {
    /// The field of `hand.toml` that lists them.
    pub fn field(self) -> &'static str {
        match self {
            Owner::Link => "links",
            Owner::Joint => "joints",
            Owner::Motor => "motors",
            Owner::Tendon => "tendons",
        }
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
