//! The hand's links as bodies, for those who draw.

use crate::scene::ScenePart;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A link of the hand and its collision shapes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HandBody {
    /// Index of the body: the links follow the bodies of the scene.
    pub id: usize,
    /// Name of the link.
    pub name: String,
    /// Convex parts in the link frame.
    pub parts: Vec<ScenePart>,
}
