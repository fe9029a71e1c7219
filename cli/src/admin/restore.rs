//! `palmares admin restore`.

use crate::server;
use clap::Args;
use std::path::PathBuf;

/// Where a backup goes.
#[derive(Args, Debug)]
pub(crate) struct RestoreOptions {
    /// The backup
    file: PathBuf,

    /// An empty directory, or one that is not there yet
    #[arg(long, value_name = "DIR")]
    data_dir: PathBuf,

    /// An empty database instead of a file in the data directory; may be of another kind than the backup's
    #[arg(long, value_name = "URL", env = "DATABASE_URL", hide_env_values = true)]
    database_url: Option<String>,
}

/// Restores.
pub(crate) fn restore(options: &RestoreOptions) -> anyhow::Result<()> {
    server::restore(&options.file, &options.data_dir, options.database_url.as_deref())?;
    eprintln!("restored into {}", options.data_dir.display());
    Ok(())
}
