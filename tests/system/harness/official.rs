//! An official competition: a server with its file, an organizer, teams with tokens.

use super::client::{Client, handshake_to};
use super::http::{Response, send};
use super::postgres::postgres_database;
use super::server::{Server, program};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;
use tempfile::TempDir;
use tokio_tungstenite::connect_async;
use tokio_tungstenite::tungstenite::Error;
use tokio_tungstenite::tungstenite::http::Request;

/// The rules of most tests; what a reset costs has its own.
pub(crate) const RULES: &str =
    "name = \"Test Cup\"\nmode = \"official\"\nsession_s = 600\nsessions_per_team = 1\nreset_cost_s = 0\n";

/// A running competition.
pub(crate) struct Official {
    /// Its server.
    pub(crate) server: Server,
    /// The first organizer's token.
    pub(crate) organizer: String,
    /// URL of the database, if it is not a file.
    pub(crate) database_url: Option<String>,
}

/// A team's token as a header.
pub(crate) fn bearer(token: &str) -> String {
    format!("Authorization: Bearer {token}\r\n")
}

impl Official {
    /// A competition that is closed, on SQLite.
    pub(crate) fn start() -> Self {
        Self::start_on(TempDir::new().expect("temporary directory"), RULES, None)
    }

    /// One on each kind of database there is on this machine.
    pub(crate) async fn each() -> Vec<Self> {
        let mut all = vec![Self::start()];
        if let Some(url) = postgres_database().await {
            all.push(Self::start_on(TempDir::new().expect("temporary directory"), RULES, Some(url)));
        }
        all
    }

    /// One with other rules, or on a data directory that exists.
    pub(crate) fn start_on(folder: TempDir, rules: &str, database_url: Option<String>) -> Self {
        Self::start_with(folder, rules, database_url, &[])
    }

    /// The same with more arguments.
    pub(crate) fn start_with(
        folder: TempDir,
        rules: &str,
        database_url: Option<String>,
        more: &[&str],
    ) -> Self {
        let file = folder.path().join("competition.toml");
        fs::write(&file, rules).expect("rules");
        let mut arguments = vec!["--config", file.to_str().expect("a path")];
        arguments.extend(more);
        if let Some(url) = &database_url {
            arguments.extend(["--database-url", url]);
        }
        let token = folder.path().join("organizer.token");
        let server = Server::start_in(folder, &arguments);
        let organizer = fs::read_to_string(token).expect("an organizer's token").trim().to_owned();
        Official { server, organizer, database_url }
    }

    /// The same after a SIGKILL and a new start.
    pub(crate) fn crashed(self) -> Self {
        let database_url = self.database_url.clone();
        let (folder, rules) = self.killed();
        Self::start_on(folder, &rules, database_url)
    }

    /// Kills the server with SIGKILL; returns the data directory and the rules.
    pub(crate) fn killed(self) -> (TempDir, String) {
        let folder = self.server.kill();
        let rules = fs::read_to_string(folder.path().join("competition.toml")).expect("rules");
        (folder, rules)
    }

    /// The data directory.
    pub(crate) fn folder(&self) -> PathBuf {
        self.server.database().parent().map(Path::to_owned).expect("a folder")
    }

    /// GETs with a token.
    pub(crate) fn get(&self, path: &str, token: &str) -> Response {
        send(&self.server, "GET", path, &bearer(token), b"")
    }

    /// POSTs JSON with a token.
    pub(crate) fn post(&self, path: &str, token: &str, body: &Value) -> Response {
        send(&self.server, "POST", path, &bearer(token), body.to_string().as_bytes())
    }

    /// An organizer's order that must succeed.
    pub(crate) fn order(&self, path: &str, body: Value) -> Value {
        let answer = self.post(&format!("/v1/admin/{path}"), &self.organizer, &body);
        assert_eq!(answer.status, 200, "{path} {body}: {}", answer.body);
        answer.json()
    }

