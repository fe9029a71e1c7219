//! GraspIt!'s units, in those of a hand.

/// m
pub(super) const MM: f64 = 1e-3;
/// kg
pub(super) const GRAM: f64 = 1e-3;
/// N·m in GraspIt!'s unit of torque, g·mm²/s².
pub(super) const TORQUE: f64 = 1e-9;
/// N in GraspIt!'s unit of force, g·mm/s².
pub(super) const FORCE: f64 = 1e-6;
