//! What `palmares serve` can be told.

use crate::session::Settings;
use crate::store::Location;
use clap::Args;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

/// Options of `palmares serve`. Each can also be set by the environment variable shown with it.
#[derive(Args, Clone, Debug)]
pub(crate) struct ServeOptions {
    /// Address and port to listen on. Port 0 takes any free port; 0.0.0.0:8080 lets other machines in
    #[arg(long, value_name = "ADDRESS:PORT", env = "PALMARES_LISTEN", default_value = "127.0.0.1:8080")]
    pub(crate) listen: SocketAddr,

    /// Directory for the database; created when it is missing
    #[arg(long, alias = "data", value_name = "DIR", env = "PALMARES_DATA_DIR", default_value = ".palmares")]
    pub(crate) data_dir: PathBuf,

    /// Database to use instead of the file in the data directory: sqlite:///path/to/file.sqlite
    #[arg(long, value_name = "URL", env = "DATABASE_URL", hide_env_values = true)]
    pub(crate) database_url: Option<String>,

    /// A hand of your own beside those that come with the program: a URDF file, or a folder or .zip with one. May be
    /// given several times
    #[arg(long = "hand", value_name = "PATH")]
    pub(crate) hands: Vec<PathBuf>,

    /// Do not record practice runs. Official runs are always recorded: they count only when they replay
    #[arg(long, env = "PALMARES_NO_REPLAYS")]
    pub(crate) no_replays: bool,

    /// Megabytes of practice replays that are kept, a megabyte or two for a minute of run; the oldest are deleted
    #[arg(long, value_name = "MB", env = "PALMARES_PRACTICE_REPLAYS_MB", default_value_t = 2048)]
    pub(crate) practice_replays_mb: u64,

    /// Runs that may be open at once; further ones are refused with `capacity`
    #[arg(long, value_name = "N", env = "PALMARES_MAX_WORLDS", default_value_t = 32,
          value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub(crate) max_worlds: u32,

    /// Control connections that may be open at once
    #[arg(long, value_name = "N", env = "PALMARES_MAX_CONNECTIONS", default_value_t = 256,
          value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub(crate) max_connections: u32,

    /// Requests per second that a connection may keep up; twice as many at once
    #[arg(long, value_name = "N", env = "PALMARES_MAX_REQUESTS_PER_S", default_value_t = 10_000,
          value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) max_requests_per_s: u32,

    /// How long a session waits for a client that lost its connection, in seconds
    #[arg(long, value_name = "SECONDS", env = "PALMARES_RESUME_GRACE_S", default_value_t = 30,
          value_parser = clap::value_parser!(u32).range(0..=3600))]
    pub(crate) resume_grace_s: u32,

    /// A client that gives no sign of life for this long, or does not take a message for this long, is taken for gone,
    /// in seconds
    #[arg(long, value_name = "SECONDS", env = "PALMARES_PING_TIMEOUT_S", default_value_t = 15, hide = true,
          value_parser = clap::value_parser!(u32).range(1..=3600))]
    pub(crate) ping_timeout_s: u32,
}

impl ServeOptions {
    /// Where the database is.
    pub(crate) fn location(&self) -> Location {
        match &self.database_url {
            Some(url) => Location::Url(url.clone()),
            None => Location::DataDir(self.data_dir.clone()),
        }
    }

    /// What sessions need to know.
    pub(crate) fn settings(&self) -> Settings {
        Settings {
            max_worlds: self.max_worlds as usize,
            max_connections: self.max_connections as usize,
            requests_per_s: f64::from(self.max_requests_per_s),
            resume_grace: Duration::from_secs(u64::from(self.resume_grace_s)),
            ping_timeout: Duration::from_secs(u64::from(self.ping_timeout_s)),
        }
    }
}
