//! The lowest point of a cylinder's rim. The polygon that represents a cap is fixed in the body; once the cap
//! tilts, the rim's own lowest point bears. Its load sets in without a jump, and the corners of the polygon recede: they are points
//! of the body, and on a coin that rolls they would be driven into the ground one after the other.

use crate::surface::solid::Rim;

/// Sine of the tilt below which the point fades out. Without it a cap of 3 cm would sink `R (1 − cos 45°)`
/// times as much, 18 µm, between the four corners that are left of its polygon.
const TILT: f64 = 2e-3;

/// Distance by which the point is raised without tilt, m: the depth over which dissipation sets in.
const FADED_M: f64 = 1e-4;

/// Distance by which the rim's lowest point is raised, m, at this sine of the tilt.
pub(super) fn fade(sine: f64) -> f64 {
    FADED_M * (1.0 - sine / TILT).max(0.0)
}

/// Distance by which a corner of a cap's polygon that is `above` the rim's lowest point is raised, m. Near that point the rim bears
/// alone from half a degree more than [`TILT`] on. On the far half, with which a cap falls flat, corners stay where they are.
pub(super) fn recede(rim: &Rim, above: f64) -> f64 {
    let middle = rim.radius * rim.sine;
    rim.radius * (rim.sine - TILT).max(0.0) * (1.0 - above / middle).clamp(0.0, 1.0)
}
