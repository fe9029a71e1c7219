//! The replays of files, folders and buckets.

use super::load;
use anyhow::{Context, ensure};
use palmares_replay::FILE_BYTES;
use palmares_s3::Bucket;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A replay.
pub(super) enum Source {
    File(PathBuf),
    Object { bucket: Arc<Bucket>, bucket_name: String, key: String },
}

impl Source {
    /// Its name in the output.
    pub(super) fn name(&self) -> String {
        match self {
            Source::File(path) => path.display().to_string(),
            Source::Object { bucket_name, key, .. } => format!("s3://{bucket_name}/{key}"),
        }
    }

    /// Its bytes.
    pub(super) fn load(&self) -> anyhow::Result<Vec<u8>> {
        match self {
            Source::File(path) => load(path),
            Source::Object { bucket, key, .. } => {
                bucket.read(key)?.context("the bucket has no such file any more")
            }
        }
    }
}

/// `BUCKET/PREFIX` of `s3://BUCKET/PREFIX`.
fn in_bucket(source: &Path) -> Option<&str> {
    source.to_str()?.strip_prefix("s3://")
}

/// Whether a source is no single file.
pub(super) fn has_many(source: &Path) -> bool {
    in_bucket(source).is_some() || source.is_dir()
}

/// All replays of the sources, in their order; those of a folder or bucket in the order of their names.
pub(super) fn find(sources: &[PathBuf]) -> anyhow::Result<Vec<Source>> {
    let mut found = Vec::new();
    for source in sources {
        let before = found.len();
        if let Some(rest) = in_bucket(source) {
            let bucket = Arc::new(Bucket::open(rest, FILE_BYTES as u64)?);
            let keys = bucket.list().with_context(|| source.display().to_string())?;
            let bucket_name = rest.split('/').next().unwrap_or_default().to_owned();
            found.extend(keys.into_iter().filter(|key| key.ends_with(".mcap")).map(|key| Source::Object {
                bucket: bucket.clone(),
                bucket_name: bucket_name.clone(),
                key,
            }));
        } else if source.is_dir() {
            collect(source, &mut found).with_context(|| format!("cannot read {}", source.display()))?;
        } else {
            found.push(Source::File(source.clone()));
        }
        ensure!(found.len() > before, "{}: there is no .mcap file in it", source.display());
    }
    Ok(found)
}

/// Adds the replays below a folder. A link to a folder is not followed: it may lead back.
fn collect(folder: &Path, found: &mut Vec<Source>) -> std::io::Result<()> {
    let mut entries = std::fs::read_dir(folder)?.collect::<std::io::Result<Vec<_>>>()?;
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        let path = entry.path();
        if entry.file_type()?.is_dir() {
            collect(&path, found)?;
        } else if path.extension().is_some_and(|kind| kind == "mcap") && !path.is_dir() {
            found.push(Source::File(path));
        }
    }
    Ok(())
}
