//! The process: its start and stop, its log, its version.

pub mod lifecycle;
pub mod logging;
pub mod version;
