//! `palmares admin restore`.

use crate::server;
use clap::Args;
use std::path::PathBuf;

/// Options of the restoration.
#[derive(Args, Debug)]
pub(crate) struct RestoreOptions {
    /// The backup's file
    file: PathBuf,

    /// An empty directory, or one that does not exist yet
    #[arg(long, value_name = "DIR")]
    data_dir: PathBuf,

    /// URL of an empty database instead of a file in the data directory; its kind may differ from the backup's
    #[arg(long, value_name = "URL", env = "DATABASE_URL", hide_env_values = true)]
    database_url: Option<String>,

    /// Restore although the backup lacks replays or hands; each one is named
    #[arg(long)]
    allow_missing: bool,
}

/// Restores a backup.
pub(crate) fn restore(options: &RestoreOptions) -> anyhow::Result<()> {
    let RestoreOptions { file, data_dir, database_url, allow_missing } = options;
    for note in server::restore(file, data_dir, database_url.as_deref(), *allow_missing)? {
        eprintln!("note: {note}");
    }
    eprintln!("restored into {}", data_dir.display());
    Ok(())
}
