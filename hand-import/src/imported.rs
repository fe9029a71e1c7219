//! An imported hand in memory, and its files on disk.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use palmares_models::error::LoadWarning;

use crate::decision::{Decision, DecisionKind};
use crate::error::ImportError;
use crate::read::Format;

/// An imported hand, not yet on disk.
#[derive(Clone, Debug)]
pub struct Imported {
    /// Its name.
    pub name: String,
    /// Format of the description.
    pub format: Format,
    /// The description, as in messages.
    pub description: PathBuf,
    /// Files by their path in the hand's folder.
    pub files: BTreeMap<PathBuf, Vec<u8>>,
    /// Every decision.
    pub decisions: Vec<Decision>,
    /// Warnings of the loader about the written files.
    pub warnings: Vec<LoadWarning>,
    /// Lines of `hand.toml` that put a tendon over the joints of each finger, where the format has no tendons. They are comments at the end
    /// of the written file, and replace all from the line "# Servos of the fingers" on.
    pub tendon_lines: Option<String>,
}

impl Imported {
    /// The problems among the decisions.
    pub fn problems(&self) -> impl Iterator<Item = &Decision> {
        self.decisions.iter().filter(|decision| decision.kind == DecisionKind::Problem)
    }

    /// Writes the files into a folder, which must not exist unless `force` is set.
    ///
    /// # Errors
    /// The folder exists, or a file cannot be written.
    pub fn write(&self, folder: &Path, force: bool) -> Result<(), ImportError> {
        write_files(&self.files, folder, force)
    }
}

/// Writes files into a folder, which must not exist unless `force` is set.
pub(crate) fn write_files(
    files: &BTreeMap<PathBuf, Vec<u8>>,
    folder: &Path,
    force: bool,
) -> Result<(), ImportError> {
    let failed = |file: &Path| {
        let file = file.to_owned();
        move |source| ImportError::Write { file, source }
    };
    if folder.exists() && !force {
        let exists = std::io::Error::other("exists; nothing was written (--force replaces its files)");
        return Err(failed(folder)(exists));
    }
    for (path, bytes) in files {
        let path = folder.join(path);
        let parent = path.parent().unwrap_or(folder);
        std::fs::create_dir_all(parent).map_err(failed(parent))?;
        std::fs::write(&path, bytes).map_err(failed(&path))?;
    }
    Ok(())
}
