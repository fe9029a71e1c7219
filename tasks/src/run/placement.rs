//! New poses, velocities and motor positions in a run.

use crate::observation::BodyState;

/// New poses, velocities and motor positions, in the units of observations. The rest stays as it is.
#[derive(Clone, Debug, Default)]
pub struct Placement {
    /// Pose and velocity of the base.
    pub base: Option<BodyState>,
    /// Joint coordinates, rad or m.
    pub q: Option<Vec<f64>>,
    /// Their velocities.
    pub joint_velocity: Option<Vec<f64>>,
    /// σ and dσ/dt, 1/s, of every motor.
    pub motors: Option<Vec<[f64; 2]>>,
    /// Pose and velocity of every free object.
    pub objects: Option<Vec<BodyState>>,
}