    /// An organizer's order that may fail; whether it was done.
    pub(crate) fn order_or_not(&self, path: &str, body: Value) -> bool {
        let answer = self.post(&format!("/v1/admin/{path}"), &self.organizer, &body);
        assert!(answer.status == 200 || answer.status == 500, "{path} {body}: {}", answer.body);
        answer.status == 200
    }

    /// Adds a team; returns its token.
    pub(crate) fn team(&self, name: &str) -> String {
        let answer = self.order("team/add", json!({"team": name}));
        answer["token"].as_str().expect("a token").to_owned()
    }

    /// Opens the competition.
    pub(crate) fn open(&self) {
        self.order("competition/open", json!({}));
    }

    /// Runs `palmares admin`.
    pub(crate) fn admin(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(program());
        command.args(["admin", "--url", &format!("http://{}", self.server.address())]).args(arguments);
        command.env_remove("DATABASE_URL").env("PALMARES_TOKEN", &self.organizer).stdin(Stdio::null());
        command.output().expect("palmares runs")
    }

    /// The handshake of a team.
    pub(crate) fn handshake(&self, path: &str, token: &str) -> Request<()> {
        let mut request = handshake_to(&self.server, path, Some("palmares.v1.json"));
        let value = format!("Bearer {token}").parse().expect("a header");
        request.headers_mut().insert("Authorization", value);
        request
    }

    /// A connection of a team without a message yet.
    pub(crate) async fn connect(&self, token: &str) -> Client {
        let (socket, _) = connect_async(self.handshake("/v1/control", token)).await.expect("connects");
        Client::over(socket)
    }

    /// A spectator's connection, with a token or without.
    pub(crate) async fn watch(&self, token: Option<&str>) -> Client {
        match token {
            None => Client::connect_to(&self.server, "/v1/watch").await,
            Some(token) => {
                let (socket, _) = connect_async(self.handshake("/v1/watch", token)).await.expect("connects");
                Client::over(socket)
            }
        }
    }

    /// The status with which a handshake is refused.
    pub(crate) async fn refused(&self, request: Request<()>) -> u16 {
        match connect_async(request).await {
            Err(Error::Http(response)) => response.status().as_u16(),
            other => panic!("expected a refusal, got {other:?}"),
        }
    }

    /// Waits until the server has played a run's replay again with the same result.
    pub(crate) async fn verified(&self, run_id: &Value) {
        let path = format!("/v1/runs/{}", run_id.as_str().expect("an id"));
        let mut run = self.get(&path, &self.organizer).json();
        while run["status"] == "provisional" || run["verify_state"] == "waiting" {
            tokio::time::sleep(Duration::from_millis(50)).await;
            run = self.get(&path, &self.organizer).json();
        }
        assert_eq!(run["status"], "verified", "{run}");
    }

    /// A team that has said hello; and the welcome.
    pub(crate) async fn greet(&self, token: &str) -> (Client, Value) {
        let mut client = self.connect(token).await;
        let hello = json!({"op": "hello", "client": "test"});
        let mut welcome = client.ask(hello.clone()).await;
        // The server may not have noticed yet that an earlier connection is gone.
        while welcome["code"] == "session_taken" {
            tokio::time::sleep(Duration::from_millis(20)).await;
            welcome = client.ask(hello.clone()).await;
        }
        assert_eq!(welcome["op"], "welcome", "{welcome}");
        (client, welcome)
    }

    /// A team with an open run; and the welcome.
    pub(crate) async fn playing(&self, token: &str) -> (Client, Value, Value) {
        let (mut client, welcome) = self.greet(token).await;
        let mut obs = client.ask(reset()).await;
        // On a busy machine a world waits for its place, as that of any client.
        while obs["code"] == "capacity" {
            tokio::time::sleep(Duration::from_millis(100)).await;
            obs = client.ask(reset()).await;
        }
        assert_eq!(obs["op"], "obs", "{obs}");
        (client, welcome, obs)
    }
}

/// An official run as most tests open it.
pub(crate) fn reset() -> Value {
    json!({"op": "reset", "task": "balls", "hand": "softhand"})
}
