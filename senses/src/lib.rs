//! What a robot feels and sees. Every reading is a function of the world's states, of the run's seed and of the time: it
//! changes nothing, and does not depend on what else was read.

mod accelerometer;
pub mod camera;
mod encoders;
pub mod noise;
mod senses;
pub mod touch;
mod wrist;

pub use encoders::{BaseReading, MotorReading};
pub use senses::{Senses, SensorReadings, SensorState};
pub use wrist::DRIFT_N;
