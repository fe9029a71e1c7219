//! Numbers of a hand that are known as ranges.

use serde::{Deserialize, Serialize};

use super::number::Bounds;
pub use super::quantity::Owner;
use super::quantity::Quantity;
use super::{Hand, coordinate, motor, tendon};

/// A number of a hand that is known as a range: an entry of `[uncertain]` in `hand.toml`.
#[derive(Clone, Debug, PartialEq)]
pub struct Uncertain {
    /// Its name, unique in the hand: `friction`, `distal_arms`.
    pub name: String,
    /// The quantity.
    pub of: HandQuantity,
    /// Indices of the links, joints, motors or tendons that have it, ascending.
    pub on: Vec<usize>,
    /// Whether these are all that have it.
    pub everywhere: bool,
    /// The range.
    pub range: Range,
}

/// From the list of quantities: the enumeration.
macro_rules! quantities {
    ($($(#[$about:meta])* $Quantity:ident = $declaration:path,)*) => {
        /// A quantity of a hand that can be uncertain.
        #[derive(
            Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, schemars::JsonSchema,
        )]
        #[serde(rename_all = "snake_case")]
        pub enum HandQuantity { $($(#[$about])* $Quantity,)* }

        impl HandQuantity {
            /// All of them.
            pub const ALL: &'static [HandQuantity] = &[$(HandQuantity::$Quantity),*];

            fn declaration(self) -> Quantity {
                match self { $(HandQuantity::$Quantity => $declaration,)* }
            }
        }
    };
}

quantities! {
    /// Friction coefficients of the shapes of links.
    Friction = super::FRICTION,
    /// Stiffness E of joints.
    Stiffness = coordinate::STIFFNESS,
    /// Damping D of joints.
    Damping = coordinate::DAMPING,
    /// Moment arms of all tendons at joints.
    MomentArms = tendon::MOMENT_ARMS,
    /// Largest tension of tendons, and with it the largest tension that they hold and the load at which their motors stall.
    ForceLimit = tendon::FORCE_LIMIT,
    /// Largest speed of motors.
    SpeedLimit = motor::SPEED_LIMIT,
    /// Stiffness K of tendons and drives; their damping keeps its ratio to it.
    TendonStiffness = tendon::STIFFNESS,
    /// Coefficients of friction between tendons and their guides.
    TendonFriction = tendon::FRICTION,
}

impl HandQuantity {
    /// Its name in `hand.toml`.
    pub fn name(self) -> &'static str {
        self.declaration().name
    }

    /// What has it.
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

/// A range, ascending.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Range {
    /// Of a factor of the hand's own numbers; 1 is within it.
    Factor([f64; 2]),
    /// Of the number itself, in the quantity's unit.
    Value([f64; 2]),
}

impl Range {
    /// Both ends.
    pub fn ends(self) -> [f64; 2] {
        match self {
            Range::Factor(ends) | Range::Value(ends) => ends,
        }
    }

    /// The number at the part `unit` of the range, from 0 to 1: factors evenly in their logarithm, values evenly.
    pub fn at(self, unit: f64) -> f64 {
        let [low, high] = self.ends();
        let drawn = match self {
            Range::Factor(_) => low * libm::pow(high / low, unit),
            Range::Value(_) => low + (high - low) * unit,
        };
        drawn.clamp(low, high)
    }

    /// The new number for one of the hand's own.
    pub(crate) fn applied(self, drawn: f64, own: f64) -> f64 {
        match self {
            Range::Factor(_) => drawn * own,
            Range::Value(_) => drawn,
        }
    }
}
