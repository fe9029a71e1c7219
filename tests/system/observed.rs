//! The server's reports about itself: metrics, OpenAPI, health.

use crate::harness::{Client, Server, get, program, request, reset};
use serde_json::{Value, json};
use std::process::Command;

/// The value of a line of the metrics.
fn metric(server: &Server, name: &str) -> f64 {
    let answer = get(server, "/metrics");
    assert!(answer.head.contains("content-type: application/openmetrics-text"), "{}", answer.head);
    assert!(answer.body.ends_with("# EOF\n"), "{}", answer.body);
    let line = answer.body.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
    line.unwrap_or_else(|| panic!("no {name} in\n{}", answer.body)).parse().expect("a number")
}

#[tokio::test]
async fn metrics_follow_what_happens() {
    let server = Server::start();
    assert_eq!(metric(&server, "palmares_ticks_total"), 0.0);
    let (mut client, _) = Client::greet(&server, "crabs").await;
    assert_eq!(
        (metric(&server, "palmares_sessions_open"), metric(&server, "palmares_worlds_open")),
        (1.0, 0.0)
    );
    assert_eq!(client.ask(reset()).await["op"], "obs");
    client.ask(json!({"op": "step", "tick": 0, "repeat": 7, "action": {}})).await;
    client.refused(json!({"op": "step", "tick": 0, "action": {}}), "stale_tick").await;
    assert_eq!(metric(&server, "palmares_worlds_open"), 1.0);
    assert_eq!(metric(&server, "palmares_ticks_total"), 7.0);
    assert_eq!(metric(&server, "palmares_permit_wait_seconds_count"), 7.0);
    assert_eq!(metric(&server, r#"palmares_refusals_total{code="stale_tick"}"#), 1.0);
    get(&server, "/nothing").assert_problem(404, "not_found");
    assert_eq!(metric(&server, r#"palmares_refusals_total{code="not_found"}"#), 1.0);
    client.ask(json!({"op": "stop"})).await;
    assert_eq!(metric(&server, "palmares_worlds_open"), 0.0);
}

#[test]
fn every_address_of_the_document_is_there() {
    let server = Server::start();
    let document = get(&server, "/openapi.json").json();
    assert_eq!(document["openapi"], "3.1.0");
    let paths = document["paths"].as_object().expect("paths");
    for (path, methods) in paths {
        for method in methods.as_object().expect("methods").keys() {
            let address = path.replace(['{', '}'], "x");
            let answer = request(&server, &method.to_uppercase(), &address);
            assert_ne!(answer.status, 405, "{method} {path}");
            let nothing = answer.status == 404 && answer.body.contains("nothing at");
            assert!(!nothing, "{method} {path}: {}", answer.body);
        }
    }
    // Answers have the fields that the document promises.
    for path in ["/v1/competition", "/v1/tasks", "/v1/hands", "/v1/leaderboard"] {
        let schema =
            &document["paths"][path]["get"]["responses"]["200"]["content"]["application/json"]["schema"];
        let reference = schema["$ref"].as_str().expect("a reference").trim_start_matches('#');
        let schema = document.pointer(reference).expect("a schema");
        let answer = get(&server, path).json();
        for name in schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str) {
            assert!(!answer[name].is_null() || answer.get(name).is_some(), "{path} lacks `{name}`: {answer}");
        }
    }
}

#[test]
fn health_differs_between_a_ready_server_and_one_that_is_gone() {
    let server = Server::start();
    let url = format!("http://{}", server.address());
    let health = || Command::new(program()).args(["health", "--url", &url]).output().expect("palmares runs");
    let well = health();
    assert!(well.status.success() && well.stdout == b"ready\n", "{well:?}");
    drop(server);
    let gone = health();
    assert!(!gone.status.success(), "{gone:?}");
    assert!(String::from_utf8_lossy(&gone.stderr).contains("is the server running?"), "{gone:?}");
}
