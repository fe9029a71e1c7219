//! Restores a backup.

use crate::backup;
use crate::store::{Host, Location, Store};
use anyhow::Context;
use std::path::Path;

/// Restores a backup into a data directory, and into the database of a URL instead of a file there. Both must be empty.
///
/// # Errors
/// One of them is not empty or cannot be written, or the backup cannot be read.
pub fn restore(file: &Path, data_dir: &Path, database_url: Option<&str>) -> anyhow::Result<()> {
    std::fs::create_dir_all(data_dir).with_context(|| format!("cannot make {}", data_dir.display()))?;
    let location = Location::new(data_dir, database_url.map(str::to_owned));
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    runtime.context("cannot start the asynchronous runtime")?.block_on(async {
        let store = Store::open(&location, &Host::alone()).await?;
        let restored = backup::restore(file, data_dir, &store).await;
        store.close().await;
        restored
    })
}
