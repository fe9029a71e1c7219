//! Grasps drawn before any engine had played them, and one played on an engine: lift, hold and shake.

pub mod family;
pub mod play;
pub mod scene;
