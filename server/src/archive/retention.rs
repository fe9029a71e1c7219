//! Keeps practice replays up to a number of bytes, and with a shared storage also official ones that are in it. All files in the folder count: also truncated files after a crash, and files of
//! unknown runs.

use super::folder::Archive;
use palmares_store::files::blocking::blocking;
use palmares_store::files::objects::replay_key;
use palmares_store::{RecordedReplay, Store, StoreError};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// Age from which a file without a run is deleted: a younger one may belong to a run that is being opened.
const ORPHAN_AGE: Duration = Duration::from_secs(3600);

/// A file in the folder that is named like a replay.
struct ReplayOnDisk {
    path: PathBuf,
    run_id: String,
    bytes: u64,
    changed: SystemTime,
}

/// The replays in a folder, newest first.
fn replays_in(folder: &Path) -> std::io::Result<Vec<ReplayOnDisk>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let Some(run_id) = path.file_name().and_then(|name| name.to_str()).and_then(run_of) else { continue };
        let run_id = run_id.to_owned();
        // The file may have been deleted in between.
        let Ok(facts) = std::fs::metadata(&path) else { continue };
        // An empty file counts as one byte.
        let (bytes, changed) = (facts.len().max(1), facts.modified()?);
        files.push(ReplayOnDisk { path, run_id, bytes, changed });
    }
    files.sort_by(|a, b| b.changed.cmp(&a.changed).then_with(|| a.run_id.cmp(&b.run_id)));
    Ok(files)
}

/// The id of the run in a file's name; None for other files.
fn run_of(name: &str) -> Option<&str> {
    let run_id = name.strip_suffix(".mcap")?;
    let digits = run_id.strip_prefix("run_")?;
    digits.bytes().all(|b| b.is_ascii_hexdigit()).then_some(run_id)
}

/// Deletes the oldest practice replays beyond the limit.
pub(super) async fn apply_retention(store: &Store, archive: &Archive) -> Result<(), StoreError> {
    let folder = archive.folder();
    let searched = folder.clone();
    let files = tokio::task::spawn_blocking(move || replays_in(&searched)).await;
    let files = match files.unwrap_or_else(|failed| Err(failed.into())) {
        Ok(files) => files,
        Err(error) => {
            tracing::warn!(%error, folder = %folder.display(), "the replays cannot be listed");
            return Ok(());
        }
    };
    // Open and official runs. A run that opens from now on is checked again below.
    let protected = store.replays_to_keep(archive.objects().is_some()).await?;
    let mut kept = 0;
    for ReplayOnDisk { path, run_id, bytes, changed } in files {
        if protected.contains(&run_id) {
            continue;
        }
        kept += bytes;
        if kept <= archive.practice_bytes {
            continue;
        }
        let orphaned = || changed.elapsed().is_ok_and(|age| age >= ORPHAN_AGE);
        let recorded = store.recorded_replay(&run_id).await?;
        if !recorded.as_ref().map_or_else(orphaned, |replay| replay.status != "open") {
            continue;
        }
        // Official replays, and those of other servers, remain in the shared storage.
        let forgotten =
            recorded.filter(|replay| replay.k.is_none() && store.is_here(replay.replay_host.as_deref()));
        if let (Some(objects), Some(RecordedReplay { replay_sha256: Some(sha256), .. })) =
            (archive.objects(), &forgotten)
        {
            let (objects, key) = (objects.clone(), replay_key(sha256));
            if let Err(error) = blocking(move || objects.delete(&key)).await.unwrap_or_else(Err) {
                tracing::warn!(%error, run = run_id, "an old practice replay cannot be deleted from the shared storage");
                continue;
            }
        }
        let removed = path.clone();
        let removed = tokio::task::spawn_blocking(move || std::fs::remove_file(removed)).await;
        match removed.unwrap_or_else(|failed| Err(failed.into())) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                tracing::warn!(%error, path = %path.display(), "an old practice replay cannot be deleted");
            }
            _ if forgotten.is_some() => store.forget_replay(&run_id).await?,
            _ => {}
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_named_like_replays_count() {
        assert_eq!(run_of("run_0123456789abcdef.mcap"), Some("run_0123456789abcdef"));
        for name in ["run_0123.mcap.bak", "mine.mcap", "run_best.mcap", ".mcap", "run_0123"] {
            assert_eq!(run_of(name), None, "{name}");
        }
    }

    #[test]
    fn the_newest_come_first() {
        let folder = tempfile::tempdir().expect("folder");
        for (i, name) in ["run_3.mcap", "run_1.mcap", "run_2.mcap", "notes.txt"].into_iter().enumerate() {
            let file = std::fs::File::create(folder.path().join(name)).expect("file");
            let changed = SystemTime::UNIX_EPOCH + Duration::from_secs(1000 * i as u64);
            file.set_modified(changed).expect("time");
        }
        let found = replays_in(folder.path()).expect("reads");
        let order: Vec<&str> = found.iter().map(|file| file.run_id.as_str()).collect();
        assert_eq!(order, ["run_2", "run_1", "run_3"]);
    }
}
