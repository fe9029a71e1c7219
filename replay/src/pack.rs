//! Packs the files of a hand into an archive for replays.

use palmares_models::hand::Hand;
use palmares_models::read::Limits;
use std::ffi::OsStr;
use std::fs;
use std::io::{Cursor, Error, Result, Write};
use std::path::{Path, PathBuf};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// Packs the files that the hand at `path` was loaded from: a URDF file, a folder or an archive.
///
/// # Errors
/// The files cannot be read, are too many or too large, or give another hand when they are unpacked.
pub fn pack(path: &Path, hand: &Hand) -> Result<Vec<u8>> {
    let limits = Limits::default();
    let bytes = if has_extension(path, "zip") {
        fs::read(path)?
    } else {
        let (folder, urdf) = if path.is_dir() {
            (path, None)
        } else {
            let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
            (parent.unwrap_or(Path::new(".")), path.file_name())
        };
        let mut files = Vec::new();
        collect(folder, PathBuf::new(), urdf, &limits, &mut files)?;
        // The order is the same on every machine, so that the same hand gives the same archive.
        files.sort();
        packed(folder, &files, &limits)?
    };
    match crate::hands::unpacked(&bytes) {
        Ok(unpacked) if unpacked.content_hash() == hand.content_hash() => Ok(bytes),
        Ok(_) => Err(Error::other("the packed files give another hand")),
        Err(refused) => Err(Error::other(refused.to_string())),
    }
}

fn has_extension(path: &Path, kind: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(kind))
}

/// The files that a hand may need, relative to its folder. If the folder has several URDF files, only the named one.
fn collect(
    folder: &Path,
    inside: PathBuf,
    urdf: Option<&OsStr>,
    limits: &Limits,
    files: &mut Vec<PathBuf>,
) -> Result<()> {
    for entry in fs::read_dir(folder.join(&inside))? {
        let entry = entry?;
        let (name, kind) = (entry.file_name(), entry.file_type()?);
        let relative = inside.join(&name);
        if name.to_string_lossy().starts_with('.') {
            continue;
        }
        if kind.is_dir() {
            collect(folder, relative, urdf, limits, files)?;
        } else {
            let other =
                urdf.is_some_and(|urdf| has_extension(&relative, "urdf") && relative != Path::new(urdf));
            let wanted = ["urdf", "toml", "stl"].iter().any(|kind| has_extension(&relative, kind)) && !other;
            if wanted {
                files.push(relative);
            }
        }
        if files.len() > limits.archive_entries {
            return Err(Error::other(format!("more than {} files", limits.archive_entries)));
        }
    }
    Ok(())
}

fn packed(folder: &Path, files: &[PathBuf], limits: &Limits) -> Result<Vec<u8>> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let mut left = limits.archive_unpacked_bytes;
    for file in files {
        let path = folder.join(file);
        let size = fs::metadata(&path)?.len();
        left =
            left.checked_sub(size).ok_or_else(|| Error::other("its files are too large for an archive"))?;
        zip.start_file(file.to_string_lossy(), SimpleFileOptions::default()).map_err(Error::other)?;
        zip.write_all(&fs::read(&path)?)?;
    }
    Ok(zip.finish().map_err(Error::other)?.into_inner())
}
