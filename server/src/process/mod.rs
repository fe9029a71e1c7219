//! The process: its start and stop, its log, its version.

pub(crate) mod lifecycle;
pub(crate) mod logging;
pub(crate) mod version;
