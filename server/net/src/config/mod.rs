//! Configuration of `palmares serve`: by options, environment variables and a file.

mod file;
mod network;
pub mod sensing;
pub mod settings;

use anyhow::bail;
use clap::Args;
use file::File;
pub use file::{CompetitionMode, MAX_SESSION_S};
pub use network::Network;
use palmares_models::measure::HandLimits;
use palmares_store::ALONE;
use palmares_tasks::Scenes;
use sensing::SensingRules;
use settings::Settings;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Default cost of an official reset, s: it limits how many scenes a team can look at.
const RESET_COST_S: f64 = 10.0;

/// The source of the seeds, in the data directory unless the configuration names another file.
pub const SEED_SECRET_FILE: &str = "seed.secret";
/// The key that signs replays, in the data directory unless the configuration names another file.
pub const SIGNING_KEY_FILE: &str = "signing.key";
/// The first organizer's token, in the data directory.
pub const ORGANIZER_TOKEN_FILE: &str = "organizer.token";

/// Options of `palmares serve`. Each can also be set by the environment variable shown with it, and most in the file of
/// --config. An option overrides the environment, which overrides the file.
#[derive(Args, Clone, Debug)]
pub struct ServeOptions {
    /// A file that describes the competition, such as competition.toml; needed for the official mode
    #[arg(long, value_name = "FILE", env = "PALMARES_CONFIG")]
    pub config: Option<PathBuf>,

    /// Address and port to listen on. Port 0 takes any free port; 0.0.0.0:8080 lets other machines in
    /// [default: 127.0.0.1:8080]
    #[arg(long, value_name = "ADDRESS:PORT", env = "PALMARES_LISTEN")]
    pub listen: Option<SocketAddr>,

    /// Directory for database, keys, replays and hands; created if it is missing [default: .palmares]
    #[arg(long, alias = "data", value_name = "DIR", env = "PALMARES_DATA_DIR")]
    pub data_dir: Option<PathBuf>,

    /// Database to use instead of the file in the data directory: sqlite:///path/to/file.sqlite or
    /// postgres://user@host/database
    #[arg(long, value_name = "URL", env = "DATABASE_URL", hide_env_values = true)]
    pub database_url: Option<String>,

    /// Files that several servers share, replays and uploaded hands: s3://bucket/prefix (AWS_ENDPOINT_URL, AWS_REGION,
    /// AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY in the environment) or file:///folder. The data directory keeps what this server
    /// wrote or read
    #[arg(long, value_name = "URL", env = "PALMARES_STORAGE")]
    pub storage: Option<String>,

    /// A hand of your own, in addition to the built-in ones: a URDF file, or a folder or .zip with one. May be given
    /// several times
    #[arg(long = "hand", value_name = "PATH")]
    pub hands: Vec<PathBuf>,

    /// A task of your own, in addition to the built-in ones: a folder with a task.toml. May be given several times
    #[arg(long = "task", value_name = "PATH")]
    pub tasks: Vec<PathBuf>,

    /// Sign replays with another key from now on: that of the key's file, or a new one if the file is lost. Replays with the earlier
    /// key stay valid. Without it, a server whose key is not the one that the database expects does not start
    #[arg(long)]
    pub replace_signing_key: bool,

    /// Do not record practice runs. Official runs are always recorded, since they count only after verification
    #[arg(long, env = "PALMARES_NO_REPLAYS")]
    pub no_replays: bool,

    /// Megabytes of practice replays to keep, one or two for a minute of a run; the oldest are deleted first
    #[arg(long, value_name = "MB", env = "PALMARES_PRACTICE_REPLAYS_MB", default_value_t = 2048)]
    pub practice_replays_mb: u64,

    /// Max open runs; further ones are refused with `capacity` [default: 32]
    #[arg(long, value_name = "N", env = "PALMARES_MAX_WORLDS", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub max_worlds: Option<u32>,

    /// Max control connections [default: 256]
    #[arg(long, value_name = "N", env = "PALMARES_MAX_CONNECTIONS",
          value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub max_connections: Option<u32>,

    /// Max control connections per team [default: 16]
    #[arg(long, value_name = "N", env = "PALMARES_MAX_CONNECTIONS_PER_TEAM",
          value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub max_connections_per_team: Option<u32>,

    /// Max connections of any kind from one address other than this machine's [default: 64]
    #[arg(long, value_name = "N", env = "PALMARES_MAX_CONNECTIONS_PER_ADDRESS",
          value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub max_connections_per_address: Option<u32>,

