//! `cargo xtask pages`: the pictures of README and docs, and the load of the pages, from the running program.

use crate::apt;
use crate::cargo::{build_example, build_server};
use crate::python::Environment;
use crate::viewer::Viewer;
use anyhow::{Context, Result, ensure};
use clap::ValueEnum;
use std::path::Path;

/// Pictures or measurements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Wanted {
    /// Take the pictures in docs/pictures again.
    Pictures,
    /// Print bytes, script time, draw calls and latency.
    Measure,
}

/// Runs the pages in Chromium, with a release build of the server. `pictures` go into another folder, and are only those whose test
/// has these words in its name.
pub(crate) fn run(wanted: Wanted, pictures: Option<(&Path, Option<&str>)>) -> Result<()> {
    let chromium = apt::chromium()
        .context("Chromium is not installed (Debian's package `chromium`), and could not be")?;
    let viewer = Viewer::prepare()?;
    viewer.build()?;
    let program = build_server(true)?;
    let environment = Environment::prepare()?;
    let script = match wanted {
        Wanted::Pictures => "pictures",
        Wanted::Measure => "measure",
    };
    let mut pages = viewer.npm(&["run", "--silent", "tools", "--", script]);
    pages
        .env("PALMARES_SERVER_BIN", program)
        .env("PALMARES_CHROMIUM", chromium)
        .env("PALMARES_CLIENT_PYTHON", environment.interpreter());
    if wanted == Wanted::Measure {
        pages.env("PALMARES_VIEWERS", build_example("palmares-tests", "viewers")?);
    }
    if let Some((folder, words)) = pictures {
        pages.env("PALMARES_PICTURES", folder).args(words.iter().flat_map(|words| ["--grep", *words]));
    }
    let status = pages.status().context("cannot start npm")?;
    ensure!(status.success(), "the pages could not be run; see above");
    Ok(())
}
