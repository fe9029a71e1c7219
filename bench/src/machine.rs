//! The machine and the commit of a measurement.

use serde::{Deserialize, Serialize};
use std::fs;
use std::process::Command;

/// A machine.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Machine {
    /// Name of the processor.
    pub processor: String,
    /// Threads it runs at once.
    pub threads: usize,
    /// Operating system and architecture.
    pub system: String,
    /// Load average over a minute when the report began, if the system reports it.
    pub load: Option<f64>,
}

impl Machine {
    /// This one.
    pub fn here() -> Self {
        let read = |path: &str| fs::read_to_string(path).unwrap_or_default();
        let info = read("/proc/cpuinfo");
        let name = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
        Machine {
            processor: name.map_or("unknown processor", |(_, name)| name.trim()).to_owned(),
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            load: read("/proc/loadavg").split(' ').next().and_then(|load| load.parse().ok()),
        }
    }
}

/// Short name of the checked-out commit, with a `+` if files are changed; `unknown` outside a repository.
pub fn commit() -> String {
    let git = |arguments: &[&str]| {
        let output = Command::new("git").args(arguments).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let Some(commit) = git(&["rev-parse", "--short=10", "HEAD"]) else { return "unknown".into() };
    // A page that was written before does not make the program another one.
    let pages = [":!docs", ":!README.md", ":!models/hands/grasps.toml"];
    let changed = git(&[&["status", "--porcelain", "--untracked-files=no", "--"], &pages[..]].concat());
    if changed.is_some_and(|changed| !changed.is_empty()) { format!("{commit}+") } else { commit }
}
