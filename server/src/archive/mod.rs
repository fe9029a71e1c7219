//! The replays on disk: recording, verification, retention.

mod folder;
mod keys;
mod lost_replay;
mod retention;
mod upload;
mod verification;

#[cfg(test)]
mod tests;

pub(crate) use folder::{Archive, Recording, RecordingObserver, stored_path};
pub(crate) use keys::Keys;
pub(crate) use lost_replay::WriteAgain;
pub(crate) use upload::Upload;
pub(crate) use verification::Verification;
