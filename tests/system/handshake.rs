//! The WebSocket handshake.

use crate::harness::{Server, get, handshake};
use serde_json::Value;
use tokio_tungstenite::connect_async;
use tokio_tungstenite::tungstenite::Error;

#[tokio::test]
async fn without_a_common_subprotocol_the_handshake_is_refused() {
    let server = Server::start();
    for offered in [None, Some("chat"), Some("palmares.v2.json, palmares.v1.cbor")] {
        match connect_async(handshake(&server, offered)).await {
            Err(Error::Http(response)) => {
                assert_eq!(response.status(), 400);
                assert_eq!(response.headers()["content-type"], "application/problem+json");
                let body: Value =
                    serde_json::from_slice(response.body().as_deref().unwrap_or_default()).expect("JSON");
                assert_eq!(body["code"], "bad_request");
                assert!(body["detail"].as_str().is_some_and(|text| text.contains("palmares.v1.json")));
            }
            other => panic!("{offered:?}: {other:?}"),
        }
    }
}

#[tokio::test]
async fn the_subprotocol_is_chosen_among_several() {
    let server = Server::start();
    for known in ["palmares.v1.json", "palmares.v1.msgpack"] {
        let offered = format!("palmares.v9.cbor, {known}");
        let (_, response) = connect_async(handshake(&server, Some(&offered))).await.expect("connects");
        assert_eq!(response.headers()["sec-websocket-protocol"], known);
    }
}

#[tokio::test]
async fn a_plain_get_of_the_control_socket_is_a_problem() {
    get(&Server::start(), "/v1/control").assert_problem(400, "bad_request");
}
