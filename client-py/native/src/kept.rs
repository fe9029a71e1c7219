//! Tasks and hands of one's own that were read before, for as long as their files stay as they are.

use parking_lot::Mutex;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Most entries, and most files of one.
const MOST: usize = 64;
const MOST_FILES: usize = 10_000;

/// Path, time of the last change and length of every file of a folder.
type Stamp = Vec<(PathBuf, Option<SystemTime>, u64)>;

/// Values that were read from paths.
pub(crate) struct Kept<T>(Mutex<Option<HashMap<PathBuf, (Stamp, T)>>>);

impl<T: Clone> Kept<T> {
    pub(crate) const fn new() -> Self {
        Kept(Mutex::new(None))
    }

    /// The value that `read` makes of a path: from memory, if no file in its folder has changed.
    pub(crate) fn read<E>(&self, path: &Path, read: impl FnOnce() -> Result<T, E>) -> Result<T, E> {
        let folder = if path.is_dir() { Some(path) } else { path.parent() };
        let Some(stamp) = folder.and_then(stamp) else { return read() };
        let mut kept = self.0.lock();
        let kept = kept.get_or_insert_default();
        if let Some((_, value)) = kept.get(path).filter(|(known, _)| *known == stamp) {
            return Ok(value.clone());
        }
        let value = read()?;
        if kept.len() >= MOST {
            kept.clear();
        }
        kept.insert(path.to_owned(), (stamp, value.clone()));
        Ok(value)
    }
}

/// None where the folder cannot be read, or has too many files.
fn stamp(folder: &Path) -> Option<Stamp> {
    let (mut files, mut folders) = (Stamp::new(), vec![folder.to_owned()]);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).ok()? {
            let path = entry.ok()?.path();
            let about = path.metadata().ok()?;
            if about.is_dir() {
                folders.push(path);
            } else {
                files.push((path, about.modified().ok(), about.len()));
            }
            if files.len() + folders.len() > MOST_FILES {
                return None;
            }
        }
    }
    files.sort();
    Some(files)
}
