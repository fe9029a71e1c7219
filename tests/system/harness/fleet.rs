//! Hosts of one fleet, on a Postgres database of their own.

use super::{Client, Official, RULES, postgres_database};
use serde_json::{Value, json};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Longer than a lease and the claim after it.
pub(crate) const TAKEN_OVER: Duration = Duration::from_millis(3500);

/// Rules of a host.
pub(crate) fn rules(host: &str, port: u16) -> String {
    format!("{RULES}[fleet]\nhost = \"{host}\"\ninternal_url = \"http://127.0.0.1:{port}\"\n")
}

pub(crate) fn free_port() -> u16 {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a free port");
    listener.local_addr().expect("bound").port()
}

/// The address of hosts that only this machine reaches.
pub(crate) const LOOPBACK: &str = "127.0.0.1";

/// Starts a host of a fleet at an address, with these rules and its own. `like` is a host whose keys it gets.
pub(crate) fn host(name: &str, url: &str, like: Option<&Official>, more: &str, address: &str) -> Official {
    let folder = TempDir::new().expect("temporary directory");
    if let Some(first) = like {
        for file in ["seed.secret", "signing.key", "organizer.token"] {
            let from = first.server.folder().join(file);
            std::fs::copy(from, folder.path().join(file)).expect("the first host has it");
        }
    }
    let port = free_port();
    let listen = format!("{address}:{port}");
    let rules = more.to_owned() + &rules(name, port).replace(LOOPBACK, address);
    Official::start_with(folder, &rules, Some(url.to_owned()), &["--listen", &listen])
}

/// Two hosts of an open competition, and a team's token; None without Postgres.
pub(crate) async fn two_hosts() -> Option<(Official, Official, String)> {
    two_hosts_with("", LOOPBACK).await
}

/// The same with more rules, at an address.
pub(crate) async fn two_hosts_with(more: &str, address: &str) -> Option<(Official, Official, String)> {
    let url = postgres_database().await?;
    let first = host("h1", &url, None, more, address);
    let second = host("h2", &url, Some(&first), more, address);
    first.open();
    let team = first.team("crabs");
    Some((first, second, team))
}

/// Says hello with a resume token until the host has the session.
pub(crate) async fn resumed(official: &Official, team: &str, token: &Value) -> (Client, Value) {
    let began = Instant::now();
    loop {
        let mut client = official.connect(team).await;
        let welcome = client.ask(json!({"op": "hello", "client": "test", "resume_token": token})).await;
        if welcome["op"] == "welcome" {
            return (client, welcome);
        }
        assert!(began.elapsed() < 3 * TAKEN_OVER, "{welcome}");
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
}
