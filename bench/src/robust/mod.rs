//! How often things go well: the same scene in many placements, many random scenes.

pub mod grasps;
pub mod placements;
