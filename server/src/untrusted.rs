//! The readers of bytes that may come from anybody, for the fuzz targets.

use crate::backup::restore;
use crate::competition::hands;
use crate::watch;
use palmares_models::measure::HandLimits;
use palmares_net::config;
use palmares_tasks::Task;
use std::io::Cursor;
use std::path::Path;
use std::sync::{Arc, OnceLock};

/// Reads a request of a viewer; whether it is valid.
pub fn watch_request(text: &str) -> bool {
    watch::is_request(text)
}

/// Reads a `competition.toml`; whether it is valid.
pub fn competition(text: &str) -> bool {
    config::check(text).is_ok()
}

/// Checks a hand's archive as an upload; whether it is taken.
pub fn hand_upload(archive: &[u8]) -> bool {
    static TASKS: OnceLock<Vec<Arc<Task>>> = OnceLock::new();
    hands::check(archive, &HandLimits::default(), TASKS.get_or_init(Task::builtin)).is_ok()
}

/// Unpacks a backup into an empty folder and checks it; whether a restore would fill the database with it.
pub fn backup(archive: &[u8], folder: &Path) -> bool {
    restore::unpack_checked(Cursor::new(archive), folder, false).is_ok()
}
