//! Log lines on stderr, chosen with `RUST_LOG`.

use anyhow::Context;
use std::io::IsTerminal;
use tracing_subscriber::EnvFilter;

/// Starts logging.
///
/// # Errors
/// `RUST_LOG` cannot be parsed.
pub fn start() -> anyhow::Result<()> {
    let filter = match std::env::var("RUST_LOG") {
        Ok(directives) => EnvFilter::try_new(&directives).with_context(|| {
            format!("RUST_LOG={directives} cannot be parsed; try RUST_LOG=palmares=debug")
        })?,
        Err(_) => EnvFilter::new("info"),
    };
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        // It reports on stderr that stderr cannot be written, and panics: the reader of the log may have gone.
        .log_internal_errors(false)
        .init();
    Ok(())
}
