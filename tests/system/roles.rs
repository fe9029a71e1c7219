//! Every address and every op of both sockets, for every kind of client. The addresses come from the OpenAPI document, the ops from
//! the schemas, so that a new one fails here until it has a rule.

use crate::hands_upload::claw;
use crate::harness::raw::{Frame, Got, RawSocket, TEXT, answer_to};
use crate::harness::{Official, bearer, exchange, get, official_reset, send};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::Path;

/// The kinds of clients, in the order of the columns.
const CLIENTS: [&str; 9] = [
    "no token",
    "a broken token",
    "another scheme",
    "an unknown token",
    "a revoked token",
    "viewer",
    "the team",
    "another team",
    "organizer",
];

/// The status for each kind of client; `.` is any but 401, 403, 404, 405 and 5xx. An address has `METHOD path`.
const RULES: &[(&str, &str)] = &[
    // Pages and public data ignore tokens.
    ("get /", PUBLIC),
    ("get /admin", PUBLIC),
    ("get /assets/plain.css", PUBLIC),
    ("get /assets/{file}", "404 404 404 404 404 404 404 404 404"),
    ("get /docs", PUBLIC),
    ("get /docs/files/{path}", "404 404 404 404 404 404 404 404 404"),
    ("get /docs/search", PUBLIC),
    ("get /docs/{path}", "404 404 404 404 404 404 404 404 404"),
    ("get /drive", PUBLIC),
    ("get /hands", PUBLIC),
    ("get /hands/{name}", PUBLIC),
    ("get /healthz", PUBLIC),
    ("get /live", PUBLIC),
    ("get /live/{session}", PUBLIC),
    ("get /metrics", PUBLIC),
    ("get /openapi.json", PUBLIC),
    ("get /readyz", PUBLIC),
    ("get /replay", PUBLIC),
    ("get /replay/{run}", PUBLIC),
    ("get /v1/announcements", PUBLIC),
    ("get /v1/competition", PUBLIC),
    ("get /v1/leaderboard", PUBLIC),
    ("get /v1/leaderboard.csv", PUBLIC),
    ("get /v1/tasks", PUBLIC),
    ("get /teams/{name}", PUBLIC),
    ("get /wall", PUBLIC),
    // With a token, more is visible.
    ("get /v1/hands", OPTIONAL),
    ("get /v1/runs", OPTIONAL),
    ("get /v1/watch", OPTIONAL),
    // An uploaded hand is its team's.
    ("get /v1/hands/{name}", OWN_HAND),
    ("post /v1/hands/{name}/equilibrium", OWN_HAND),
    ("get /v1/hands/{name}/visuals", OWN_HAND),
    // A team sees only the leaderboard of other teams, until the seeds are public.
    ("get /v1/runs/{id}", "403 401 401 401 401 . . 403 ."),
    ("get /v1/runs/{id}/replay", "403 401 401 401 401 403 403 403 ."),
    ("get /v1/sessions", "401 401 401 401 401 . . . ."),
    // Only other hosts, with their proof.
    ("get /v1/internal/watch/{run}", "401 401 401 401 401 401 401 401 401"),
    // Teams play.
    ("get /v1/control", TEAMS),
    ("post /v1/hands", TEAMS),
    // Organizers run the competition.
    ("post /v1/admin/announcement", ORGANIZERS),
    ("get /v1/admin/audit", ORGANIZERS),
    ("get /v1/admin/backup", ORGANIZERS),
    ("post /v1/admin/competition/{verb}", ORGANIZERS),
    ("get /v1/admin/schedule", ORGANIZERS),
    ("post /v1/admin/schedule/{verb}", ORGANIZERS),
    ("get /v1/admin/export/{what}", ORGANIZERS),
    ("post /v1/admin/hand/{verb}", ORGANIZERS),
    ("get /v1/admin/hands", ORGANIZERS),
    ("get /v1/admin/hands/{id}", ORGANIZERS),
    ("get /v1/admin/hands/{id}/archive", ORGANIZERS),
    ("post /v1/admin/run/{verb}", ORGANIZERS),
    ("get /v1/admin/runs", ORGANIZERS),
    ("post /v1/admin/session/{verb}", ORGANIZERS),
    ("get /v1/admin/similar", ORGANIZERS),
    ("post /v1/admin/team/add", ORGANIZERS),
    ("post /v1/admin/team/check", ORGANIZERS),
    ("post /v1/admin/team/revoke", ORGANIZERS),
    ("post /v1/admin/team/rotate", ORGANIZERS),
    ("get /v1/admin/teams", ORGANIZERS),
    ("post /v1/admin/token/add", ORGANIZERS),
    ("post /v1/admin/token/revoke", ORGANIZERS),
    ("get /v1/admin/tokens", ORGANIZERS),
];

