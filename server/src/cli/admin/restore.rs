//! `palmares admin restore`.

use crate::backup;
use crate::store::{Location, Store};
use anyhow::Context;
use clap::Args;
use std::path::PathBuf;

/// Where a backup goes.
#[derive(Args, Debug)]
pub(super) struct RestoreOptions {
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
pub(super) fn restore(options: &RestoreOptions) -> anyhow::Result<()> {
    let folder = &options.data_dir;
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let location = match &options.database_url {
        Some(url) => Location::Url(url.clone()),
        None => Location::DataDir(folder.clone()),
    };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    runtime.context("cannot start the asynchronous runtime")?.block_on(async {
        let store = Store::open(&location).await?;
        let restored = backup::restore(&options.file, folder, &store).await;
        store.close().await;
        restored
    })?;
    eprintln!("restored into {}", folder.display());
    Ok(())
}
