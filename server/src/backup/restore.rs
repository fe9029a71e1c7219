//! Restores a backup. An archive may be damaged or made by anybody: everything in it is checked before anything is kept. The files
//! are unpacked into a folder of their own, and moved to their places at the end.

use crate::backup::{FORMAT, MANIFEST, Manifest, SECRETS};
use anyhow::{Context, bail};
use palmares_net::auth::random_hex;
use palmares_store::files::private_files::make_folder;
use palmares_store::files::stored_path::{self, HANDS, REPLAYS, checked};
use palmares_store::{Host, Location, Store, Table};
use serde_json::{Map, Value};
use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use zip::ZipArchive;

/// Files of a data directory that is in use.
const IN_USE: [&str; 5] = ["palmares.sqlite", "seed.secret", "signing.key", REPLAYS, HANDS];
/// Largest compression ratio of an archive above [`RATIO_COUNTS_FROM`]. Text compresses to a tenth, zeros to a thousandth.
const RATIO: u64 = 100;
/// Content of any compression ratio, bytes.
const RATIO_COUNTS_FROM: u64 = 16 << 20;
/// Problems that are listed in full.
const MAX_LISTED: usize = 20;

/// Restores a backup into a data directory, and into the database of a URL instead of a file there. Both must be empty. With
/// `allow_missing` replays and hands may be missing. Returns notes about files that are not restored.
///
/// # Errors
/// One of them is not empty or cannot be written, or the backup is not valid. Then nothing is written.
pub fn restore(
    file: &Path,
    data_dir: &Path,
    database_url: Option<&str>,
    allow_missing: bool,
) -> anyhow::Result<Vec<String>> {
    if let Some(name) = IN_USE.iter().find(|name| data_dir.join(name).exists()) {
        bail!("{} is not empty: it has {name}; a backup is restored into an empty one", data_dir.display());
    }
    let draft = Draft::new(data_dir)?;
    let archive = File::open(file).context("cannot be read").map(BufReader::new);
    let (unpacked, notes) = archive
        .and_then(|archive| unpack_checked(archive, &draft.folder, allow_missing))
        .with_context(|| file.display().to_string())?;
    let location = Location::new(&draft.folder, database_url.map(str::to_owned));
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    runtime.context("cannot start the asynchronous runtime")?.block_on(async {
        let store = Store::open(&location, &Host::alone()).await?;
        let filled = fill(&store, &unpacked.tables).await;
        store.close().await;
        filled
    })?;
    draft.keep()?;
    Ok(notes)
}

async fn fill(store: &Store, tables: &[Table]) -> anyhow::Result<()> {
    if !store.is_empty().await? {
        bail!("the database is not empty; a backup is restored into an empty one");
    }
    Ok(store.fill(tables).await?)
}

/// A folder in the data directory for files that are not checked yet. Without [`Draft::keep`] it is deleted, and so is a data
/// directory that was made for it.
struct Draft {
    data_dir: PathBuf,
    folder: PathBuf,
    new: bool,
}

impl Draft {
    fn new(data_dir: &Path) -> anyhow::Result<Self> {
        let new = !data_dir.exists();
        make_folder(data_dir).with_context(|| format!("cannot make {}", data_dir.display()))?;
        let folder = data_dir.join(format!(".restore-{}", random_hex(8)?));
        let draft = Draft { data_dir: data_dir.to_owned(), folder, new };
        make_folder(&draft.folder).with_context(|| format!("cannot make {}", draft.folder.display()))?;
        Ok(draft)
    }

    /// Moves all files to their places.
    fn keep(&self) -> anyhow::Result<()> {
        for entry in fs::read_dir(&self.folder)? {
            let entry = entry?;
            let to = self.data_dir.join(entry.file_name());
            fs::rename(entry.path(), &to).with_context(|| format!("cannot write {}", to.display()))?;
        }
        File::open(&self.data_dir)?.sync_all()?;
        Ok(())
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.folder);
        if self.new {
            // Fails after `keep`, when it is not empty.
            let _ = fs::remove_dir(&self.data_dir);
        }
    }
}

/// The content of an archive.
#[derive(Default)]
pub(crate) struct Unpacked {
    tables: Vec<Table>,
    /// SHA-256 of the unpacked replays and hands, by their paths.
    digests: BTreeMap<String, String>,
}

/// Unpacks an archive into a folder and compares it with the digests in the database. Returns it with notes about files that are
/// not restored.
pub(crate) fn unpack_checked(
    archive: impl Read + Seek,
    folder: &Path,
    allow_missing: bool,
) -> anyhow::Result<(Unpacked, Vec<String>)> {
    let unpacked = unpack(archive, folder)?;
    let mut notes = unpacked.check(allow_missing)?;
    notes.extend(unpacked.drop_unnamed(folder)?);
    Ok((unpacked, notes))
}

