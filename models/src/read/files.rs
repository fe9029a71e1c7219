//! Files of a hand or a task: a folder on disk, or an archive that is read in memory and never unpacked to
//! disk.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Cursor, Read};
use std::path::{Component, Path, PathBuf};

use zip::ZipArchive;

use super::limits::Limits;
use super::report::Report;
use crate::error::ModelError;

/// Size from which the compression ratio of a file in an archive is checked, bytes.
const RATIO_COUNTS_FROM: u64 = 1 << 20;

/// The files of a hand or a task. A path never leads outside.
#[derive(Clone, Debug)]
pub enum Files {
    /// A folder on disk.
    Folder(PathBuf),
    /// An archive's contents in memory.
    Archive {
        /// The archive, for messages.
        file: PathBuf,
        /// Its folder with the URDF, empty for the archive itself.
        folder: PathBuf,
        /// Its files by path inside the archive.
        entries: BTreeMap<PathBuf, Vec<u8>>,
    },
}

impl Files {
    /// Reads an archive from disk.
    ///
    /// # Errors
    /// It cannot be read, is not a ZIP archive, holds an entry that is no plain file or folder inside the archive,
    /// or is larger than the limits allow.
    pub fn open_archive(file: &Path, limits: &Limits) -> Result<Files, ModelError> {
        let bytes = read_limited(file, "archive", limits.archive_bytes)?;
        Files::archive(file, &bytes, limits)
    }

    /// Reads an archive in memory; `file` is its name in messages.
    ///
    /// # Errors
    /// As [`Files::open_archive`].
    pub fn archive(file: &Path, bytes: &[u8], limits: &Limits) -> Result<Files, ModelError> {
        Files::archive_with(file, bytes, limits, wanted)
    }

