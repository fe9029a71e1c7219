//! Numbers of a hand that are known as ranges.

use serde::{Deserialize, Serialize};

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

/// From the list of quantities: the enumeration. `quantity.rs` declares each.
macro_rules! quantities {
    ($($(#[$about:meta])* $Quantity:ident,)*) => {
        /// A quantity of a hand that can be uncertain.
        #[derive(
            Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, schemars::JsonSchema,
        )]
        #[serde(rename_all = "snake_case")]
        pub enum HandQuantity { $($(#[$about])* $Quantity,)* }

        impl HandQuantity {
            /// All of them.
            pub const ALL: &'static [HandQuantity] = &[$(HandQuantity::$Quantity),*];
        }
    };
}

quantities! {
    /// Friction coefficients of the shapes of links.
    Friction,
    /// Stiffness E of joints.
    Stiffness,
    /// Damping D of joints.
    Damping,
    /// Moment arms of all tendons at joints.
    MomentArms,
    /// Largest tension of tendons, and with it the largest tension that they hold and the load at which their motors stall.
    ForceLimit,
    /// Largest speed of motors.
    SpeedLimit,
    /// Stiffness K of tendons and drives; their damping keeps its ratio to it.
    TendonStiffness,
    /// Coefficients of friction between tendons and their guides.
    TendonFriction,
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

/// The part that has a quantity.
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
