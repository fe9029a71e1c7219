//! Teams' own hands: uploaded, checked, approved, played; and hidden from other teams.

use crate::harness::{Official, Server, bearer, get, send};
use serde_json::{Value, json};
use std::io::{Cursor, Write};
use std::path::Path;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// The pinch hand under another name, as an archive.
pub(crate) fn claw(name: &str) -> Vec<u8> {
    claw_with(name, &|urdf| urdf)
}

/// The same with another URDF.
pub(crate) fn claw_with(name: &str, edit_urdf: &dyn Fn(String) -> String) -> Vec<u8> {
    claw_from(name, edit_urdf, &|settings| settings)
}

/// The same with another URDF and other settings.
pub(crate) fn claw_from(
    name: &str,
    edit_urdf: &dyn Fn(String) -> String,
    edit_settings: &dyn Fn(String) -> String,
) -> Vec<u8> {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../models/hands/pinch"));
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let mut add = |path: &Path, name: String, edit: &dyn Fn(String) -> String| {
        zip.start_file(name, SimpleFileOptions::default()).expect("entry");
        match std::fs::read_to_string(path) {
            Ok(text) => zip.write_all(edit(text).as_bytes()).expect("text"),
            Err(_) => zip.write_all(&std::fs::read(path).expect("file")).expect("bytes"),
        }
    };
    for entry in std::fs::read_dir(folder).expect("folder") {
        let path = entry.expect("entry").path();
        let leaf = path.file_name().expect("name").to_string_lossy().into_owned();
        if leaf == "hand.toml" {
            add(&path, leaf, &|text| edit_settings(text.replacen("\"pinch\"", &format!("{name:?}"), 1)));
        } else if leaf == "hand.urdf" {
            add(&path, leaf, edit_urdf);
        } else if path.is_file() && !leaf.ends_with(".md") {
            add(&path, leaf, &|text| text);
        }
    }
    zip.finish().expect("archive").into_inner()
}

fn reset(hand: &str) -> Value {
    json!({"op": "reset", "task": "balls", "hand": hand})
}

