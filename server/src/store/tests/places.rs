//! Databases for tests: an SQLite file, and a Postgres that lives as long as the tests do.

use crate::store::{Location, Store};
use sqlx::{ConnectOptions, Executor};
use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::str::FromStr;
use std::sync::OnceLock;

const SCRIPT: &str = include_str!("../../../../tests/throwaway-postgres.sh");

/// The server of this test process. Its script ends when its standard input closes, as it does with the process.
struct Postgres {
    folder: String,
    _script: (Child, Option<ChildStdin>),
}

/// The folder of its socket, or why there is none.
fn postgres() -> Result<&'static str, &'static str> {
    static POSTGRES: OnceLock<Result<Postgres, String>> = OnceLock::new();
    match POSTGRES.get_or_init(start) {
        Ok(postgres) => Ok(&postgres.folder),
        Err(why) => Err(why),
    }
}

fn start() -> Result<Postgres, String> {
    let root = Command::new("id").arg("-u").output().is_ok_and(|id| id.stdout == b"0\n");
    let mut script = if root {
        let mut command = Command::new("runuser");
        command.args(["-u", "postgres", "--", "sh"]);
        command
    } else {
        Command::new("sh")
    };
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

/// An empty database.
pub(crate) struct Place {
    location: Location,
    /// Removed in the end; a Postgres database goes with its server.
    folder: Option<PathBuf>,
}

impl Place {
    /// Opens the database.
    pub(crate) async fn open(&self) -> Store {
        Store::open(&self.location).await.expect("opens")
    }

    /// Where it is.
    pub(crate) fn location(&self) -> &Location {
        &self.location
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        if let Some(folder) = &self.folder {
            let _ = std::fs::remove_dir_all(folder);
        }
    }
}

fn unique() -> String {
    let mut name = [0; 8];
    getrandom::fill(&mut name).expect("randomness");
    format!("palmares_store_{:016x}", u64::from_le_bytes(name))
}

/// An empty database of every kind there is on this machine.
pub(crate) async fn places() -> Vec<Place> {
    let folder = std::env::temp_dir().join(unique());
    let mut places = vec![Place { location: Location::DataDir(folder.clone()), folder: Some(folder) }];
    match postgres() {
        Ok(folder) => {
            let (host, name) = (folder.replace('/', "%2F"), unique());
            let options =
                sqlx::postgres::PgConnectOptions::from_str(&format!("postgres://palmares@{host}/postgres"));
            let mut connection = options.expect("URL").connect().await.expect("connects");
            let create = sqlx::AssertSqlSafe(format!("CREATE DATABASE {name}"));
            connection.execute(create).await.expect("creates");
            let url = format!("postgres://palmares@{host}/{name}");
            places.push(Place { location: Location::Url(url), folder: None });
        }
        Err(why) => println!("SKIP on Postgres: {why}"),
    }
    places
}