    /// A name of the server, for example behind a reverse proxy: cup.example.org. May be given several times. A server on the
    /// loopback interface answers only to its addresses, to localhost and to these names
    #[arg(long = "allowed-host", value_name = "NAME", env = "PALMARES_ALLOWED_HOSTS", value_delimiter = ',')]
    pub allowed_hosts: Vec<String>,

    /// A site whose pages may use the server, in addition to its own: https://cup.example.org. May be given several times
    #[arg(
        long = "allowed-origin",
        value_name = "ORIGIN",
        env = "PALMARES_ALLOWED_ORIGINS",
        value_delimiter = ','
    )]
    pub allowed_origins: Vec<String>,

    /// A reverse proxy whose X-Forwarded-For names the clients: its address, or a range such as 10.0.0.0/8. May be given several
    /// times
    #[arg(
        long = "trusted-proxy",
        value_name = "ADDRESS",
        env = "PALMARES_TRUSTED_PROXIES",
        value_delimiter = ','
    )]
    pub trusted_proxies: Vec<Network>,

    /// Max requests per second of a connection, with bursts of twice that number [default: 10000]
    #[arg(long, value_name = "N", env = "PALMARES_MAX_REQUESTS_PER_S", value_parser = clap::value_parser!(u32).range(1..))]
    pub max_requests_per_s: Option<u32>,

    /// Seconds for which a session waits for a client that lost its connection [default: 30]
    #[arg(long, value_name = "SECONDS", env = "PALMARES_RESUME_GRACE_S",
          value_parser = clap::value_parser!(u32).range(0..=3600))]
    pub resume_grace_s: Option<u32>,

    /// Seconds for scoring open runs when the server stops; a container's stop timeout should be 10 s longer [default: 30]
    #[arg(long, value_name = "SECONDS", env = "PALMARES_SHUTDOWN_GRACE_S",
          value_parser = clap::value_parser!(u32).range(0..=3600))]
    pub shutdown_grace_s: Option<u32>,

    /// The name of this server in a fleet: several servers that share one Postgres database and one competition. Each has a name of its
    /// own, which it keeps when it restarts
    #[arg(long, value_name = "NAME", env = "PALMARES_FLEET_HOST")]
    pub fleet_host: Option<String>,

    /// The address at which the other servers of the fleet reach this one: http://10.0.0.11:8080
    #[arg(long, value_name = "URL", env = "PALMARES_INTERNAL_URL")]
    pub internal_url: Option<String>,

    /// Seconds after which a client that is silent, or does not accept a message, is disconnected
    #[arg(long, value_name = "SECONDS", env = "PALMARES_PING_TIMEOUT_S", default_value_t = 15, hide = true,
          value_parser = clap::value_parser!(u32).range(1..=3600))]
    pub ping_timeout_s: u32,

    /// Seconds after which a control connection without a hello is closed
    #[arg(long, value_name = "SECONDS", env = "PALMARES_HELLO_TIMEOUT_S", default_value_t = 10, hide = true,
          value_parser = clap::value_parser!(u32).range(1..=3600))]
    pub hello_timeout_s: u32,
}

/// A server's part in a fleet: several servers that share one Postgres database and one competition.
#[derive(Clone, Debug, PartialEq)]
pub struct Fleet {
    /// Its name.
    pub host: String,
    /// The address at which the others reach it.
    pub internal_url: Option<String>,
}

