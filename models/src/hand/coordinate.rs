//! Independent coordinates.

use super::number::{Bounds, Hashed, Number, numbers};

/// An independent coordinate q with its spring `τ = −E (q − rest)`, damper `−D q̇`, dry friction and limits.
#[derive(Clone, Debug)]
pub struct Coordinate {
    /// Name of the joint it represents.
    pub name: String,
    /// Lower limit, rad (m for a prismatic joint).
    pub lower: f64,
    /// Upper limit, rad (m).
    pub upper: f64,
    /// Its numbers.
    pub numbers: CoordinateNumbers,
}

numbers! {
    /// The numbers of a coordinate.
    numbers CoordinateNumbers of Coordinate;
    /// An entry of `[coordinates]`: the URDF has those that it does not state.
    table CoordinateSettings;
    /// E, N·m/rad.
    stiffness: f64 = Number { unit: "N·m/rad", bounds: Bounds::NotNegative, ..Number::ZERO },
    /// D, N·m·s/rad.
    damping: f64 = Number { unit: "N·m·s/rad", bounds: Bounds::NotNegative, ..Number::ZERO },
    /// Rest position of its spring.
    rest: f64 = Number { unit: "rad", ..Number::ZERO },
    /// Largest torque of its dry friction, N·m, or force, N.
    #[serde(skip_serializing_if = "super::number::is_zero")]
    friction: f64 = Number {
        unit: "N·m",
        bounds: Bounds::NotNegative,
        hashed: Hashed::After("friction"),
        ..Number::ZERO
    },
}
