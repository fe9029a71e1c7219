//! Finished files by content, which the servers of a competition share: in a bucket, or in a common folder.
//!
//! A key contains the SHA-256 of its file. So every server writes the same bytes under a key, and a late write changes nothing. The data
//! directory keeps what was written or read here.

use crate::files::blocking::assert_may_block;
use crate::files::private_files;
use palmares_replay::FILE_BYTES;
use palmares_s3::Bucket;
use std::fs;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// The key of a replay.
pub fn replay_key(sha256: &str) -> String {
    format!("replays/{sha256}.mcap")
}

/// The key of a hand's archive.
pub fn hand_key(sha256: &str) -> String {
    format!("hands/{sha256}.zip")
}

/// The shared files.
#[derive(Debug)]
pub enum Objects {
    /// In a folder that all servers have.
    Folder(PathBuf),
    /// In a bucket.
    Bucket(Bucket),
}

impl Objects {
    /// The files of a URL: `s3://bucket/prefix`, with address and credentials from the environment, or `file:///folder`.
    ///
    /// # Errors
    /// The URL or the environment is not valid.
    pub fn open(url: &str) -> anyhow::Result<Self> {
        if let Some(path) = url.strip_prefix("file://").filter(|path| path.starts_with('/')) {
            return Ok(Objects::Folder(PathBuf::from(path)));
        }
        match url.strip_prefix("s3://") {
            Some(rest) => Ok(Objects::Bucket(Bucket::open(rest, FILE_BYTES as u64)?)),
            None => {
                anyhow::bail!("storage `{url}`: expected s3://BUCKET, s3://BUCKET/PREFIX or file:///FOLDER")
            }
        }
    }

    /// Writes a file.
    pub fn put(&self, key: &str, bytes: &[u8]) -> io::Result<()> {
        plain(key)?;
        match self {
            Objects::Folder(folder) => write_whole(&folder.join(key), bytes),
            Objects::Bucket(bucket) => bucket.put(key, bytes),
        }
    }

    /// The bytes of a file; None if there is none.
    pub fn get(&self, key: &str) -> io::Result<Option<Vec<u8>>> {
        plain(key)?;
        match self {
            Objects::Folder(folder) => match fs::read(folder.join(key)) {
                Ok(bytes) => Ok(Some(bytes)),
                // A folder that is not mounted is no missing file.
                Err(error) if error.kind() == ErrorKind::NotFound && folder.is_dir() => Ok(None),
                Err(error) => Err(error),
            },
            Objects::Bucket(bucket) => bucket.get(key),
        }
    }

    /// Deletes a file; it may be missing.
    pub fn delete(&self, key: &str) -> io::Result<()> {
        plain(key)?;
        match self {
            Objects::Folder(folder) => match fs::remove_file(folder.join(key)) {
                Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
                _ => Ok(()),
            },
            Objects::Bucket(bucket) => bucket.delete(key),
        }
    }
}

/// Checks a key: digests come from a database that may be restored, and contain any text.
fn plain(key: &str) -> io::Result<()> {
    assert_may_block();
    let valid = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "/.".contains(c);
    match key.chars().all(valid) && !key.contains("..") {
        true => Ok(()),
        false => Err(io::Error::new(ErrorKind::InvalidData, format!("object storage: invalid key {key:?}"))),
    }
}

/// Writes a file, whole or not at all. Several servers may write the same file at once.
pub fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    assert_may_block();
    if let Some(folder) = path.parent() {
        private_files::make_folder(folder)?;
    }
    let mut random = [0; 4];
    getrandom::fill(&mut random).map_err(io::Error::other)?;
    let draft = path.with_extension(format!("{}.draft", hex::encode(random)));
    let written = (|| {
        let mut file = private_files::create(&draft)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        fs::rename(&draft, path)
    })();
    if written.is_err() {
        let _ = fs::remove_file(&draft);
    }
    written
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_keeps_files_by_key() {
        let folder = tempfile::tempdir().expect("folder");
        let season = folder.path().join("season");
        let objects = Objects::open(&format!("file://{}", season.display())).expect("opens");
        let key = replay_key("ab");
        assert!(objects.get(&key).is_err(), "the folder is not there");
        for bytes in [b"one", b"two"] {
            objects.put(&key, bytes).expect("puts");
            assert_eq!(objects.get(&key).expect("gets").as_deref(), Some(bytes.as_slice()));
        }
        assert_eq!(fs::read_dir(season.join("replays")).expect("folder").count(), 1, "no draft is left");
        assert_eq!(objects.get(&hand_key("ab")).expect("gets"), None);
        for _ in 0..2 {
            objects.delete(&key).expect("deletes");
        }
        assert_eq!(objects.get(&key).expect("gets"), None);
        let outside = objects.delete(&replay_key("../../../signing")).expect_err("leads out").to_string();
        assert!(outside.contains("invalid key"), "{outside}");
    }

    #[test]
    fn an_error_names_the_valid_forms() {
        for url in ["bucket", "file://season", "ftp://host/season"] {
            let error = Objects::open(url).expect_err(url).to_string();
            assert!(error.contains(url) && error.contains("s3://BUCKET/PREFIX"), "{error}");
        }
    }
}
