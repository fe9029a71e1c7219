//! Replays: everything needed to play a run again, bit for bit, and to show that nobody touched the record.
//!
//! A [`Recorder`] writes while the run goes on; [`read`] takes a file apart without trusting a byte of it;
//! [`verify()`] simulates it again. The format is described in `docs/replays.md`.

mod chain;
mod descriptors;
mod film;
#[cfg(any(test, feature = "forge"))]
pub mod forge;
mod format;
mod foxglove;
mod frames;
mod hands;
mod header;
mod item;
mod lower_hex;
mod messages;
mod pack;
mod poses;
mod reader;
mod recorder;
mod records;
mod schema;
mod signature;
mod signed_file;
mod telemetry;
mod trajectory;
mod verify;
mod verify_error;
mod writer;

#[cfg(test)]
mod tests;

pub use film::{FilmError, film};
pub use header::{Header, Kind, Pacing, word};
pub use messages::{PushMessage, StateHash};
pub use pack::pack;
pub use reader::{RecordedTick, Replay, each_picture, read};
pub use recorder::{RecordError, Recorder, ReplayFile};
pub use records::FILE_BYTES;
pub use signature::{KeyError, PublicKey, Signer};
pub use trajectory::Trajectory;
pub use verify::{Verified, verify, verify_watched};
pub use verify_error::VerifyError;