#[tokio::test]
async fn an_own_hand_is_played_officially_after_approval_and_by_its_team_alone() {
    for cup in Official::each().await {
        let (crabs, eels) = (cup.team("crabs"), cup.team("eels"));
        cup.open();
        let sent = send(&cup.server, "POST", "/v1/hands", &bearer(&crabs), &claw("claw"));
        assert_eq!(sent.status, 201, "{}", sent.body);
        let hand = sent.json();
        assert_eq!((&hand["name"], &hand["status"]), (&json!("claw"), &json!("pending")), "{hand}");
        let again = send(&cup.server, "POST", "/v1/hands", &bearer(&crabs), &claw("claw")).json();
        assert_eq!(again["hand_id"], hand["hand_id"], "the same archive is the same hand");

        // The list and the welcome have the same playable hands: not yet, now, and never for another team.
        let playable = |cup: &Official, token: &str, welcome: &Value| {
            let listed = cup.get("/v1/hands", token).json()["hands"].clone();
            assert_eq!(listed, welcome["hands"]);
            listed.as_array().expect("hands").iter().any(|hand| hand["name"] == "claw")
        };
        let (mut client, welcome) = cup.greet(&crabs).await;
        assert!(!playable(&cup, &crabs, &welcome));
        client.refused(reset("claw"), "unknown_hand").await;
        cup.post("/v1/admin/hand/approve", &crabs, &json!({"hand_id": hand["hand_id"]}))
            .assert_problem(403, "forbidden");
        cup.order("hand/approve", json!({"hand_id": hand["hand_id"]}));
        let obs = client.ask(reset("claw")).await;
        assert_eq!(obs["run"]["hand"], "claw", "{obs}");
        client.goes_on(0).await;
        let result = client.ask(json!({"op": "stop"})).await;
        // Its replay contains the hand and needs nothing else.
        cup.verified(&result["run_id"]).await;
        client.send(r#"{"op":"bye","id":99}"#).await;
        client.closed().await;
        let (mut client, welcome) = cup.greet(&crabs).await;
        assert!(playable(&cup, &crabs, &welcome));

        let (mut other, welcome) = cup.greet(&eels).await;
        assert!(!playable(&cup, &eels, &welcome));
        other.refused(reset("claw"), "unknown_hand").await;
        assert_eq!(cup.get("/v1/hands", &crabs).json()["own"][0]["status"], "approved");
        for answer in [
            cup.get("/v1/hands", &eels),
            get(&cup.server, "/v1/hands"),
            get(&cup.server, "/v1/hands?team=crabs"),
        ] {
            assert!(!answer.body.contains("claw"), "{}", answer.body);
        }
        assert_eq!(cup.get("/v1/hands/claw", &crabs).status, 200);
        cup.get("/v1/hands/claw", &eels).assert_problem(404, "unknown_hand");

        cup.order("hand/reject", json!({"hand_id": hand["hand_id"], "reason": "too many fingers"}));
        client.refused(reset("claw"), "unknown_hand").await;
        assert_eq!(cup.get("/v1/hands", &crabs).json()["own"][0]["note"], "too many fingers");
    }
}

#[tokio::test]
async fn what_is_no_hand_is_refused_with_the_reason() {
    let cup = Official::start();
    let token = cup.team("crabs");
    let post = |headers: &str, body: &[u8]| send(&cup.server, "POST", "/v1/hands", headers, body);
    post("", &claw("claw")).assert_problem(401, "not_authorized");
    post(&bearer(&cup.organizer), &claw("claw")).assert_problem(403, "forbidden");
    for (what, body) in
        [("no archive", b"nonsense".to_vec()), ("a taken name", claw("softhand")), ("a path", claw("../x"))]
    {
        let answer = post(&bearer(&token), &body);
        answer.assert_problem(400, "bad_request");
        assert!(!answer.json()["detail"].as_str().expect("text").is_empty(), "{what}");
    }
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    zip.start_file("../../organizer.token", SimpleFileOptions::default()).expect("entry");
    zip.write_all(b"mine").expect("text");
    let answer = post(&bearer(&token), &zip.finish().expect("archive").into_inner());
    answer.assert_problem(400, "bad_request");
    assert!(answer.body.contains("leads out"), "{}", answer.body);
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for name in ["hand.urdf", "hanx.urdf"] {
        zip.start_file(name, SimpleFileOptions::default()).expect("entry");
        zip.write_all(b"<robot/>").expect("text");
    }
    // No writer makes such an archive: the second entry gets the name of the first.
    let mut doubled = zip.finish().expect("archive").into_inner();
    while let Some(at) = doubled.windows(9).position(|name| name == b"hanx.urdf") {
        doubled[at + 3] = b'd';
    }
    let answer = post(&bearer(&token), &doubled);
    answer.assert_problem(400, "bad_request");
    assert!(answer.body.contains("several entries of one name"), "{}", answer.body);
    let token_file = std::fs::read_to_string(cup.folder().join("organizer.token")).expect("token");
    assert_eq!(token_file.trim(), cup.organizer);
    assert!(cup.get("/v1/admin/hands", &cup.organizer).json()["hands"].as_array().is_some_and(Vec::is_empty));
    let huge = send(&cup.server, "POST", "/v1/hands", &bearer(&token), &vec![0; 80 << 20]);
    huge.assert_problem(413, "too_large");
}

#[tokio::test]
async fn in_practice_an_own_hand_plays_at_once() {
    let server = Server::start();
    let sent = send(&server, "POST", "/v1/hands?team=crabs", "", &claw("claw"));
    assert_eq!(sent.status, 201, "{}", sent.body);
    send(&server, "POST", "/v1/hands", "", &claw("claw")).assert_problem(400, "bad_request");
    let (mut client, welcome) = crate::harness::Client::greet(&server, "crabs").await;
    let last = welcome["hands"].as_array().and_then(|hands| hands.last()).expect("hands");
    assert_eq!((&last["name"], last["motors"].is_array()), (&json!("claw"), true), "{last}");
    assert_eq!(get(&server, "/v1/hands?team=crabs").json()["hands"], welcome["hands"]);
    assert_eq!(client.ask(reset("claw")).await["op"], "obs");
    let (mut other, _) = crate::harness::Client::greet(&server, "eels").await;
    other.refused(reset("claw"), "unknown_hand").await;
}
