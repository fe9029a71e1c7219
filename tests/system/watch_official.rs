//! Spectators of a competition: who may watch which run, and what stays hidden from whom.

use crate::hands_upload::claw;
use crate::harness::{Client, Official, assert_error, bearer, get, get_bytes, send};
use serde_json::{Value, json};
use std::time::Duration;

fn text(value: &Value) -> String {
    value.as_str().unwrap_or_else(|| panic!("a text, not {value}")).to_owned()
}

fn reset(sensing: &str) -> Value {
    json!({"op": "reset", "task": "balls", "hand": "softhand", "sensing": sensing})
}

fn viewer_token(cup: &Official) -> String {
    text(&cup.order("token/add", json!({"role": "viewer", "label": "screen"}))["token"])
}

/// The next message of a kind; what comes before it is added to `heard`.
async fn until(viewer: &mut Client, op: &str, heard: &mut String) -> Value {
    loop {
        let message = viewer.next().await;
        heard.push_str(&message.to_string());
        if message["op"] == op {
            return message;
        }
    }
}

/// Ids of the runs in a viewer's list.
async fn listed(viewer: &mut Client) -> Vec<String> {
    let runs = viewer.ask(json!({"op": "list"})).await;
    let mut ids: Vec<String> =
        runs["runs"].as_array().expect("runs").iter().map(|run| text(&run["run_id"])).collect();
    ids.sort();
    ids
}

#[tokio::test]
async fn a_run_is_watched_by_those_who_may_and_by_nobody_else() {
    let cup = Official::start();
    let (crabs, eels) = (cup.team("crabs"), cup.team("eels"));
    let viewer = viewer_token(&cup);
    cup.open();
    let sent = send(&cup.server, "POST", "/v1/hands", &bearer(&crabs), &claw("claw")).json();
    cup.order("hand/approve", json!({"hand_id": sent["hand_id"]}));
    // The crabs see the truth and play a hand of their own, the eels play on sensors.
    let (mut crab, crab_welcome) = cup.greet(&crabs).await;
    let seeing = crab.ask(json!({"op": "reset", "task": "balls", "hand": "claw"})).await;
    let (mut eel, eel_welcome) = cup.greet(&eels).await;
    let feeling = eel.ask(reset("sensors")).await;
    assert!(feeling.get("truth").is_none(), "{feeling}");
    let (seeing_run, feeling_run) = (text(&seeing["run_id"]), text(&feeling["run_id"]));
    let mut both = vec![seeing_run.clone(), feeling_run.clone()];
    both.sort();

    let watchers: [(Option<&str>, Vec<String>); 5] = [
        (None, vec![]),
        (Some(&crabs), vec![seeing_run.clone()]),
        (Some(&eels), vec![]),
        (Some(&viewer), both.clone()),
        (Some(&cup.organizer), both),
    ];
    for (token, may) in watchers {
        let mut watcher = cup.watch(token).await;
        assert_eq!(listed(&mut watcher).await, may);
        for (run, session) in
            [(&seeing_run, &crab_welcome["session_id"]), (&feeling_run, &eel_welcome["session_id"])]
        {
            for target in
                [json!({"op": "subscribe", "run_id": run}), json!({"op": "subscribe", "session_id": session})]
            {
                // A new connection, so that nothing of another target is on its way.
                let mut watcher = cup.watch(token).await;
                let reply = watcher.ask(target).await;
                if may.contains(run) {
                    assert_eq!(
                        (&reply["op"], &reply["run_id"]),
                        (&json!("subscribed"), &json!(run)),
                        "{reply}"
                    );
                    let scene = until(&mut watcher, "scene", &mut String::new()).await;
                    assert_eq!(scene["run"]["run_id"], json!(run));
                } else {
                    assert_error(&reply, if token.is_some() { "forbidden" } else { "not_authorized" }, false);
                    assert!(!reply.to_string().contains("claw"), "{reply}");
                }
            }
        }
        let reply = watcher.ask(json!({"op": "subscribe", "featured": true})).await;
        match may.is_empty() {
            true => assert_eq!(reply["run_id"], Value::Null, "{reply}"),
            false => assert!(may.contains(&text(&reply["run_id"])), "{reply}"),
        }
    }
}

