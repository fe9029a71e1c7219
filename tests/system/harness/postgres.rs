//! A Postgres for tests, which lives as long as the test process.

use sqlx::postgres::PgConnectOptions;
use sqlx::{AssertSqlSafe, ConnectOptions, Executor};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::str::FromStr;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};

const SCRIPT: &str = include_str!("../../throwaway-postgres.sh");

/// A server. Its script ends when its standard input closes, as it does with the process.
pub(crate) struct Postgres {
    /// The folder of its socket.
    folder: String,
    _script: (Child, Option<ChildStdin>),
}

/// The server of this test process, or why there is none.
fn postgres() -> Result<&'static Postgres, &'static str> {
    static POSTGRES: OnceLock<Result<Postgres, String>> = OnceLock::new();
    POSTGRES.get_or_init(|| Postgres::start(None)).as_ref().map_err(String::as_str)
}

impl Postgres {
    /// Starts one, with its files in a folder, or where temporary files are. The error says why there is none.
    pub(crate) fn start(within: Option<&Path>) -> Result<Self, String> {
        let root = Command::new("id").arg("-u").output().is_ok_and(|id| id.stdout == b"0\n");
        // Postgres refuses to run as root; Debian's package brings a user for it.
        let mut script = if root { Command::new("runuser") } else { Command::new("sh") };
        if root {
            if !Command::new("id").arg("postgres").output().is_ok_and(|id| id.status.success()) {
                return Err("there is no user postgres (Debian: apt-get install postgresql)".into());
            }
            script.args(["-u", "postgres", "--", "sh"]);
        }
        if let Some(within) = within {
            script.env("TMPDIR", within);
        }
        script.args(["-c", SCRIPT]).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut script = script.current_dir("/").spawn().map_err(|error| error.to_string())?;
        let mut folder = String::new();
        let output = script.stdout.take().ok_or("no output")?;
        BufReader::new(output).read_line(&mut folder).map_err(|error| error.to_string())?;
        if folder.is_empty() {
            return match script.wait().map_err(|error| error.to_string())?.code() {
                Some(3) => Err("Postgres is not installed (Debian: apt-get install postgresql)".into()),
                code => panic!("Postgres is installed but does not start: {code:?}"),
            };
        }
        let stdin = script.stdin.take();
        Ok(Postgres { folder: folder.trim().to_owned(), _script: (script, stdin) })
    }

    /// The URL of a new, empty database.
    pub(crate) async fn database(&self, name: &str) -> String {
        let host = self.folder.replace('/', "%2F");
        let options = PgConnectOptions::from_str(&format!("postgres://palmares@{host}/postgres"));
        let mut connection = options.expect("URL").connect().await.expect("connects");
        let create = AssertSqlSafe(format!("CREATE DATABASE {name}"));
        connection.execute(create).await.expect("creates");
        format!("postgres://palmares@{host}/{name}")
    }
}

/// The URL of a new, empty database; none without Postgres, with the reason printed.
pub(crate) async fn postgres_database() -> Option<String> {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    match postgres() {
        Ok(postgres) => {
            let name = format!("test_{}", COUNT.fetch_add(1, Ordering::Relaxed));
            Some(postgres.database(&name).await)
        }
        Err(why) => {
            println!("SKIP on Postgres: {why}");
            None
        }
    }
}
