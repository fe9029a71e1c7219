//! The sensors of a hand and of its arm. A reading depends on the world's states, the run's seed and the time. Reading a
//! sensor changes nothing, and does not depend on what else was read.
//!
//! `senses/src/channels/` has one file for each channel: what it is, its law and its errors. Rows of numbers, messages, arrays,
//! replays, pages and the table in docs/senses.md follow from these declarations.
//!
//! | part | content |
//! |---|---|
//! | `senses/src/declaration.rs`, `table.rs` | the form of a declaration; which numbers of a row are whose |
//! | `senses/src/sensors.rs`, `sensor.rs` | all sensors of a run, tick by tick; one sensor |
//! | `senses/src/noise.rs` | random numbers by run, sensor and sample |
//! | `senses/src/camera/` | a z-buffer in 64 bits: `geometry.rs` splits bodies, `face.rs` and `round.rs` draw the parts, `sensor.rs` has the times of images, `stereo.rs` adds the errors of a stereo camera, `shade.rs` colours, `film.rs` draws for people |

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
