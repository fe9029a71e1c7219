//! A backup: one ZIP archive with every table as lines of JSON, replays, uploaded hands and keys. It can be written while the server
//! runs, and [restored](crate::backup::restore) into another kind of database.

pub(crate) mod restore;

use anyhow::Context;
use palmares_store::Table;
use palmares_store::files::blocking::assert_may_block;
use palmares_store::files::stored_path::{HANDS, REPLAYS, checked};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use zip::write::{SimpleFileOptions, StreamWriter};
use zip::{CompressionMethod, ZipWriter};

/// Version of the archive's layout.
pub(crate) const FORMAT: u32 = 1;
/// The entry that describes the archive.
pub(crate) const MANIFEST: &str = "manifest.json";
/// Secret files in a backup, by their names in the data directory.
pub(crate) const SECRETS: [&str; 2] = ["seed.secret", "signing.key"];

/// Describes an archive.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Manifest {
    /// Version of its layout.
    pub(crate) format: u32,
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
        unix_ms: palmares_store::unix_ms(),
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
    // A practice server has no seed secret.
    for (name, path) in &files.secrets {
        add(&mut zip, &format!("data/{name}"), path, options)?;
    }
    // Replays are compressed already.
    let uncompressed = options.compression_method(CompressionMethod::Stored).large_file(true);
    for folder in [REPLAYS, HANDS] {
        add_folder(&mut zip, &files.data_dir, folder, uncompressed)?;
    }
    zip.finish()?.into_inner().flush()?;
    Ok(())
}

/// Adds a file, if there is one: an old practice replay may be deleted at any time.
fn add<W: Write>(
    zip: &mut ZipWriter<StreamWriter<W>>,
    name: &str,
    path: &Path,
    options: SimpleFileOptions,
) -> anyhow::Result<()> {
    let mut file = match File::open(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        opened => opened.with_context(|| format!("cannot read {}", path.display()))?,
    };
    zip.start_file(name, options)?;
    io::copy(&mut file, zip).with_context(|| format!("cannot copy {}", path.display()))?;
    Ok(())
}

/// Adds the server's files in a folder of the data directory.
fn add_folder<W: Write>(
    zip: &mut ZipWriter<StreamWriter<W>>,
    data_dir: &Path,
    folder: &str,
    options: SimpleFileOptions,
) -> anyhow::Result<()> {
    let path = data_dir.join(folder);
    let failed = || format!("cannot read {}", path.display());
    let entries = match std::fs::read_dir(&path) {
        Ok(entries) => entries.collect::<io::Result<Vec<_>>>().with_context(failed)?,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(error).with_context(failed),
    };
    let stored = entries.iter().filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_file()));
    let mut stored: Vec<String> =
        stored.filter_map(|entry| Some(format!("{folder}/{}", entry.file_name().to_str()?))).collect();
    stored.retain(|stored| checked(folder, stored).is_ok());
    stored.sort();
    for stored in stored {
        add(zip, &format!("data/{stored}"), &data_dir.join(&stored), options)?;
    }
    Ok(())
}
