//! The replays on disk: recording, verification, retention.

mod folder;
mod retention;
mod verification;

#[cfg(test)]
mod tests;

pub(crate) use folder::{Archive, Recording, RecordingObserver, stored_path};
pub(crate) use verification::verify_runs;