const PUBLIC: &str = ". . . . . . . . .";
const OPTIONAL: &str = ". 401 401 401 401 . . . .";
const OWN_HAND: &str = "404 401 401 401 401 404 . 404 404";
const TEAMS: &str = "401 401 401 401 401 403 . . 403";
const ORGANIZERS: &str = "401 401 401 401 401 403 403 403 .";

/// Requests of the watch socket about a run of the team, and the error for each kind of client that can open it; `.` is none.
const WATCH_RULES: &[(&str, &str)] = &[
    ("bye", ". . . . ."),
    ("list", ". . . . ."),
    ("subscribe run_id", "not_authorized . . forbidden ."),
    ("subscribe session_id", "not_authorized . . forbidden ."),
    ("subscribe featured", ". . . . ."),
    ("subscribe leaderboard", ". . . . ."),
];

/// Requests of the control socket. Only teams open it, each for its own session.
const CONTROL_OPS: [&str; 8] = ["act", "bye", "hello", "perturb", "reset", "step", "stop", "time"];

/// A competition with an open run, and the headers of each kind of client.
struct Hall {
    cup: Official,
    headers: [String; 9],
    hand_id: String,
    /// A finished run of the team, and an open one.
    recorded_id: String,
    run_id: String,
    session_id: String,
    /// The team's connection.
    _playing: crate::harness::Client,
}

impl Hall {
    async fn open() -> Self {
        let cup = Official::start();
        let (team, other, gone) = (cup.team("crabs"), cup.team("eels"), cup.team("gone"));
        cup.order("team/revoke", json!({"team": "gone", "reason": "a test"}));
        let viewer = cup.order("token/add", json!({"role": "viewer", "label": "hall"}))["token"].clone();
        cup.open();
        let hand = send(&cup.server, "POST", "/v1/hands", &bearer(&team), &claw("claw")).json();
        let (mut playing, welcome) = cup.greet(&team).await;
        let mut reset = official_reset();
        reset["sensing"] = json!("truth");
        let recorded = playing.ask(reset.clone()).await;
        playing.goes_on(0).await;
        playing.ask(json!({"op": "stop"})).await;
        let obs = playing.ask(reset).await;
        let text = |value: &Value| value.as_str().expect("a text").to_owned();
        Hall {
            headers: [
                String::new(),
                bearer("plm_x"),
                "Authorization: Basic YTpi\r\n".to_owned(),
                bearer(&format!("plm_{}_{}", "0".repeat(16), "0".repeat(64))),
                bearer(&gone),
                bearer(viewer.as_str().expect("a token")),
                bearer(&team),
                bearer(&other),
                bearer(&cup.organizer),
            ],
            hand_id: text(&hand["hand_id"]),
            recorded_id: text(&recorded["run_id"]),
            run_id: text(&obs["run_id"]),
            session_id: text(&welcome["session_id"]),
            _playing: playing,
            cup,
        }
    }

    /// The addresses of an operation, with every value of its variable part.
    fn addresses(&self, path: &str, operation: &Value) -> Vec<String> {
        let words = operation["parameters"][0]["schema"]["enum"].as_array();
        if let Some(words) = words {
            let word = |word: &Value| word.as_str().expect("a word").to_owned();
            return words
                .iter()
                .map(|value| path.replace("{verb}", &word(value)).replace("{what}", &word(value)))
                .collect();
        }
        let id = if path.contains("/hands/") { &self.hand_id } else { &self.recorded_id };
        let path = path.replace("{id}", id).replace("{run}", id).replace("{name}", "claw");
        vec![path.replace("{session}", &self.session_id).replace("{file}", "none.js")]
    }

