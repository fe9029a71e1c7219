//! An object of a scene that has been placed.

use palmares_models::Pose;
use palmares_models::object::Object;
use std::sync::Arc;

/// An object and the pose of its frame.
#[derive(Clone, Debug)]
pub struct Placed {
    /// Under the name it has in the scene.
    pub object: Arc<Object>,
    /// World pose; before it is placed, how far from where it would be and how much turned it is let go.
    pub pose: Pose,
    /// sRGB
    pub color: [f64; 3],
}
