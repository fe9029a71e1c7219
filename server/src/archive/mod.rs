//! The replays on disk: recording, verification, retention.

mod folder;
mod keys;
mod retention;
mod upload;
mod verification;

#[cfg(test)]
mod tests;

pub(crate) use folder::{Archive, Recording, RecordingObserver, stored_path};
pub(crate) use keys::Keys;
pub(crate) use upload::Upload;
pub(crate) use verification::Verification;
