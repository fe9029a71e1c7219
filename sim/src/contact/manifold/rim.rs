//! The lowest point of a cylinder's rim. The polygon that stands for a cap stands still in the body; once the cap tilts, the
//! rim's own lowest point bears, wherever it is. Its bearing sets in without a jump.

/// Below this sine of the tilt it fades out; by then a cap of 3 cm would have sunk `R (1 − cos 45°)` times as much,
/// 18 µm, between the four corners that are left of its polygon.
const TILT: f64 = 2e-3;

/// How far it is taken away where nothing tilts, m: as far as dissipation sets in over.
const FADED_M: f64 = 1e-4;

/// How much higher than it is the rim's lowest point is taken for, m, at this sine of the tilt.
pub(super) fn fade(sine: f64) -> f64 {
    FADED_M * (1.0 - sine / TILT).max(0.0)
}
