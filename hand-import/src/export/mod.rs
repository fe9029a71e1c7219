//! Writes a hand for other programs: URDF and MJCF, each with the `hand.toml` that says what the format cannot.

mod inertia;
pub(crate) mod mjcf;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use palmares_models::read::{Files, LoadOptions, Loaded, from_files};

use crate::complete::{self, Complete};
use crate::decision::Log;
use crate::error::ImportError;
use crate::imported::Imported;
use crate::options::ImportOptions;
use crate::read::{self, Format};
use crate::source::Source;

/// A format to write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExportTarget {
    /// `hand.urdf`
    Urdf,
    /// `hand.xml`, for MuJoCo.
    Mjcf,
}

/// Exports a built-in hand, or the hand in a folder, an archive or a file, of any format that can be imported.
///
/// # Errors
/// The source gives no hand.
pub fn export(hand: &str, target: ExportTarget) -> Result<Imported, ImportError> {
    let path = Path::new(hand);
    match palmares_models::builtin::builtin_texts(hand).filter(|_| !path.exists()) {
        Some((urdf, settings)) => {
            let files = [("hand.urdf", urdf.to_owned()), ("hand.toml", settings)];
            let entries = files.map(|(name, text)| (PathBuf::from(name), text.into_bytes()));
            from_source(&Source::memory(path, entries.into())?, target)
        }
        None => from_source(&Source::open(path)?, target),
    }
}

/// Exports the hand of a source.
///
/// # Errors
/// The source gives no hand.
pub fn from_source(source: &Source, target: ExportTarget) -> Result<Imported, ImportError> {
    let options = ImportOptions::default();
    let (file, format) = read::content::description(source, None)?;
    let (draft, mut log) = read::read(source, &file, format, &options)?;
    let mut hand = complete::complete(draft, source, &options, &mut log);
    let (mut files, Loaded { hand: loaded, warnings, .. }) = written(&hand, &log, format, source, &file)?;
    let format = match target {
        ExportTarget::Urdf => {
            inertia::own(&mut hand, &files);
            files = crate::write(&hand, &log, format, &options);
            Format::Urdf
        }
        ExportTarget::Mjcf => {
            files.remove(Path::new("hand.urdf"));
            let text = mjcf::document(&hand, &loaded, &mut log);
            files.insert(PathBuf::from("hand.xml"), text.into_bytes());
            Format::Mjcf
        }
    };
    let (name, description) = (loaded.name, source.display(&file));
    Ok(Imported { name, format, description, files, decisions: log.decisions, warnings, tendon_lines: None })
}

/// The files as an import writes them, and the hand that they give.
fn written(
    hand: &Complete,
    log: &Log,
    format: Format,
    source: &Source,
    file: &Path,
) -> Result<(BTreeMap<PathBuf, Vec<u8>>, Loaded), ImportError> {
    let files = crate::write(hand, log, format, &ImportOptions::default());
    let archive =
        Files::Archive { file: source.display(file), folder: PathBuf::new(), entries: files.clone() };
    let loaded = from_files(archive, None, &LoadOptions::default())?;
    Ok((files, loaded))
}
