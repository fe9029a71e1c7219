//! Places at the watch socket: a crowd without tokens does not lock out those with one.

use crate::harness::{Client, Official, Server, handshake_to};
use serde_json::json;
use tempfile::TempDir;
use tokio_tungstenite::connect_async;
use tokio_tungstenite::tungstenite::Error;
use tokio_tungstenite::tungstenite::http::Request;

/// Places for viewers without a token.
const ANONYMOUS: usize = 256;

/// Checks that a handshake is refused for want of places.
async fn assert_full(request: Request<()>) {
    match connect_async(request).await {
        Err(Error::Http(response)) => {
            assert_eq!(response.status(), 503);
            assert!(response.headers().contains_key("retry-after"), "{response:?}");
            let body = response.body().as_deref().unwrap_or_default();
            let problem: serde_json::Value = serde_json::from_slice(body).expect("JSON");
            assert_eq!(problem["code"], "capacity", "{problem}");
        }
        other => panic!("expected a refusal, got {other:?}"),
    }
}

#[tokio::test]
async fn a_crowd_without_tokens_locks_nobody_out_who_has_one() {
    let cup = Official::start();
    let team = cup.team("crabs");
    cup.open();
    let screen = cup.order("token/add", json!({"role": "viewer", "label": "hall"}))["token"].clone();
    let screen = screen.as_str().expect("a token");
    let anonymous = || handshake_to(&cup.server, "/v1/watch", Some("palmares.v1.json"));
    let mut crowd = Vec::new();
    for _ in 0..ANONYMOUS {
        crowd.push(cup.watch(None).await);
    }
    assert_full(anonymous()).await;
    for token in [screen, &team, &cup.organizer] {
        let mut watcher = cup.watch(Some(token)).await;
        assert_eq!(watcher.ask(json!({"op": "list"})).await["op"], "runs");
    }
    cup.greet(&team).await;
    // Nor does a team take all places of the teams.
    let mut own = Vec::new();
    for _ in 0..16 {
        own.push(cup.watch(Some(&team)).await);
    }
    assert_full(cup.handshake("/v1/watch", &team)).await;
    let other = cup.team("eels");
    drop(cup.watch(Some(&other)).await);
    // A place is free as soon as the server has noticed the end of a connection.
    drop(crowd.pop());
    while connect_async(anonymous()).await.is_err() {
        tokio::time::sleep(std::time::Duration::from_millis(10)).await;
    }
}

#[tokio::test]
async fn clients_behind_a_trusted_proxy_are_counted_by_their_own_addresses() {
    let from = |server: &Server, path: &str, hops: &str| {
        let mut request = handshake_to(server, path, Some("palmares.v1.json"));
        request.headers_mut().insert("X-Forwarded-For", hops.parse().expect("a value"));
        request
    };
    let folder = TempDir::new().expect("temporary directory");
    let config = folder.path().join("competition.toml");
    std::fs::write(
        &config,
        "mode = \"practice\"\ntrusted_proxies = [\"127.0.0.1\", \"10.0.0.0/8\"]\nmax_connections_per_address = 2\n",
    )
    .expect("written");
    let server = Server::start_in(folder, &["--config", config.to_str().expect("a path")]);
    let hold = async |path, hops| connect_async(from(&server, path, hops)).await.expect("a place");
    let _first = hold("/v1/watch", "198.51.100.7").await;
    // Entries before the last hop are the client's own invention.
    let _second = hold("/v1/control", "203.0.113.5, 198.51.100.7, 10.0.0.3").await;
    for hops in ["198.51.100.7", "203.0.113.9, 198.51.100.7", "198.51.100.7, 10.0.0.3"] {
        assert_full(from(&server, "/v1/watch", hops)).await;
        assert_full(from(&server, "/v1/control", hops)).await;
    }
    let _other = hold("/v1/watch", "198.51.100.8").await;
    drop(Client::connect(&server).await);

    // Without the setting nobody's header counts.
    let server = Server::start_with(&["--max-connections-per-address", "2"]);
    let mut open = Vec::new();
    for _ in 0..4 {
        open.push(connect_async(from(&server, "/v1/watch", "198.51.100.7")).await.expect("a place"));
    }
}