#[tokio::test]
async fn watching_shows_no_seed_no_token_and_nothing_to_those_who_may_not() {
    let cup = Official::start();
    let (crabs, eels) = (cup.team("crabs"), cup.team("eels"));
    let viewer = viewer_token(&cup);
    cup.open();
    let (mut crab, welcome, obs) = cup.playing(&crabs).await;
    let run_id = text(&obs["run_id"]);
    let mut heard = [String::new(), String::new()];
    let mut screen = cup.watch(Some(&viewer)).await;
    let mut office = cup.watch(Some(&cup.organizer)).await;
    let mut rival = cup.watch(Some(&eels)).await;
    let mut stranger = cup.watch(None).await;
    for watcher in [&mut screen, &mut office, &mut rival, &mut stranger] {
        watcher.ask(json!({"op": "subscribe", "featured": true})).await;
    }
    for tick in 0..20 {
        crab.goes_on(tick).await;
    }
    let result = crab.ask(json!({"op": "stop"})).await;
    for (watcher, heard) in [&mut screen, &mut office].into_iter().zip(&mut heard) {
        let ended = until(watcher, "ended", heard).await;
        assert_eq!(ended["outcome"]["score"], result["score"], "{ended}");
    }
    // Spectators without the right get the public ranking, and nothing else.
    for watcher in [&mut rival, &mut stranger] {
        let mut heard = String::new();
        while until(watcher, "leaderboard", &mut heard).await["rows"][0]["team"] != "crabs" {}
        for hidden in ["scene", "poses", "events", "ended"] {
            assert!(!heard.contains(&format!("\"op\":\"{hidden}\"")), "{heard}");
        }
    }
    let run = cup.get(&format!("/v1/runs/{run_id}"), &cup.organizer).json();
    let secrets = [&run["seed_hex"], &welcome["resume_token"]].map(text);
    for secret in secrets.iter().chain([&crabs, &eels, &viewer, &cup.organizer]) {
        for heard in &heard {
            assert!(heard.contains(&run_id) && !heard.contains(secret.as_str()), "a viewer gets {secret}");
        }
    }
    for heard in &heard {
        for field in ["seed", "token", "truth", "joints", "applied_action"] {
            assert!(!heard.contains(&format!("\"{field}")), "a viewer gets {field}");
        }
    }
    // A viewer's token opens nothing else.
    let shown = cup.get(&format!("/v1/runs/{run_id}"), &viewer).json();
    assert_eq!((&shown["seed_hex"], shown.get("session_id")), (&Value::Null, None), "{shown}");
    assert!(shown["events"].is_array(), "it was watched: {shown}");
    cup.get(&format!("/v1/runs/{run_id}/replay"), &viewer).assert_problem(403, "forbidden");
}

#[tokio::test]
async fn a_team_that_watches_its_session_is_not_shown_its_runs_on_sensors() {
    let cup = Official::start();
    let token = cup.team("crabs");
    cup.open();
    let (mut player, welcome) = cup.greet(&token).await;
    let mut watcher = cup.watch(Some(&token)).await;
    let mut heard = String::new();
    let mut runs = Vec::new();
    for (i, sensing) in ["truth", "sensors", "truth"].into_iter().enumerate() {
        let obs = player.ask(reset(sensing)).await;
        runs.push(text(&obs["run_id"]));
        if i == 0 {
            watcher.ask(json!({"op": "subscribe", "session_id": welcome["session_id"]})).await;
        }
        player.goes_on(0).await;
        player.ask(json!({"op": "stop"})).await;
        if sensing == "truth" {
            assert_eq!(until(&mut watcher, "ended", &mut heard).await["run_id"], json!(runs[i]));
        }
    }
    assert!(heard.contains(&runs[2]) && !heard.contains(&runs[1]), "{heard}");
}