/// The configuration of a server.
#[derive(Clone, Debug)]
pub struct Config {
    /// The file of --config.
    pub file: Option<PathBuf>,
    /// The competition's name, for people.
    pub name: String,
    /// Practice or official.
    pub mode: CompetitionMode,
    /// Length of a session, s; always set in the official mode.
    pub session_s: Option<f64>,
    /// Number of sessions of a team, in the official mode.
    pub sessions_per_team: u32,
    /// Cost of a reset, s.
    pub reset_cost_s: f64,
    /// Names of the built-in tasks to play; None for all.
    pub builtin_tasks: Option<Vec<String>>,
    /// Folders of further tasks.
    pub tasks: Vec<PathBuf>,
    /// Observations that controllers may have.
    pub sensing: SensingRules,
    /// Whether the seed of a run draws the uncertain numbers of its hand.
    pub hand_spread: bool,
    /// Whose scene run k of a task has, in the official mode.
    pub scenes: Scenes,
    /// Names of the built-in hands to play; None for all.
    pub builtin_hands: Option<Vec<String>>,
    /// Files of further hands.
    pub hands: Vec<PathBuf>,
    /// Limits on hands that are not built in.
    pub hand_limits: HandLimits,
    /// Address and port to listen on.
    pub listen: SocketAddr,
    /// Directory for keys, replays, uploaded hands, and the database unless it has a URL.
    pub data_dir: PathBuf,
    /// URL of the database; None for a file in the data directory.
    pub database_url: Option<String>,
    /// URL of the files that servers share.
    pub storage: Option<String>,
    /// This server's part in a fleet.
    pub fleet: Option<Fleet>,
    /// File of the secret from which official seeds are derived.
    pub seed_secret: PathBuf,
    /// File of the key that signs replays.
    pub signing_key: PathBuf,
    /// File of the first organizer's token, if it is not in the data directory.
    pub organizer_token: Option<PathBuf>,
    /// Whether another signing key replaces the expected one.
    pub replace_signing_key: bool,
    /// Whether practice runs are not recorded.
    pub no_replays: bool,
    /// Megabytes of practice replays to keep.
    pub practice_replays_mb: u64,
    /// Time for scoring open runs when the server stops.
    pub shutdown_grace: Duration,
    /// Names of the server, in addition to its addresses.
    pub allowed_hosts: Vec<String>,
    /// Sites whose pages may use the server, in addition to its own.
    pub allowed_origins: Vec<String>,
    /// Reverse proxies whose `X-Forwarded-For` names the clients.
    pub trusted_proxies: Vec<Network>,
    /// Limits and timeouts of connections and worlds.
    pub settings: Settings,
}

impl Config {
    /// The file of the settings, for messages.
    pub fn place(&self) -> String {
        self.file.as_ref().map_or_else(|| "the options".into(), |path| path.display().to_string())
    }

    /// The file of the first organizer's token.
    pub fn organizer_token_file(&self) -> PathBuf {
        self.organizer_token.clone().unwrap_or_else(|| self.data_dir.join(ORGANIZER_TOKEN_FILE))
    }
}