/// Unpacks an archive into a folder; nothing outside of it is written.
fn unpack(mut archive: impl Read + Seek, folder: &Path) -> anyhow::Result<Unpacked> {
    // Entries may overlap in the archive, so the bound is on all together.
    let mut left = archive.seek(SeekFrom::End(0))?.saturating_mul(RATIO).max(RATIO_COUNTS_FROM);
    let mut zip = ZipArchive::new(archive).context("not a backup of Palmares")?;
    let manifest = zip.by_name(MANIFEST).context("not a backup of Palmares")?;
    let manifest: Manifest =
        serde_json::from_reader(Bounded { entry: manifest, left: &mut left }).context(MANIFEST)?;
    if manifest.format != FORMAT {
        bail!("layout {}, this program reads {FORMAT}", manifest.format);
    }
    let mut unpacked = Unpacked::default();
    for i in 0..zip.len() {
        let entry = zip.by_index(i)?;
        let name = entry.name()?.into_owned();
        let entry = Bounded { entry, left: &mut left };
        unpacked.add(&name, entry, folder).with_context(|| format!("entry {name:?}"))?;
    }
    Ok(unpacked)
}

/// An entry of an archive that may unpack to a limited size.
struct Bounded<'a, R> {
    entry: R,
    /// What the rest of the archive may unpack to, bytes.
    left: &'a mut u64,
}

impl<R: Read> Read for Bounded<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.entry.read(buffer)?;
        let too_large =
            || io::Error::other(format!("the archive unpacks to more than {RATIO} times its size"));
        *self.left = self.left.checked_sub(count as u64).ok_or_else(too_large)?;
        Ok(count)
    }
}

impl Unpacked {
    fn add(&mut self, name: &str, entry: impl Read, folder: &Path) -> anyhow::Result<()> {
        if name == MANIFEST {
            return Ok(());
        }
        if let Some(table) = name.strip_prefix("tables/").and_then(|name| name.strip_suffix(".jsonl")) {
            if self.tables.iter().any(|(known, _)| known == table) {
                bail!("it is there twice");
            }
            let rows = BufReader::new(entry).lines().map(|line| Ok(serde_json::from_str(&line?)?));
            self.tables.push((table.to_owned(), rows.collect::<anyhow::Result<_>>()?));
            return Ok(());
        }
        let Some(stored) = name.strip_prefix("data/") else { bail!("a backup has no such entry") };
        if SECRETS.contains(&stored) {
            write(entry, &folder.join(stored))?;
            return Ok(());
        }
        let inside = if stored.starts_with(HANDS) { HANDS } else { REPLAYS };
        checked(inside, stored)?;
        make_folder(&folder.join(inside))?;
        let digest = write(entry, &folder.join(stored))?;
        self.digests.insert(stored.to_owned(), digest);
        Ok(())
    }

    /// Compares the files with the digests in the database. Returns notes about missing files.
    fn check(&self, allow_missing: bool) -> anyhow::Result<Vec<String>> {
        let (mut wrong, mut missing, mut notes) = (BTreeSet::new(), BTreeSet::new(), Vec::new());
        for NamedFile { owner, folder, stored, sha256, deletable } in self.named_files() {
            if let Err(error) = checked(folder, &stored) {
                wrong.insert(format!("{owner}: {error}"));
                continue;
            }
            match self.digests.get(&stored) {
                Some(digest) if Some(digest.as_str()) == sha256.as_deref() => {}
                Some(_) => {
                    wrong.insert(format!(
                        "{owner}: {stored} is not the file that was stored (SHA-256 differs)"
                    ));
                }
                None if deletable || allow_missing => notes.push(format!("{owner}: {stored} is missing")),
                None => {
                    missing.insert(format!("{owner}: {stored} is missing"));
                }
            }
        }
        if wrong.is_empty() && missing.is_empty() {
            return Ok(notes);
        }
        let advice = match wrong.is_empty() {
            true => "; --allow-missing restores without them",
            false => "",
        };
        let all: Vec<&String> = wrong.iter().chain(&missing).collect();
        let listed: Vec<&str> = all.iter().take(MAX_LISTED).map(|line| line.as_str()).collect();
        let more = match all.len().saturating_sub(MAX_LISTED) {
            0 => String::new(),
            more => format!("\n… and {more} more"),
        };
        bail!(
            "{} files are wrong or missing, nothing is restored{advice}:\n{}{more}",
            all.len(),
            listed.join("\n")
        )
    }

