//! `palmares keys`.

use crate::server;
use anyhow::Context;
use std::io::Write;
use std::path::Path;

/// Makes the secrets of a competition and prints their public halves.
pub(crate) fn keys(folder: &Path, owner: Option<u32>) -> anyhow::Result<()> {
    let made = server::new_keys(folder, owner)?;
    let text = serde_json::to_string_pretty(&made)?;
    writeln!(std::io::stdout().lock(), "{text}").context("cannot write to stdout")
}
