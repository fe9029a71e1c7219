//! Free rigid objects.

use crate::shape::Shape;
use crate::{Mat3, Pose, Vec3};

/// A rigid object: convex parts, mass and surface. Mass is spread evenly over the parts' volume.
#[derive(Clone, Debug)]
pub struct Object {
    /// Identifier: `ball_100mm`.
    pub name: String,
    /// Convex parts and where they sit in the object frame.
    pub parts: Vec<(Pose, Shape)>,
    /// kg
    pub mass: f64,
    /// Centre of mass in the object frame, m.
    pub com: Vec3,
    /// Inertia about the centre of mass in object axes, kg·m².
    pub inertia: Mat3,
    /// Coulomb friction coefficient.
    pub friction: f64,
    /// Coefficient of rolling resistance as a length, m: the lever of the resisting torque per normal force.
    pub rolling_friction: f64,
}
