//! Other engines: the same cases and grasps on rapier and MuJoCo, and the reports about them.

pub mod cameras;
pub mod child;
pub mod engine;
pub mod grasps;
pub mod mjcf;
pub mod played;
pub mod report;
pub mod scene_id;
pub mod search;
pub mod trials;
pub mod validation;
