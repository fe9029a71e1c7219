//! Files that other accounts must not read: those of the data directory, and secrets. They hold official seeds, keys and tokens.

mod access;

use crate::files::stored_path::{HANDS, REPLAYS};
pub use access::read_secret;
use std::fs::{self, DirBuilder, File, Permissions};
use std::io::{self, Write};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt, PermissionsExt};
use std::path::Path;

/// Mode of folders.
const FOLDER_MODE: u32 = 0o700;
/// Mode of files.
pub const FILE_MODE: u32 = 0o600;
/// The server's files in the data directory, but for the secrets: the server refuses secrets that others could read.
const FILES: [&str; 7] = [
    "palmares.sqlite",
    "palmares.sqlite-wal",
    "palmares.sqlite-shm",
    "palmares.sqlite-journal",
    "palmares.lock",
    "organizer.token",
    // Of the Python package.
    "server.log",
];
/// Its secrets.
const SECRETS: [&str; 2] = ["seed.secret", "signing.key"];

/// Makes a folder that only its owner can read, if there is none.
pub fn make_folder(path: &Path) -> io::Result<()> {
    if let Some(parent) = path.parent() {
        fs::create_dir_all(parent)?;
    }
    match DirBuilder::new().mode(FOLDER_MODE).create(path) {
        Err(_) if path.is_dir() => Ok(()),
        made => made,
    }
}

/// Opens a file for appending; makes one that only its owner can read, if there is none.
pub fn open_or_make(path: &Path) -> io::Result<File> {
    File::options().create(true).append(true).mode(FILE_MODE).open(path)
}

/// Opens a file that only its owner can read, empty.
pub fn create(path: &Path) -> io::Result<File> {
    File::options().create(true).write(true).truncate(true).mode(FILE_MODE).open(path)
}

/// Writes a new file that only its owner can read.
pub fn write_secret(path: &Path, text: &str) -> io::Result<()> {
    let mut file = File::options().write(true).create_new(true).mode(FILE_MODE).open(path)?;
    let written = writeln!(file, "{text}").and_then(|()| file.sync_all());
    if written.is_err() {
        // A part of a secret would keep the next start from making a whole one.
        let _ = fs::remove_file(path);
    }
    written
}

/// Withdraws the access of other accounts to the server's files in a data directory, which an earlier version or a copy may have
/// left, and says so in the log. Other files stay as they are.
pub fn withdraw_access(data_dir: &Path) {
    let mut changed = 0;
    for name in FILES {
        changed += restrict(&data_dir.join(name), FILE_MODE);
    }
    for folder in [REPLAYS, HANDS] {
        let path = data_dir.join(folder);
        changed += restrict(&path, FOLDER_MODE);
        for name in names(&path).iter().filter(|name| is_ours(name)) {
            changed += restrict(&path.join(name), FILE_MODE);
        }
    }
    let ours = |name: &String| {
        let name = name.as_str();
        FILES.contains(&name) || SECRETS.contains(&name) || name == REPLAYS || name == HANDS
    };
    match names(data_dir).iter().find(|name| !ours(name)) {
        None => changed += restrict(data_dir, FOLDER_MODE),
        Some(other) if mode(data_dir).is_some_and(|mode| mode & 0o077 != 0) => tracing::warn!(
            other,
            "other accounts can list {}; it stays so, since it has other files than the server's",
            data_dir.display()
        ),
        Some(_) => {}
    }
    if changed > 0 {
        tracing::warn!(changed, "other accounts could read files in {}; now they cannot", data_dir.display());
    }
}

/// Whether a replay or a hand has this name: `run_…`, or a SHA-256.
fn is_ours(name: &str) -> bool {
    let stem = name.split('.').next().unwrap_or_default();
    let hex = |text: &str| text.bytes().all(|byte| byte.is_ascii_hexdigit());
    stem.strip_prefix("run_").is_some_and(hex) || (stem.len() == 64 && hex(stem))
}

/// The names in a folder.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect()
}

/// The mode of a file or folder; None for links and for nothing.
fn mode(path: &Path) -> Option<u32> {
    let facts = fs::symlink_metadata(path).ok()?;
    (facts.is_file() || facts.is_dir()).then(|| facts.permissions().mode() & 0o777)
}

/// Sets the mode of a file or folder that others can access. Returns the number of changes.
pub fn restrict(path: &Path, to: u32) -> usize {
    if mode(path).is_none_or(|mode| mode & 0o077 == 0) {
        return 0;
    }
    match fs::set_permissions(path, Permissions::from_mode(to)) {
        Ok(()) => 1,
        Err(error) => {
            tracing::warn!(%error, path = %path.display(), "other accounts can read this; its mode cannot be changed");
            0
        }
    }
}
