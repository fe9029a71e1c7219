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
}

/// Restores a backup.
pub(crate) fn restore(options: &RestoreOptions) -> anyhow::Result<()> {
    server::restore(&options.file, &options.data_dir, options.database_url.as_deref())?;
    eprintln!("restored into {}", options.data_dir.display());
    Ok(())
}