    /// Status and code of the answer to a request; to a handshake where the address is a socket.
    fn answer(&self, method: &str, path: &str, socket: bool, headers: &str) -> (u16, Value) {
        let server = &self.cup.server;
        if !socket {
            // A body that is refused even by those who may send it: nothing changes.
            let (status, _, body) = exchange(server, method, path, headers, br#"{"nonsense": 1}"#);
            let problem: Value = serde_json::from_slice(&body).unwrap_or_default();
            return (status, problem["code"].clone());
        }
        let (_stream, answer) = answer_to(
            server,
            &format!(
                "GET {path} HTTP/1.1\r\nHost: {}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
             Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: palmares.v1.json\r\n{headers}\r\n",
                server.address()
            ),
        );
        let status = answer.split(' ').nth(1).and_then(|status| status.parse().ok()).expect("a status");
        // The problem after the head is tested elsewhere.
        let code = match status {
            401 => "not_authorized",
            403 => "forbidden",
            _ => "",
        };
        (status, json!(code))
    }
}

#[tokio::test]
async fn every_address_admits_those_whom_its_rule_names() {
    let hall = Hall::open().await;
    let document: Value = get(&hall.cup.server, "/openapi.json").json();
    let (mut wrong, mut known) = (Vec::new(), BTreeSet::new());
    for (path, operations) in document["paths"].as_object().expect("paths") {
        for (method, operation) in operations.as_object().expect("methods") {
            let name = format!("{method} {path}");
            let Some((_, rule)) = RULES.iter().find(|(address, _)| *address == name) else {
                wrong.push(format!("{name}: no rule in RULES of tests/system/roles.rs"));
                continue;
            };
            let socket = operation["responses"].get("101").is_some();
            for address in hall.addresses(path, operation) {
                for ((client, headers), expected) in CLIENTS.iter().zip(&hall.headers).zip(rule.split(' ')) {
                    let (status, code) = hall.answer(&method.to_uppercase(), &address, socket, headers);
                    let same = match expected {
                        "." => !matches!(status, 401 | 403 | 404 | 405 | 500..),
                        "401" => status == 401 && code == "not_authorized",
                        "403" => status == 403 && code == "forbidden",
                        other => status.to_string() == other,
                    };
                    if !same {
                        let got = format!("{status} {code}");
                        wrong.push(format!("{method} {address} with {client}: {got}, expected {expected}"));
                    }
                }
            }
            known.insert(name);
        }
    }
    let gone = RULES.iter().map(|(name, _)| *name).filter(|name| !known.contains(*name));
    wrong.extend(gone.map(|name| format!("{name}: a rule without an address")));
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The ops of a socket, from its schema.
fn ops(socket: &str) -> Vec<String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../docs/schema/{socket}.json"));
    let schema: Value =
        serde_json::from_str(&std::fs::read_to_string(path).expect("a schema")).expect("JSON");
    schema["requests"].as_object().expect("requests").keys().cloned().collect()
}

/// The code of the error that answers a request; `.` without an error.
fn code(socket: &mut RawSocket, request: &Value) -> String {
    socket.send(&Frame::new(TEXT, request.to_string()).bytes());
    loop {
        match socket.next() {
            Got::Text(text) => {
                let message: Value = serde_json::from_str(&text).expect("JSON");
                if message["id"] == request["id"] {
                    return message["code"].as_str().unwrap_or(".").to_owned();
                }
            }
            Got::Close(Some(1000), _) => return ".".into(),
            other => panic!("{request}: {other:?}"),
        }
    }
}

#[tokio::test]
async fn every_op_admits_those_whom_its_rule_names() {
    let hall = Hall::open().await;
    let server = &hall.cup.server;
    let named: BTreeSet<&str> = WATCH_RULES.iter().filter_map(|(name, _)| name.split(' ').next()).collect();
    assert_eq!(ops("watch"), named.into_iter().collect::<Vec<_>>(), "WATCH_RULES of tests/system/roles.rs");
    assert_eq!(ops("control"), CONTROL_OPS, "CONTROL_OPS of tests/system/roles.rs");
    let mut wrong = Vec::new();
    let allowed = [0, 5, 6, 7, 8].map(|k| (CLIENTS[k], hall.headers[k].as_str()));
    for (name, rule) in WATCH_RULES {
        let (op, target) = name.split_once(' ').unwrap_or((name, ""));
        let mut request = json!({"op": op, "id": 1});
        match target {
            "" => {}
            "run_id" => request[target] = json!(hall.run_id),
            "session_id" => request[target] = json!(hall.session_id),
            flag => request[flag] = json!(true),
        }
        for ((client, headers), expected) in allowed.into_iter().zip(rule.split(' ')) {
            let mut socket = RawSocket::open_with(server, "/v1/watch", "palmares.v1.json", headers);
            let got = code(&mut socket, &request);
            if got != expected {
                wrong.push(format!("{name} with {client}: {got}, expected {expected}"));
            }
        }
    }
    // Nothing that another team sends reaches the team's run: it has no session there, or begins its own.
    for op in CONTROL_OPS {
        let request = json!({"op": op, "id": 1, "client": "x", "session_id": hall.session_id});
        let mut socket = RawSocket::open_with(server, "/v1/control", "palmares.v1.json", &hall.headers[7]);
        let got = code(&mut socket, &request);
        if !["bad_request", "wrong_state"].contains(&got.as_str()) {
            wrong.push(format!("{op} with another team: {got}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let run = hall.cup.get(&format!("/v1/runs/{}", hall.run_id), &hall.cup.organizer).json();
    assert_eq!(run["status"], "open", "{run}");
}

#[test]
fn an_address_that_is_no_text_is_a_problem() {
    let cup = Official::start();
    for path in ["/v1/runs/%ff%fe", "/v1/runs/%ff/replay", "/v1/hands/%ff"] {
        get(&cup.server, path).assert_problem(400, "bad_request");
    }
    for path in ["/v1/admin/audit?after=x", "/v1/admin/export/%ff", "/v1/admin/export/runs?nonsense=1"] {
        cup.get(path, &cup.organizer).assert_problem(400, "bad_request");
    }
}
