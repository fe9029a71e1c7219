//! A backup: one ZIP archive with every table as lines of JSON, replays, uploaded hands and keys. It can be written while the server
//! runs, and restored into another kind of database.

use crate::blocking::assert_may_block;
use crate::store::{Store, Table};
use anyhow::{Context, bail};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Component, Path, PathBuf};
use zip::write::{SimpleFileOptions, StreamWriter};
use zip::{CompressionMethod, ZipArchive, ZipWriter};

/// Version of the archive's layout.
const FORMAT: u32 = 1;
const MANIFEST: &str = "manifest.json";
/// Folders of the data directory in a backup.
const FOLDERS: [&str; 2] = ["replays", "hands"];

#[derive(Debug, Serialize, Deserialize)]
struct Manifest {
    format: u32,
    server_version: String,
    unix_ms: i64,
}

/// The files of a running server.
#[derive(Clone, Debug)]
pub(crate) struct Files {
    /// The data directory.
    pub(crate) data_dir: PathBuf,
    /// Secret files: name in the data directory of a restored server, and current path.
    pub(crate) secrets: Vec<(&'static str, PathBuf)>,
}

/// Writes a backup as a stream.
///
/// # Errors
/// A file cannot be read, or `to` cannot be written.
pub(crate) fn write(to: impl Write, tables: &[Table], files: &Files) -> anyhow::Result<()> {
    assert_may_block();
    let mut zip = ZipWriter::new_stream(to);
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    let manifest = Manifest {
        format: FORMAT,
        server_version: env!("CARGO_PKG_VERSION").into(),
        unix_ms: crate::store::unix_ms(),
    };
    zip.start_file(MANIFEST, options)?;
    serde_json::to_writer(&mut zip, &manifest)?;
    for (name, rows) in tables {
        zip.start_file(format!("tables/{name}.jsonl"), options)?;
        for row in rows {
            serde_json::to_writer(&mut zip, row)?;
            zip.write_all(b"\n")?;
        }
    }
    for (name, path) in &files.secrets {
        // A practice server has no seed secret.
        if path.exists() {
            add(&mut zip, &format!("data/{name}"), path, options)?;
        }
    }
    // Replays are compressed already.
    let stored = options.compression_method(CompressionMethod::Stored).large_file(true);
    for folder in FOLDERS {
        add_folder(&mut zip, &format!("data/{folder}"), &files.data_dir.join(folder), stored)?;
    }
    zip.finish()?.into_inner().flush()?;
    Ok(())
}

fn add<W: Write>(
    zip: &mut ZipWriter<StreamWriter<W>>,
    name: &str,
    path: &Path,
    options: SimpleFileOptions,
) -> anyhow::Result<()> {
    let mut file = File::open(path).with_context(|| format!("cannot read {}", path.display()))?;
    zip.start_file(name, options)?;
    io::copy(&mut file, zip).with_context(|| format!("cannot copy {}", path.display()))?;
    Ok(())
}

fn add_folder<W: Write>(
    zip: &mut ZipWriter<StreamWriter<W>>,
    name: &str,
    folder: &Path,
    options: SimpleFileOptions,
) -> anyhow::Result<()> {
    let entries = match std::fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(error).with_context(|| format!("cannot read {}", folder.display())),
    };
    let mut entries = entries.collect::<io::Result<Vec<_>>>()?;
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        let (path, kind) = (entry.path(), entry.file_type()?);
        let Ok(leaf) = entry.file_name().into_string() else { continue };
        let inner = format!("{name}/{leaf}");
        if kind.is_dir() {
            add_folder(zip, &inner, &path, options)?;
        } else if kind.is_file() {
            add(zip, &inner, &path, options)?;
        }
    }
    Ok(())
}

/// Restores a backup into an empty data directory and an empty database.
///
/// # Errors
/// One of them is not empty, the file is no valid backup, or something cannot be written.
pub(crate) async fn restore(archive: &Path, data_dir: &Path, store: &Store) -> anyhow::Result<()> {
    let what = || archive.display().to_string();
    let file = File::open(archive).with_context(|| format!("cannot read {}", what()))?;
    let no_backup = || format!("{}: not a backup of Palmares", what());
    let mut zip = ZipArchive::new(BufReader::new(file)).with_context(no_backup)?;
    let manifest = zip.by_name(MANIFEST).with_context(no_backup)?;
    let manifest: Manifest = serde_json::from_reader(manifest).with_context(what)?;
    if manifest.format != FORMAT {
        bail!("{}: layout {}, this program reads {FORMAT}", what(), manifest.format);
    }
    if !store.is_empty().await? {
        bail!("the database is not empty; a backup is restored into an empty one");
    }
    let places = ["seed.secret", "signing.key", "replays", "hands"];
    if let Some(name) = places.iter().find(|name| data_dir.join(name).exists()) {
        bail!(
            "{} has a {name} already; a backup is restored into an empty data directory",
            data_dir.display()
        );
    }
    let mut tables: Vec<Table> = Vec::new();
    for i in 0..zip.len() {
        let entry = zip.by_index(i).with_context(what)?;
        let name = entry.name().with_context(what)?.into_owned();
        if let Some(table) = name.strip_prefix("tables/").and_then(|name| name.strip_suffix(".jsonl")) {
            let mut rows = Vec::new();
            for line in BufReader::new(entry).lines() {
                rows.push(serde_json::from_str(&line?).with_context(|| format!("{}: {name}", what()))?);
            }
            tables.push((table.to_owned(), rows));
        } else if let Some(inner) = name.strip_prefix("data/") {
            unpack(entry, Path::new(inner), data_dir).with_context(|| format!("{}: {name}", what()))?;
        }
    }
    // After the files: rows without their files would be worse than files without rows.
    store.fill(&tables).await?;
    Ok(())
}

fn unpack(mut entry: impl Read, inner: &Path, data_dir: &Path) -> anyhow::Result<()> {
    if inner.components().any(|part| !matches!(part, Component::Normal(_))) {
        bail!("the path leaves the data directory");
    }
    let path = data_dir.join(inner);
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    // Readable by the owner only, since keys are among the files.
    let mut file = File::options().write(true).create_new(true).mode(0o600).open(&path)?;
    io::copy(&mut entry, &mut file)?;
    file.sync_all()?;
    Ok(())
}
