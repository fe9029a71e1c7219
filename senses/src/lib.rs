//! What a robot feels and sees. Every reading is a function of the world's state, of the run's seed and of the time: it
//! changes nothing, and does not depend on what else was read.

pub mod camera;
pub mod noise;