impl ServeOptions {
    /// Combines options, environment and file.
    ///
    /// # Errors
    /// The file cannot be read or is not valid.
    pub fn resolve(&self) -> anyhow::Result<Config> {
        let file = match &self.config {
            Some(path) => {
                let file = File::read(path)?;
                // An empty file must not open a practice server instead of a competition.
                if file.mode.is_none() {
                    bail!("{}: mode is missing: expected \"official\" or \"practice\"", path.display());
                }
                file
            }
            None => File::default(),
        };
        let folder = self.config.as_deref().and_then(Path::parent).unwrap_or(Path::new("")).to_owned();
        let inside = |path: &PathBuf| folder.join(path);
        let mode = file.mode.unwrap_or_default();
        let session_s = match (mode, file.session_s) {
            (_, Some(seconds)) => Some(seconds),
            (CompetitionMode::Official, None) => Some(1800.0),
            (CompetitionMode::Practice, None) => None,
        };
        let reset_cost_s =
            file.reset_cost_s.unwrap_or(if mode == CompetitionMode::Official { RESET_COST_S } else { 0.0 });
        if let (Some(path), Some(session_s)) = (&self.config, session_s)
            && reset_cost_s >= session_s
        {
            let path = path.display();
            bail!("{path}: reset_cost_s = {reset_cost_s}: expected less than session_s = {session_s}");
        }
        let data_dir = match (&self.data_dir, &file.data_dir) {
            (Some(path), _) => path.clone(),
            (None, Some(path)) => inside(path),
            (None, None) => ".palmares".into(),
        };
        let key = |path: &Option<PathBuf>, name: &str| path.as_ref().map_or(data_dir.join(name), inside);
        let mut hands: Vec<PathBuf> = file.hand_files.iter().flatten().map(inside).collect();
        hands.extend(self.hands.iter().cloned());
        let mut tasks: Vec<PathBuf> = file.task_files.iter().flatten().map(inside).collect();
        tasks.extend(self.tasks.iter().cloned());
        let both = |first: &[String], then: &Option<Vec<String>>| -> Vec<String> {
            first.iter().chain(then.iter().flatten()).cloned().collect()
        };
        let listen = self.listen.or(file.listen).unwrap_or((Ipv4Addr::LOCALHOST, 8080).into());
        let count =
            |option: Option<u32>, in_file: Option<u32>, usual| option.or(in_file).unwrap_or(usual) as usize;
        let seconds = |seconds| Duration::from_secs(u64::from(seconds));
        let database_url = self.database_url.clone().or(file.database_url.clone());
        let fleet = self.fleet(&file, database_url.as_deref())?;
        let default_name = if mode == CompetitionMode::Official { "competition" } else { "practice" };
        Ok(Config {
            file: self.config.clone(),
            name: file.name.clone().unwrap_or_else(|| default_name.into()),
            mode,
            session_s,
            sessions_per_team: file.sessions_per_team.unwrap_or(1),
            reset_cost_s,
            builtin_tasks: file.tasks.clone(),
            tasks,
            sensing: SensingRules::new(mode, file.noise, file.sensors_only.clone()),
            hand_spread: file.hand_spread,
            scenes: file.scenes,
            builtin_hands: file.hands.clone(),
            hands,
            hand_limits: file.hand_limits.clone(),
            listen,
            allowed_hosts: both(&self.allowed_hosts, &file.allowed_hosts),
            allowed_origins: both(&self.allowed_origins, &file.allowed_origins),
            trusted_proxies: self.trusted_proxies.iter().chain(&file.trusted_proxies).copied().collect(),
            seed_secret: key(&file.seed_secret, SEED_SECRET_FILE),
            signing_key: key(&file.signing_key, SIGNING_KEY_FILE),
            organizer_token: file.organizer_token.as_ref().map(inside),
            replace_signing_key: self.replace_signing_key,
            no_replays: self.no_replays,
            practice_replays_mb: self.practice_replays_mb,
            database_url,
            storage: self.storage.clone().or(file.storage.clone()),
            fleet,
            data_dir,
            shutdown_grace: seconds(self.shutdown_grace_s.or(file.shutdown_grace_s).unwrap_or(30)),
            settings: Settings {
                max_worlds: count(self.max_worlds, file.max_worlds, 32),
                max_connections: count(self.max_connections, file.max_connections, 256),
                max_connections_per_team: count(
                    self.max_connections_per_team,
                    file.max_connections_per_team,
                    16,
                ),
                max_connections_per_address: count(
                    self.max_connections_per_address,
                    file.max_connections_per_address,
                    64,
                ),
                hello_timeout: seconds(self.hello_timeout_s),
                requests_per_s: f64::from(
                    self.max_requests_per_s.or(file.max_requests_per_s).unwrap_or(10_000),
                ),
                resume_grace: seconds(self.resume_grace_s.or(file.resume_grace_s).unwrap_or(30)),
                ping_timeout: seconds(self.ping_timeout_s),
            },
        })
    }
}

impl ServeOptions {
    fn fleet(&self, file: &File, database_url: Option<&str>) -> anyhow::Result<Option<Fleet>> {
        let in_file = file.fleet.clone().unwrap_or_default();
        let internal_url = self.internal_url.clone().or(in_file.internal_url);
        let Some(host) = self.fleet_host.clone().or(in_file.host) else {
            if file.fleet.is_some() || internal_url.is_some() {
                bail!("fleet: give this server a name: host in [fleet], or --fleet-host");
            }
            return Ok(None);
        };
        let word = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
        if host.is_empty() || host.len() > 63 || host == ALONE || !host.chars().all(word) {
            bail!(
                "fleet host `{host}`: expected 1 to 63 letters, digits, `-`, `_` or `.`, and another name than `{ALONE}`"
            );
        }
        if let Some(url) = &internal_url {
            let valid = url.parse::<axum::http::Uri>().is_ok_and(|uri| {
                uri.scheme_str() == Some("http") && uri.authority().is_some() && uri.path() == "/"
            });
            if !valid {
                bail!("fleet internal_url `{url}`: expected http://ADDRESS:PORT");
            }
        }
        if !database_url.is_some_and(|url| url.starts_with("postgres")) {
            bail!("fleet host `{host}`: a fleet needs a Postgres database: database_url, or --database-url");
        }
        Ok(Some(Fleet { host, internal_url }))
    }
}

/// The limits on hands in a competition's file.
///
/// # Errors
/// The file cannot be read or is not valid.
pub fn hand_limits(path: &Path) -> anyhow::Result<HandLimits> {
    Ok(File::read(path)?.hand_limits)
}

/// Checks the text of a competition's file.
pub fn check(text: &str) -> anyhow::Result<()> {
    File::parse(Path::new("competition.toml"), text).map(drop)
}
