//! The sensors of a hand and of its arm. A reading depends on the world's states, the run's seed and the time. Reading a
//! sensor changes nothing, and does not depend on what else was read.
//!
//! [`channels`] has one file for each channel: what it is, its law and its errors. Rows of numbers, messages, arrays,
//! replays, pages and the table in docs/senses.md follow from these declarations.

pub mod camera;
pub mod channels;
mod declaration;
mod document;
mod moment;
pub mod noise;
mod quantise;
mod sensor;
mod sensors;
mod table;

pub use channels::CHANNELS;
pub use declaration::{Channel, Column, ENCODERS, Index, JOINTS, MOTORS, Range, Record, Rows, TAXELS};
pub use document::{document, image_document};
pub use moment::Moment;
pub use sensors::{SensorState, Sensors};
pub use table::{ChannelInfo, ColumnInfo, Entry, SensorReadings, SensorTable};
