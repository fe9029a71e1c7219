//! The fingers whose tips press on a sensor, beside the Barrett's.

use super::press::{Finger, Line};
use palmares_models::Vec3;

const fn inspire(
    name: &'static str,
    motor: &'static str,
    link: &'static str,
    tip: Vec3,
    radius_m: f64,
) -> Finger {
    Finger { hand: "inspire_rh56", name, motor, open: &[0.0; 6], link, tip, radius_m }
}

/// Ends of the capsules of `hand.urdf`.
pub(super) const INDEX: Finger =
    inspire("index", "index_motor", "index_distal", Vec3::new(0.0008, -0.0034, 0.0386), 0.0065);
pub(super) const MIDDLE: Finger =
    inspire("middle", "middle_motor", "middle_distal", Vec3::new(0.001, -0.005, 0.0415), 0.0065);
pub(super) const THUMB: Finger =
    inspire("thumb", "thumb_bend_motor", "thumb_distal", Vec3::new(-0.0001, 0.0211, 0.014), 0.007);

/// The published lines of the force over the command.
pub(super) const INDEX_LINE: Line = Line { slope: 0.007478, offset: -0.414, explained: 0.987 };
pub(super) const MIDDLE_LINE: Line = Line { slope: 0.006452, offset: 0.018, explained: 0.986 };
pub(super) const THUMB_LINE: Line = Line { slope: 0.012547, offset: 0.384, explained: 0.993 };

/// The single finger, 10 mm before the end of its flat tip.
pub(super) const ROBOTIQ_3F: Finger = Finger {
    hand: "robotiq_3f",
    name: "middle finger",
    motor: "middle_motor",
    open: &[0.0, 0.0, 0.0, 0.5],
    link: "middle_distal",
    tip: Vec3::new(0.012, 0.0, 0.032),
    radius_m: 0.0,
};
