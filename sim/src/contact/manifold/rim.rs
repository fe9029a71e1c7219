//! The lowest point of a cylinder's rim. The polygon that represents a cap is fixed in the body; once the cap
//! tilts, the rim's own lowest point bears. Its load sets in without a jump, and the corners of the polygon recede: they are points
//! of the body, and on a coin that rolls they would be driven into the ground one after the other.

/// Sine of the tilt below which the point fades out. Without it a cap of 3 cm would sink `R (1 − cos 45°)`
/// times as much, 18 µm, between the four corners that are left of its polygon.
const TILT: f64 = 2e-3;

/// Distance by which the point is raised without tilt, m: the depth over which dissipation sets in.
const FADED_M: f64 = 1e-4;

/// Distance by which the rim's lowest point is raised, m, at this sine of the tilt.
pub(super) fn fade(sine: f64) -> f64 {
    FADED_M * (1.0 - sine / TILT).max(0.0)
}

/// Distance by which the corners of a cap's polygon are raised, m, at this sine of the tilt. At half a degree more than [`TILT`]
/// the rim bears alone.
pub(super) fn recede(radius: f64, sine: f64) -> f64 {
    radius * (sine - TILT).max(0.0)
}