    /// Deletes the unpacked files that the database does not name, such as replays of open runs: nothing says that they are whole.
    fn drop_unnamed(&self, folder: &Path) -> io::Result<Vec<String>> {
        let named: BTreeSet<String> = self.named_files().into_iter().map(|file| file.stored).collect();
        let unnamed = self.digests.keys().filter(|stored| !named.contains(*stored));
        let drop = |stored: &String| {
            fs::remove_file(folder.join(stored))?;
            Ok(format!("{stored} belongs to no finished run and no hand: left out"))
        };
        unnamed.map(drop).collect()
    }

    /// The files that the database names.
    fn named_files(&self) -> Vec<NamedFile> {
        let text = |row: &Map<String, Value>, field: &str| row.get(field)?.as_str().map(str::to_owned);
        let is_null = |row: &Map<String, Value>, field: &str| row.get(field).is_none_or(Value::is_null);
        let mut files = Vec::new();
        for row in self.rows("runs") {
            if let Some(stored) = row.get("replay_path").filter(|stored| !stored.is_null()) {
                files.push(NamedFile {
                    owner: format!("run {}", text(row, "run_id").unwrap_or_default()),
                    folder: REPLAYS,
                    stored: stored.as_str().unwrap_or_default().to_owned(),
                    sha256: text(row, "replay_sha256"),
                    // Official runs have a number. The shared storage keeps what is in it.
                    deletable: is_null(row, "k") || !is_null(row, "replay_stored_at"),
                });
            }
            if let Some(sha256) = text(row, "hand_sha256") {
                files.push(NamedFile::hand(
                    format!("run {}", text(row, "run_id").unwrap_or_default()),
                    sha256,
                ));
            }
        }
        let stored = self.rows("hands").filter(|row| !is_null(row, "stored_at"));
        let stored: BTreeSet<String> = stored.filter_map(|row| text(row, "sha256")).collect();
        for row in self.rows("hands") {
            let sha256 = text(row, "sha256").unwrap_or_default();
            files.push(NamedFile::hand(format!("hand {}", text(row, "hand_id").unwrap_or_default()), sha256));
        }
        for file in files.iter_mut().filter(|file| file.folder == HANDS) {
            file.deletable |= file.sha256.as_ref().is_some_and(|sha256| stored.contains(sha256));
        }
        files
    }

    fn rows(&self, table: &str) -> impl Iterator<Item = &Map<String, Value>> {
        self.tables.iter().filter(move |(name, _)| name == table).flat_map(|(_, rows)| rows)
    }
}

/// A file that a row names.
struct NamedFile {
    /// For messages.
    owner: String,
    folder: &'static str,
    stored: String,
    sha256: Option<String>,
    /// The server may have deleted it while the backup was written, as it does with old practice replays.
    deletable: bool,
}

impl NamedFile {
    fn hand(owner: String, sha256: String) -> Self {
        let stored = stored_path::hand(&sha256);
        NamedFile { owner, folder: HANDS, stored, sha256: Some(sha256), deletable: false }
    }
}

/// Writes a new file that only its owner can read; returns its SHA-256.
fn write(mut from: impl Read, path: &Path) -> io::Result<String> {
    let mut file = File::options().write(true).create_new(true).mode(0o600).open(path)?;
    let mut hash = Sha256::new();
    let mut buffer = vec![0; 64 << 10];
    loop {
        match from.read(&mut buffer)? {
            0 => break,
            count => {
                hash.update(&buffer[..count]);
                file.write_all(&buffer[..count])?;
            }
        }
    }
    file.sync_all()?;
    Ok(hex::encode(hash.finalize()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;
    use zip::ZipWriter;
    use zip::write::SimpleFileOptions;

    /// An archive with a manifest and an entry of this many spaces.
    fn archive(name: &str, spaces: usize) -> Vec<u8> {
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        zip.start_file(MANIFEST, SimpleFileOptions::default()).expect("an entry");
        zip.write_all(br#"{"format":1,"server_version":"0.2.0","unix_ms":0}"#).expect("written");
        zip.start_file(name, SimpleFileOptions::default()).expect("an entry");
        zip.write_all(&vec![b' '; spaces]).expect("written");
        zip.finish().expect("an archive").into_inner()
    }

    #[test]
    fn an_archive_of_spaces_is_not_unpacked_whole() {
        for name in ["tables/runs.jsonl", "data/seed.secret"] {
            let folder = tempfile::tempdir().expect("a folder");
            let bytes = archive(name, 17 << 20);
            let error = unpack(Cursor::new(bytes), folder.path()).err().expect("refused");
            assert!(format!("{error:#}").contains("more than 100 times its size"), "{error:#}");
        }
        let folder = tempfile::tempdir().expect("a folder");
        assert!(unpack(Cursor::new(archive("data/seed.secret", 1 << 20)), folder.path()).is_ok());
    }
}