#[tokio::test]
async fn a_revoked_viewer_gets_an_error_and_is_closed() {
    let cup = Official::start();
    let token = cup.team("crabs");
    cup.open();
    let (mut player, _, _) = cup.playing(&token).await;
    let viewer = cup.order("token/add", json!({"role": "viewer"}));
    let mut revoked = cup.watch(Some(&text(&viewer["token"]))).await;
    let mut own = cup.watch(Some(&token)).await;
    for watcher in [&mut revoked, &mut own] {
        let reply = watcher.ask(json!({"op": "subscribe", "featured": true})).await;
        assert!(reply["run_id"].is_string(), "{reply}");
    }
    cup.order("token/revoke", json!({"token_id": viewer["token_id"], "reason": "lost"}));
    let error = until(&mut revoked, "error", &mut String::new()).await;
    assert_error(&error, "not_authorized", true);
    assert_eq!(revoked.closed().await, (4401, "not_authorized".into()));
    assert_eq!(cup.refused(cup.handshake("/v1/watch", &text(&viewer["token"]))).await, 401);
    // Other connections continue; a team's new token ends what its old one watched.
    player.goes_on(0).await;
    assert_eq!(until(&mut own, "poses", &mut String::new()).await["op"], "poses");
    cup.order("team/rotate", json!({"team": "crabs"}));
    assert_error(&until(&mut own, "error", &mut String::new()).await, "not_authorized", true);
    assert_eq!(own.closed().await.0, 4401);
}

#[tokio::test]
async fn what_goes_on_when_the_competition_closes_is_shown_and_in_the_end_only_the_ranking() {
    let cup = Official::start();
    let token = cup.team("crabs");
    let viewer = viewer_token(&cup);
    cup.open();
    let (mut player, welcome, obs) = cup.playing(&token).await;
    let mut screen = cup.watch(Some(&viewer)).await;
    cup.order("competition/close", json!({}));
    let reply = screen.ask(json!({"op": "subscribe", "featured": true})).await;
    assert_eq!(reply["run_id"], obs["run_id"], "an open run goes on: {reply}");
    player.goes_on(0).await;
    let mut heard = String::new();
    while until(&mut screen, "poses", &mut heard).await["tick"] != 1 {}
    cup.order("session/end", json!({"session_id": welcome["session_id"]}));
    assert_eq!(until(&mut screen, "ended", &mut heard).await["run_id"], obs["run_id"]);
    let run_id = text(&obs["run_id"]);
    get(&cup.server, &format!("/v1/runs/{run_id}/replay")).assert_problem(403, "forbidden");
    cup.order("competition/reveal", json!({}));

    for token in [None, Some(viewer.as_str()), Some(token.as_str())] {
        let mut late = cup.watch(token).await;
        assert!(listed(&mut late).await.is_empty());
        let reply = late.ask(json!({"op": "subscribe", "run_id": run_id})).await;
        assert_error(&reply, "not_found", false);
        let reply = late.ask(json!({"op": "subscribe", "featured": true})).await;
        assert_eq!(reply["run_id"], Value::Null, "{reply}");
        let ranking = until(&mut late, "leaderboard", &mut String::new()).await;
        assert_eq!(ranking["rows"][0]["team"], "crabs", "{ranking}");
    }
    // From now on the run itself is public.
    assert_eq!(get_bytes(&cup.server, &format!("/v1/runs/{run_id}/replay")).0, 200);
    assert!(get(&cup.server, &format!("/v1/runs/{run_id}")).json()["seed_hex"].is_string());
}

#[tokio::test]
async fn the_ranking_is_shown_anew_when_a_run_is_void_or_rejected() {
    let cup = Official::start();
    let token = cup.team("crabs");
    cup.open();
    let mut screen = cup.watch(None).await;
    screen.ask(json!({"op": "subscribe", "featured": true})).await;
    for verb in ["void", "reverify"] {
        let (mut player, _, obs) = cup.playing(&token).await;
        for tick in 0..20 {
            player.goes_on(tick).await;
        }
        player.ask(json!({"op": "stop"})).await;
        cup.verified(&obs["run_id"]).await;
        // All messages of the run have been sent: later ones follow from the organizer's order.
        screen.listen_for(Duration::from_secs(3)).await;
        let run_id = text(&obs["run_id"]);
        if verb == "reverify" {
            let replay = cup.folder().join("replays").join(format!("{run_id}.mcap"));
            let mut bytes = std::fs::read(&replay).expect("it is there");
            let middle = bytes.len() / 2;
            bytes[middle] ^= 1;
            std::fs::write(replay, bytes).expect("written");
        }
        cup.order(&format!("run/{verb}"), json!({"run_id": run_id, "reason": "a mistake"}));
        let mut heard = String::new();
        while until(&mut screen, "leaderboard", &mut heard).await["rows"] != json!([]) {}
    }
}
