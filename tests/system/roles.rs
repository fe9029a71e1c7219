//! Every address, with every kind of token: a missing one gives 401, an insufficient one 403.

use crate::harness::{Official, bearer, get, send};
use serde_json::{Value, json};

/// The expected refusal of a credential, if any.
fn expected(needs: &str, credential: &str) -> Option<u16> {
    match (needs, credential) {
        (_, "broken" | "unknown" | "revoked" | "other scheme") => Some(401),
        ("organizer" | "required" | "team", "none") => Some(401),
        ("organizer", "team" | "viewer") => Some(403),
        ("team", "organizer" | "viewer") => Some(403),
        _ => None,
    }
}

#[test]
fn a_token_that_is_missing_is_401_and_one_of_the_wrong_role_403() {
    let cup = Official::start();
    let team = cup.team("crabs");
    let revoked = cup.team("gone");
    cup.order("team/revoke", json!({"team": "gone", "reason": "a test"}));
    let viewer = cup.order("token/add", json!({"role": "viewer", "label": "hall"}))["token"].clone();
    let credentials = [
        ("none", String::new()),
        ("broken", bearer("plm_x")),
        ("unknown", bearer(&format!("plm_{}_{}", "0".repeat(16), "0".repeat(64)))),
        ("other scheme", "Authorization: Basic YTpi\r\n".to_owned()),
        ("revoked", bearer(&revoked)),
        ("team", bearer(&team)),
        ("viewer", bearer(viewer.as_str().expect("a token"))),
        ("organizer", bearer(&cup.organizer)),
    ];
    let document: Value = get(&cup.server, "/openapi.json").json();
    let mut seen = 0;
    for (path, operations) in document["paths"].as_object().expect("paths") {
        for (method, _) in operations.as_object().expect("methods") {
            let needs = match (path.as_str(), method.as_str()) {
                // A GET that is no handshake fails before anything else does.
                ("/v1/control" | "/v1/watch", _) => continue,
                (path, _) if path.starts_with("/v1/admin/") => "organizer",
                ("/v1/hands", "post") => "team",
                ("/v1/sessions", _) => "required",
                ("/v1/hands", _) => "optional",
                _ => continue,
            };
            let concrete =
                path.replace("{verb}", "nothing").replace("{what}", "nothing").replace("{id}", "nothing");
            for (credential, headers) in &credentials {
                let Some(status) = expected(needs, credential) else { continue };
                let answer = send(&cup.server, &method.to_uppercase(), &concrete, headers, b"");
                let code = if status == 401 { "not_authorized" } else { "forbidden" };
                assert_eq!(answer.status, status, "{method} {path} with {credential}: {}", answer.body);
                answer.assert_problem(status, code);
                seen += 1;
            }
        }
    }
    assert!(seen > 100, "{seen} were tried");
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
