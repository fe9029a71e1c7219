//! A competition's limits for the figures of a hand. A hand beyond them is a machine: it wins by its
//! construction, not by its controller.
//!
//! [`Limits`](crate::read::Limits) bound what a *file* may ask of a parser; these bound what the *hand* is.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Allowed side of a limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Bound {
    /// The limit or less.
    Most,
    /// The limit or more.
    Least,
}

/// A figure and its default limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spec {
    /// Its name, also as a field of `[hand_limits]`.
    pub name: &'static str,
    /// Its unit; empty for a count or a ratio.
    pub unit: &'static str,
    /// Allowed side of the limit.
    pub bound: Bound,
    /// Default limit.
    pub default: f64,
    /// Meaning of the figure.
    pub what: &'static str,
    /// Reason for the default.
    pub because: &'static str,
}

macro_rules! limits {
    ($($name:ident, $unit:literal, $bound:ident $default:expr, $what:literal, $because:literal;)*) => {
        /// The limits of a hand's figures. Defaults are about two to three times the largest real hand.
        #[derive(Clone, Debug, PartialEq, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct HandLimits {
            $(#[doc = $what] pub $name: f64,)*
        }

        impl Default for HandLimits {
            fn default() -> HandLimits {
                HandLimits { $($name: $default,)* }
            }
        }

        /// Every figure, in the order in which tables show them.
        pub const SPECS: &[Spec] = &[$(Spec {
            name: stringify!($name),
            unit: $unit,
            bound: Bound::$bound,
            default: $default,
            what: $what,
            because: $because,
        },)*];

        impl HandLimits {
            /// The limit of a figure; NaN for an unknown name.
            pub fn of(&self, name: &str) -> f64 {
                match name {
                    $(stringify!($name) => self.$name,)*
                    _ => f64::NAN,
                }
            }
        }
    };
}

limits! {
    size_m, "m", Most 0.6, "largest edge of the hand's bounding box, open or closed",
        "a Shadow hand with its forearm has 0.45, the ReFlex 0.31, the SoftHand 0.28";
    reach_m, "m", Most 0.7, "how far a point of the hand can ever get from the base's origin",
        "two and a half times the SoftHand's 0.28";
    link_size_m, "m", Most 0.3, "largest edge of a link's shapes",
        "the SoftHand's palm with its flange has 0.2; a plate or a beam is no link of a hand";
    volume_m3, "m³", Most 0.004, "volume of all collision shapes",
        "three times the ReFlex's 0.0013";
    mass_kg, "kg", Most 5.0, "mass of the hand",
        "a Shadow hand with its forearm weighs 4.3, the ReFlex 0.9";
    link_mass_kg, "kg", Most 3.0, "mass of the heaviest link",
        "the published SoftHand's palm has 2.3, the ReFlex's housing 0.6";
    least_link_mass_kg, "kg", Least 1e-4, "mass of the lightest link",
        "a tenth of a gram; the lightest phalanx of the program's hands has 5 g. Less cannot be simulated at 1 ms";
    links, "", Most 64.0, "number of links that move on their own, base included",
        "the SoftHand has 20";
    shapes, "", Most 128.0, "number of collision shapes",
        "the SoftHand has 24";
    joints, "", Most 48.0, "number of independent joints",
        "the SoftHand has 19, a human hand 27";
    tendons, "", Most 24.0, "number of tendons",
        "a Shadow hand has 20 drives";
    motors, "", Most 24.0, "number of motors",
        "a Shadow hand has 20";
    joint_range_rad, "rad", Most 6.3, "range of a turning joint",
        "one turn; the ReFlex's fingers have 3.1. A continuous joint has no range";
    joint_stroke_m, "m", Most 0.15, "stroke of a sliding joint",
        "parallel grippers have 0.05 to 0.14";
    least_joint_inertia_kgm2, "kg·m²", Least 1e-9, "inertia that a turning joint moves",
        "a gram 1 mm from its axis; the pinch hand's fingertip has 9e-6. Less cannot be simulated at 1 ms";
    joint_stiffness_nm_rad, "N·m/rad", Most 5.0, "stiffness of a turning joint's spring",
        "the published SoftHand has 1";
    joint_damping_nms_rad, "N·m·s/rad", Most 5.0, "damping of a turning joint",
        "the published SoftHand has 1";
    joint_torque_nm, "N·m", Most 30.0, "largest torque of tendons or spring on a turning joint",
        "the ReFlex's preshape drive holds with 10, the SoftHand's thumb closes with 2.6";
    slide_stiffness_n_m, "N/m", Most 5000.0, "stiffness of a sliding joint's spring",
        "half of a gripper's 150 N over 15 mm";
    slide_damping_ns_m, "N·s/m", Most 1000.0, "damping of a sliding joint",
        "150 N at 0.15 m/s, the force and speed of a quick parallel gripper";
    slide_force_n, "N", Most 400.0, "largest force of tendons or spring on a sliding joint",
        "parallel grippers press with 20 to 235";
    moment_arm, "s/q", Most 4.0, "largest moment arm, an entry of R",
        "three times the SoftHand's 1.3, relative to one joint; radii in metres are 0.02 at most";
    tendon_stiffness, "f/s", Most 1e6, "stiffness of a cable with its motor",
        "1 mm² of steel over 0.2 m has 1e6 N/m, the pinch hand's 1e5";
    tendon_damping, "f·s/s", Most 1e4, "damping of a cable",
        "a hundredth of the stiffness, in seconds";
    tendon_force, "f", Most f64::INFINITY, "largest tension or drive torque, in the tendon's unit",
        "the unit is that of R: 60 N at a pulley of 5 mm are 0.3 N·m. joint_torque_nm limits what it does";
    motor_scaling, "s", Most 40.0, "length that a motor winds from σ = 0 to 1",
        "the SoftHand winds 12.5 (rad of one joint)";
    motor_offset, "", Most 1.0, "σ at which a motor's cable has no length wound",
        "inside the range of σ; the published hands have 0, the pinch hand 0.2";
    motor_speed_per_s, "1/s", Most 6.0, "speed of a motor, as dσ/dt",
        "closes in a sixth of a second; the hands of the program take half a second";
    motor_power_w, "W", Most 150.0, "largest tension times largest speed of a motor",
        "the SoftHand's 2 N·m at 25 rad/s are 50; its real motor has 6";
    friction, "", Most 2.5, "Coulomb coefficient of a surface",
        "soft dry rubber reaches 2; the ReFlex's pads have 1.5";
}

impl HandLimits {
    /// Checks the limits themselves: each must be more than 0, `inf` for unlimited.
    ///
    /// # Errors
    /// Field, value and valid values.
    pub fn check(&self) -> Result<(), String> {
        for Spec { name, bound, .. } in SPECS {
            let limit = self.of(name);
            let valid = match bound {
                Bound::Most => limit > 0.0,
                Bound::Least => limit >= 0.0 && limit.is_finite(),
            };
            if !valid {
                let valid = match bound {
                    Bound::Most => "more than 0; inf for no limit",
                    Bound::Least => "at least 0, finite",
                };
                return Err(format!("hand_limits.{name} = {limit}: expected {valid}"));
            }
        }
        Ok(())
    }
}
