//! The file of a replay.

use anyhow::{Context, ensure};
use palmares_replay as replay;
use std::path::Path;

/// A file's bytes; a file that is too large for a replay is not read.
pub(crate) fn load(file: &Path) -> anyhow::Result<Vec<u8>> {
    let failed = || format!("cannot read {}", file.display());
    let facts = std::fs::metadata(file).with_context(failed)?;
    ensure!(facts.is_file(), "{}: not a file", file.display());
    ensure!(
        facts.len() <= replay::FILE_BYTES as u64,
        "{}: {} bytes are too many for a replay, the maximum is {}",
        file.display(),
        facts.len(),
        replay::FILE_BYTES
    );
    std::fs::read(file).with_context(failed)
}