    /// As [`Files::archive`], with only the files whose paths are `wanted`.
    ///
    /// # Errors
    /// As [`Files::open_archive`].
    pub fn archive_with(
        file: &Path,
        bytes: &[u8],
        limits: &Limits,
        wanted: impl Fn(&Path) -> bool,
    ) -> Result<Files, ModelError> {
        let at = Report::new(file);
        let valid = "plain files in folders inside the archive, each name once";
        at.limit("archive", "bytes", bytes.len(), limits.archive_bytes)?;
        let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|e| at.syntax("ZIP", e))?;
        // The reader keeps the last entry of a name.
        if archive.has_duplicate_names() {
            return Err(at.bad("archive", "holds several entries of one name", valid));
        }
        at.limit("archive", "entries", archive.len(), limits.archive_entries)?;
        let mut entries = BTreeMap::new();
        let mut total = 0;
        for i in 0..archive.len() {
            let entry = archive.by_index(i).map_err(|e| at.syntax("ZIP", format!("entry {i}: {e}")))?;
            let name = entry.name().map_err(|e| at.syntax("ZIP", format!("entry {i}: {e}")))?.into_owned();
            let element = format!("entry '{name}'");
            let bad = |problem: &str| at.bad(&element, problem, valid);
            if entry.is_symlink() {
                return Err(bad("is a symbolic link"));
            }
            let path = inside(Path::new(&name)).filter(|_| !name.contains('\\'));
            let path = path.ok_or_else(|| bad("leads out of the archive"))?;
            if entry.is_dir() || !wanted(&path) {
                continue;
            }
            // Sizes in the archive are only claims; the unpacked bytes are counted.
            let packed = entry.compressed_size().min(bytes.len() as u64);
            let left = limits.archive_unpacked_bytes - total;
            let of_ratio = packed.saturating_mul(limits.archive_ratio).max(RATIO_COUNTS_FROM);
            let mut content = Vec::new();
            let read = entry.take(left.min(of_ratio) + 1).read_to_end(&mut content);
            read.map_err(|e| at.syntax("ZIP", format!("{element}: {e}")))?;
            let found = content.len() as u64;
            if found > of_ratio {
                let ratio = found / packed.max(1);
                return Err(at.too_large(element, "times its packed size", ratio, limits.archive_ratio));
            }
            total += found;
            at.limit(&element, "bytes unpacked", total, limits.archive_unpacked_bytes)?;
            if entries.insert(path, content).is_some() {
                return Err(bad("is there twice"));
            }
        }
        Ok(Files::Archive { file: file.to_owned(), folder: PathBuf::new(), entries })
    }

    /// The hand's URDF: `hand.urdf`, or the only `.urdf`. For an archive, other paths are relative to its
    /// folder.
    ///
    /// # Errors
    /// There is none, or several and none is called `hand.urdf`.
    pub(crate) fn find_urdf(&mut self) -> Result<PathBuf, ModelError> {
        let mut found = match self {
            Files::Folder(folder) => {
                let failed = |error| ModelError::Read { file: folder.clone(), error };
                let mut found = Vec::new();
                for entry in std::fs::read_dir(&*folder).map_err(failed)? {
                    let name = PathBuf::from(entry.map_err(failed)?.file_name());
                    if wanted(&name) && has_extension(&name, "urdf") {
                        found.push(name);
                    }
                }
                found
            }
            Files::Archive { entries, .. } => {
                entries.keys().filter(|path| has_extension(path, "urdf")).cloned().collect()
            }
        };
        found.sort();
        let named: Vec<&PathBuf> = found.iter().filter(|p| p.ends_with("hand.urdf")).collect();
        let chosen = match (named.as_slice(), found.as_slice()) {
            (&[one], _) => one.clone(),
            ([], [one]) => one.clone(),
            _ => {
                let names: Vec<String> = found.iter().map(|p| p.display().to_string()).collect();
                let problem = format!("there are {}: [{}]", found.len(), names.join(", "));
                let valid =
                    "one file hand.urdf, or a single .urdf; `palmares hand import` reads other formats";
                return Err(Report::new(self.path()).bad("URDF", problem, valid));
            }
        };
        if let Files::Archive { folder, .. } = self {
            *folder = chosen.parent().unwrap_or(Path::new("")).to_owned();
        }
        Ok(chosen.file_name().map(PathBuf::from).unwrap_or(chosen))
    }

    /// The folder or the archive itself.
    pub fn path(&self) -> &Path {
        match self {
            Files::Folder(folder) => folder,
            Files::Archive { file, .. } => file,
        }
    }

    /// Name of a file in messages: `hand.zip/meshes/tip.stl`.
    pub fn display(&self, relative: &Path) -> PathBuf {
        match self {
            Files::Folder(folder) => folder.join(relative),
            Files::Archive { file, folder, .. } => file.join(folder).join(relative),
        }
    }

    /// Whether the file exists.
    pub fn contains(&self, relative: &Path) -> bool {
        match self {
            Files::Folder(folder) => folder.join(relative).is_file(),
            Files::Archive { folder, entries, .. } => entries.contains_key(&folder.join(relative)),
        }
    }

    /// A file's bytes.
    ///
    /// # Errors
    /// The path leads outside (by `..`, as an absolute path or through a link), the file does not exist, or
    /// it has more than `limit` bytes; `element` is the element that names it.
    pub fn read(&self, relative: &Path, element: &str, limit: u64) -> Result<Vec<u8>, ModelError> {
        let file = self.display(relative);
        let missing = |kind: std::io::ErrorKind| ModelError::Read { file: file.clone(), error: kind.into() };
        let clean = inside(relative).ok_or_else(|| outside(&file, element))?;
        match self {
            Files::Folder(folder) => {
                let failed = |error| ModelError::Read { file: file.clone(), error };
                let real = file.canonicalize().map_err(failed)?;
                let root = if folder.as_os_str().is_empty() { Path::new(".") } else { folder.as_path() };
                if !real.starts_with(root.canonicalize().map_err(failed)?) {
                    return Err(outside(&file, element));
                }
                read_limited(&file, element, limit)
            }
            Files::Archive { folder, entries, .. } => {
                let content = entries.get(&folder.join(clean));
                let content = content.ok_or_else(|| missing(std::io::ErrorKind::NotFound))?;
                Report::new(&file).limit(element, "bytes", content.len(), limit)?;
                Ok(content.clone())
            }
        }
    }
}

fn outside(file: &Path, element: &str) -> ModelError {
    let valid =
        "a file in or under the folder of the file that names it, not through a link that leads out of it";
    Report::new(file).bad(element, "this file lies outside the folder", valid)
}

/// The path without `.`, or `None` when it is absolute or goes up.
fn inside(path: &Path) -> Option<PathBuf> {
    let mut out = PathBuf::new();
    for component in path.components() {
        match component {
            Component::Normal(name) => out.push(name),
            Component::CurDir => {}
            _ => return None,
        }
    }
    (!out.as_os_str().is_empty()).then_some(out)
}

/// Whether a hand may need this file of an archive; the others (readme, licence, textures) stay packed.
fn wanted(path: &Path) -> bool {
    let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
    !hidden && ["urdf", "toml", "stl"].iter().any(|kind| has_extension(path, kind))
}

pub(crate) fn has_extension(path: &Path, kind: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(kind))
}

/// A plain file's bytes, never more than `limit` of them in memory.
///
/// # Errors
/// It cannot be read, is no plain file, or is larger; `element` is the element that names it.
pub fn read_limited(file: &Path, element: &str, limit: u64) -> Result<Vec<u8>, ModelError> {
    let failed = |error| ModelError::Read { file: file.to_owned(), error };
    // Opening a pipe would wait for ever.
    if !std::fs::metadata(file).map_err(failed)?.is_file() {
        return Err(failed(std::io::Error::other("not a plain file")));
    }
    let mut bytes = Vec::new();
    File::open(file).map_err(failed)?.take(limit + 1).read_to_end(&mut bytes).map_err(failed)?;
    Report::new(file).limit(element, "bytes", bytes.len(), limit)?;
    Ok(bytes)
}
