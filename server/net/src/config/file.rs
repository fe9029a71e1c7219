//! The file `competition.toml`.

use super::network::Network;
use anyhow::{Context, bail};
use palmares_models::measure::HandLimits;
use palmares_tasks::{Noise, Scenes};
use serde::Deserialize;
use std::fmt::{Debug, Display};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

/// Longest session, s.
pub const MAX_SESSION_S: f64 = 86_400.0;

/// Practice or official competition.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, strum::IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum CompetitionMode {
    /// No tokens, seeds by the client, no time limit.
    #[default]
    Practice,
    /// Tokens for teams, hidden seeds, limited time, verified scores.
    Official,
}

/// The content of the file. A server needs `mode`; all else is optional.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct File {
    pub(super) name: Option<String>,
    pub(super) mode: Option<CompetitionMode>,
    pub(super) session_s: Option<f64>,
    pub(super) sessions_per_team: Option<u32>,
    pub(super) reset_cost_s: Option<f64>,
    pub(super) tasks: Option<Vec<String>>,
    pub(super) task_files: Option<Vec<PathBuf>>,
    pub(super) noise: Option<Noise>,
    pub(super) sensors_only: Vec<String>,
    pub(super) hand_spread: bool,
    pub(super) scenes: Scenes,
    pub(super) hands: Option<Vec<String>>,
    pub(super) hand_files: Option<Vec<PathBuf>>,
    pub(super) listen: Option<SocketAddr>,
    pub(super) data_dir: Option<PathBuf>,
    pub(super) database_url: Option<String>,
    pub(super) storage: Option<String>,
    pub(super) seed_secret: Option<PathBuf>,
    pub(super) signing_key: Option<PathBuf>,
    pub(super) organizer_token: Option<PathBuf>,
    pub(super) max_worlds: Option<u32>,
    pub(super) max_connections: Option<u32>,
    pub(super) max_connections_per_team: Option<u32>,
    pub(super) max_connections_per_address: Option<u32>,
    pub(super) allowed_hosts: Option<Vec<String>>,
    pub(super) allowed_origins: Option<Vec<String>>,
    pub(super) trusted_proxies: Vec<Network>,
    pub(super) max_requests_per_s: Option<u32>,
    pub(super) resume_grace_s: Option<u32>,
    pub(super) shutdown_grace_s: Option<u32>,
    pub(super) hand_limits: HandLimits,
    pub(super) fleet: Option<Fleet>,
}

/// This server's part in a fleet, several servers that share one competition.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct Fleet {
    pub(super) host: Option<String>,
    pub(super) internal_url: Option<String>,
}

impl File {
    /// Reads and checks a file.
    pub(super) fn read(path: &Path) -> anyhow::Result<Self> {
        Self::parse(path, &read(path)?)
    }

    pub(super) fn parse(path: &Path, text: &str) -> anyhow::Result<Self> {
        // The full message would show the line, which may contain a password.
        let file: File = toml::from_str(text).map_err(|error| {
            let before = error.span().map_or("", |span| text.get(..span.start).unwrap_or_default());
            let line = before.matches('\n').count() + 1;
            anyhow::anyhow!("{}, line {line}: {}", path.display(), error.message())
        })?;
        if let Some(seconds) = file.session_s
            && !(seconds > 0.0 && seconds <= MAX_SESSION_S)
        {
            let path = path.display();
            bail!("{path}: session_s = {seconds}: expected more than 0 and at most {MAX_SESSION_S} s");
        }
        in_range(path, "reset_cost_s", file.reset_cost_s, 0.0, 3600.0)?;
        in_range(path, "sessions_per_team", file.sessions_per_team, 1, 1000)?;
        in_range(path, "max_worlds", file.max_worlds, 1, 4096)?;
        in_range(path, "max_connections", file.max_connections, 1, 65_536)?;
        in_range(path, "max_connections_per_team", file.max_connections_per_team, 1, 65_536)?;
        in_range(path, "max_connections_per_address", file.max_connections_per_address, 1, 65_536)?;
        in_range(path, "max_requests_per_s", file.max_requests_per_s, 1, u32::MAX)?;
        in_range(path, "resume_grace_s", file.resume_grace_s, 0, 3600)?;
        in_range(path, "shutdown_grace_s", file.shutdown_grace_s, 0, 3600)?;
        once(path, "tasks", file.tasks.as_deref())?;
        once(path, "task_files", file.task_files.as_deref())?;
        once(path, "sensors_only", Some(&file.sensors_only))?;
        once(path, "hands", file.hands.as_deref())?;
        once(path, "hand_files", file.hand_files.as_deref())?;
        if let Err(problem) = file.hand_limits.check() {
            bail!("{}: {problem}", path.display());
        }
        if let Some(name) = &file.name
            && (name.trim().is_empty() || name.chars().count() > 200 || name.chars().any(char::is_control))
        {
            bail!("{}: name: expected 1 to 200 characters, none of them a control character", path.display());
        }
        Ok(file)
    }
}

