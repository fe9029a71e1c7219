//! Replays: files from which a run can be simulated again, bit for bit, and which prove that nobody changed the
//! recording.
//!
//! A [`Recorder`] writes during the run; [`read`] reads a file without trusting a byte of it; [`verify()`] simulates it
//! again. `docs/replays.md` describes the format.
//!
//! `replay/src/likeness/` compares the movements of two runs.

mod chain;
mod descriptors;
#[cfg(any(test, feature = "forge"))]
pub mod forge;
mod format;
mod foxglove;
mod frames;
mod hands;
mod header;
mod image_export;
mod item;
pub mod likeness;
mod lower_hex;
mod messages;
mod pack;
mod poses;
mod reader;
mod recorder;
mod records;
pub mod schema;
mod signature;
mod signed_file;
mod telemetry;
mod trajectory;
mod verify;
mod verify_error;
mod writer;

#[cfg(test)]
mod tests;

pub use header::{CompetitionMode, Header, Pacing, word};
pub use image_export::{ExportError, export_images};
pub use messages::{PushMessage, StateHash};
pub use pack::pack;
pub use reader::{RecordedTick, Replay, each_pose_message, read};
pub use recorder::{LoggedTick, RecordError, Recorder, ReplayFile};
pub use records::FILE_BYTES;
pub use signature::{KeyError, PublicKey, Signer};
pub use trajectory::Trajectory;
pub use verify::{Verified, verify, verify_watched};
pub use verify_error::VerifyError;