/// Checks a number of the file against the range of the same option.
pub(super) fn in_range<T: PartialOrd + Display>(
    path: &Path,
    field: &str,
    value: Option<T>,
    min: T,
    max: T,
) -> anyhow::Result<()> {
    match value {
        Some(value) if !(value >= min && value <= max) => {
            bail!("{}: {field} = {value}: expected {min} to {max}", path.display())
        }
        _ => Ok(()),
    }
}

/// Checks that no value of a list is there twice.
fn once<T: PartialEq + Debug>(path: &Path, field: &str, values: Option<&[T]>) -> anyhow::Result<()> {
    let values = values.unwrap_or_default();
    match values.iter().enumerate().find(|(k, value)| values[..*k].contains(value)) {
        Some((_, twice)) => bail!("{}: {field}: {twice:?} is there twice, expected once", path.display()),
        None => Ok(()),
    }
}

/// Reads a text file.
pub(super) fn read(path: &Path) -> anyhow::Result<String> {
    std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<File, String> {
        File::parse(Path::new("competition.toml"), text).map_err(|error| error.to_string())
    }

    #[test]
    fn the_fields_of_the_file_are_read() {
        let file = parse("name = \"Cup\"\nmode = \"official\"\nsession_s = 600\nlisten = \"0.0.0.0:80\"")
            .expect("reads");
        assert_eq!(
            (file.name.as_deref(), file.mode, file.session_s),
            (Some("Cup"), Some(CompetitionMode::Official), Some(600.0))
        );
        assert!(parse("").is_ok());
    }

    #[test]
    fn an_error_names_file_line_and_what_would_be_valid() {
        let error = parse("name = \"Cup\"\nsesion_s = 3").expect_err("misspelt");
        assert!(error.starts_with("competition.toml, line 2: "), "{error}");
        assert!(error.contains("`sesion_s`") && error.contains("`session_s`"), "{error}");
        let error = parse("scenes = \"per team\"").expect_err("no scenes");
        assert!(
            error.contains("line 1") && error.contains("`shared`") && error.contains("`per_team`"),
            "{error}"
        );
        let error = parse("\n\nmode = \"fun\"").expect_err("no mode");
        assert!(
            error.contains("line 3") && error.contains("`practice`") && error.contains("`official`"),
            "{error}"
        );
        for wrong in [
            "session_s = 0",
            "session_s = nan",
            "reset_cost_s = -1",
            "reset_cost_s = nan",
            "sessions_per_team = 0",
            "max_worlds = 9999",
            "name = ' '",
        ] {
            let error = parse(wrong).expect_err(wrong);
            assert!(error.starts_with("competition.toml: ") && error.contains("expected"), "{error}");
        }
    }

    #[test]
    fn a_proxy_is_an_address_or_a_range() {
        let file = parse("trusted_proxies = [\"127.0.0.1\", \"10.0.0.0/8\"]").expect("reads");
        assert_eq!(file.trusted_proxies.len(), 2);
        let error = parse("\ntrusted_proxies = [\"proxy.example.org\"]").expect_err("a name");
        assert!(error.contains("line 2") && error.contains("10.0.0.0/8"), "{error}");
    }

    #[test]
    fn a_list_has_each_value_once() {
        for (field, value) in [
            ("tasks", "balls"),
            ("hands", "pinch"),
            ("sensors_only", "shelf"),
            ("task_files", "a"),
            ("hand_files", "b"),
        ] {
            assert!(parse(&format!("{field} = [\"{value}\", \"other\"]")).is_ok());
            let error = parse(&format!("{field} = [\"{value}\", \"other\", \"{value}\"]")).expect_err(field);
            assert_eq!(
                error,
                format!("competition.toml: {field}: \"{value}\" is there twice, expected once")
            );
        }
    }

    #[test]
    fn limits_of_hands_are_fields_of_a_table() {
        let file = parse("[hand_limits]\nfriction = 1.2\nlinks = 200\nsize_m = inf").expect("reads");
        let limits = file.hand_limits;
        assert_eq!((limits.friction, limits.links, limits.size_m), (1.2, 200.0, f64::INFINITY));
        assert_eq!(limits.mass_kg, HandLimits::default().mass_kg);
        let error = parse("name = \"Cup\"\n[hand_limits]\nsize_m = 1\nfricton = 1.2").expect_err("misspelt");
        assert!(error.starts_with("competition.toml, line 4: "), "{error}");
        assert!(error.contains("`fricton`") && error.contains("`friction`"), "{error}");
        let error = parse("[hand_limits]\nmass_kg = -1").expect_err("negative");
        assert_eq!(
            error,
            "competition.toml: hand_limits.mass_kg = -1: expected more than 0; inf for no limit"
        );
    }

    #[test]
    fn a_password_in_a_broken_line_is_not_repeated() {
        let error = parse("database_url = \"postgres://me:secret@host\" x").expect_err("broken");
        assert!(error.contains("line 1") && !error.contains("secret"), "{error}");
    }
}
