//! Official competitions: admission, what a team may see, and protection of other teams' sessions.

use crate::harness::{Official, bearer, get, handshake, official_reset, send, step};
use serde_json::{Value, json};

fn text(value: &Value) -> String {
    value.as_str().unwrap_or_else(|| panic!("a text, not {value}")).to_owned()
}

#[tokio::test]
async fn without_a_valid_teams_token_there_is_no_socket() {
    for cup in Official::each().await {
        let token = cup.team("crabs");
        let viewer = text(&cup.order("token/add", json!({"role": "viewer"}))["token"]);
        let bare = handshake(&cup.server, Some("palmares.v1.json"));
        assert_eq!(cup.refused(bare).await, 401);
        let query = cup.handshake("/v1/control", "x").uri().to_string() + "?token=" + &token;
        let mut in_url = handshake(&cup.server, Some("palmares.v1.json"));
        *in_url.uri_mut() = query.parse().expect("an address");
        assert_eq!(cup.refused(in_url).await, 401, "a token in an address is none");
        let mut other = token.clone();
        other.replace_range(token.len() - 1.., if token.ends_with('0') { "1" } else { "0" });
        for wrong in ["", "x", &token[..40], &other, &token.replace("plm", "PLM")] {
            assert_eq!(cup.refused(cup.handshake("/v1/control", wrong)).await, 401, "{wrong:?}");
        }
        for known in [&cup.organizer, &viewer] {
            assert_eq!(cup.refused(cup.handshake("/v1/control", known)).await, 403);
        }
        cup.open();
        let (_, welcome) = cup.greet(&token).await;
        assert_eq!(
            (&welcome["team"], &welcome["session_left_s"]),
            (&json!("crabs"), &json!(600.0)),
            "{welcome}"
        );
        assert_eq!(welcome["competition"]["mode"], "official");
    }
}

#[tokio::test]
async fn a_revoked_token_closes_its_socket_and_the_new_one_takes_the_session_up() {
    for cup in Official::each().await {
        let old = cup.team("crabs");
        cup.open();
        let (mut client, welcome, _) = cup.playing(&old).await;
        client.goes_on(0).await;
        let new = text(&cup.order("team/rotate", json!({"team": "crabs", "reason": "leaked"}))["token"]);
        let refusal = client.next().await;
        assert_eq!(
            (&refusal["code"], &refusal["fatal"]),
            (&json!("not_authorized"), &json!(true)),
            "{refusal}"
        );
        assert_eq!(client.closed().await, (4401, "not_authorized".into()));
        assert_eq!(cup.refused(cup.handshake("/v1/control", &old)).await, 401);
        let (mut client, back) = cup.greet(&new).await;
        assert_eq!(back["session_id"], welcome["session_id"]);
        assert_eq!((&back["run"]["tick"], &back["run"]["open"]), (&json!(1), &json!(true)), "{back}");
        assert_ne!(back["resume_token"], welcome["resume_token"]);
        client.goes_on(1).await;
        cup.order("team/revoke", json!({"team": "crabs"}));
        assert_eq!(client.next().await["code"], "not_authorized");
        assert_eq!(client.closed().await.0, 4401);
    }
}

#[tokio::test]
async fn seeds_are_hidden_the_same_for_all_and_new_in_every_run() {
    for cup in Official::each().await {
        let (crabs, eels) = (cup.team("crabs"), cup.team("eels"));
        cup.open();
        let mut scenes = Vec::new();
        let mut runs = Vec::new();
        for token in [&crabs, &eels] {
            let (mut client, _) = cup.greet(token).await;
            client
                .refused(
                    json!({"op": "reset", "task": "balls", "hand": "softhand", "seed": 1}),
                    "bad_request",
                )
                .await;
            for _ in 0..2 {
                let obs = client.ask(official_reset()).await;
                assert_eq!(obs["run"]["seed"], Value::Null, "{obs}");
                scenes.push(obs["truth"]["objects"].clone());
                client.goes_on(0).await;
                let result = client.ask(json!({"op": "stop"})).await;
                assert_eq!(result["status"], "provisional", "{result}");
                runs.push(text(&result["run_id"]));
            }
        }
        assert_eq!((&scenes[0], &scenes[1]), (&scenes[2], &scenes[3]), "run k is the same for every team");
        assert_ne!(scenes[0], scenes[1], "and another one each time");

        let path = format!("/v1/runs/{}", runs[0]);
        let seed = text(&cup.get(&path, &cup.organizer).json()["seed_hex"]);
        let own = cup.get(&path, &crabs);
        assert!(!own.body.contains(&seed));
        let run = own.json();
        assert_eq!((&run["seed"], &run["seed_hex"]), (&Value::Null, &Value::Null), "{run}");
        assert_eq!(run["k"], 1, "{run}");
        assert!(run["events"].is_array() && run["session_id"].is_string(), "one may know one's own: {run}");
        // A team sees only the leaderboard of other teams.
        for answer in [get(&cup.server, &path), cup.get(&path, &eels)] {
            assert!(answer.body.contains("a token of the run's team"), "{}", answer.body);
            answer.assert_problem(403, "forbidden");
        }
        assert!(get(&cup.server, "/v1/leaderboard").body.contains(&runs[0]));
        for token in [&crabs, &eels] {
            cup.get(&format!("{path}/replay"), token).assert_problem(403, "forbidden");
        }
        get(&cup.server, &format!("{path}/replay")).assert_problem(403, "forbidden");
        assert!(!get(&cup.server, "/v1/leaderboard").body.contains(&seed));
    }
}

#[tokio::test]
async fn the_secret_behind_the_seeds_is_shown_last() {
    let cup = Official::start();
    let token = cup.team("crabs");
    let competition = get(&cup.server, "/v1/competition").json();
    assert_eq!(
        (&competition["phase"], competition.get("seed_secret")),
        (&json!("closed"), None),
        "{competition}"
    );
    let mut early = cup.connect(&token).await;
    early.refused(json!({"op": "hello", "client": "early"}), "wrong_state").await;
    cup.open();
    let (mut client, welcome, obs) = cup.playing(&token).await;
    client.ask(json!({"op": "stop"})).await;
    let reveal = |cup: &Official| cup.post("/v1/admin/competition/reveal", &cup.organizer, &json!({}));
    reveal(&cup).assert_problem(409, "wrong_state");
    cup.order("competition/close", json!({}));
    assert!(reveal(&cup).body.contains("1 session is open"));
    // An open session continues when the competition closes.
    assert_eq!(client.ask(official_reset()).await["op"], "obs");
    cup.order("session/end", json!({"session_id": welcome["session_id"]}));
    assert_eq!(client.next().await["op"], "result");
    assert_eq!(client.closed().await.0, 1000);
    assert_eq!(reveal(&cup).status, 200);

    let competition = get(&cup.server, "/v1/competition").json();
    let secret = text(&competition["seed_secret"]);
    let file = std::fs::read_to_string(cup.folder().join("seed.secret")).expect("secret");
    assert_eq!(secret, file.trim());
    let run = get(&cup.server, &format!("/v1/runs/{}", text(&obs["run_id"]))).json();
    assert!(run["seed_hex"].is_string(), "{run}");
    cup.post("/v1/admin/competition/open", &cup.organizer, &json!({})).assert_problem(409, "wrong_state");
}

#[tokio::test]
async fn a_team_has_one_session_and_bye_does_not_end_it() {
    for cup in Official::each().await {
        let token = cup.team("crabs");
        cup.open();
        let (mut client, welcome, obs) = cup.playing(&token).await;
        let mut second = cup.connect(&token).await;
        second.refused(json!({"op": "hello", "client": "second"}), "session_taken").await;
        client.goes_on(0).await;
        client.send(r#"{"op":"bye","id":99}"#).await;
        assert_eq!(client.closed().await.0, 1000);
        let (mut client, back) = cup.greet(&token).await;
        assert_eq!(back["session_id"], welcome["session_id"], "{back}");
        // The result of the run that bye closed waits.
        let result = client.ask(json!({"op": "stop"})).await;
        assert_eq!((&result["run_id"], &result["ticks"]), (&obs["run_id"], &json!(1)), "{result}");
        cup.order("session/end", json!({"session_id": welcome["session_id"]}));
        assert_eq!(client.closed().await.0, 1000);
        let mut late = cup.connect(&token).await;
        late.refused(json!({"op": "hello", "client": "late"}), "session_over").await;
    }
}

#[tokio::test]
async fn nobody_acts_for_another_team() {
    for cup in Official::each().await {
        let (crabs, eels) = (cup.team("crabs"), cup.team("eels"));
        cup.open();
        let (mut client, welcome, obs) = cup.playing(&crabs).await;
        // With the other's resume token, while it is connected and while it is away.
        let theft = json!({"op": "hello", "client": "eel", "resume_token": welcome["resume_token"]});
        let mut thief = cup.connect(&eels).await;
        thief.refused(theft.clone(), "session_over").await;
        thief.refused(step(0), "wrong_state").await;
        client.goes_on(0).await;
        drop(client);
        let mut thief = cup.connect(&eels).await;
        thief.refused(theft, "session_over").await;
        // Its own hello opens its own session, under any name.
        let own = thief.ask(json!({"op": "hello", "client": {"name": "crabs"}})).await;
        assert_eq!(own["team"], "eels", "{own}");
        thief.refused(step(1), "wrong_state").await;
        let (mut client, back) = cup.greet(&crabs).await;
        assert_eq!(back["run"]["tick"], 1, "{back}");
        client.goes_on(1).await;

        // Lists show one's own; the other's ids lead nowhere.
        let sessions = cup.get("/v1/sessions", &eels).json()["sessions"].clone();
        let rows = sessions.as_array().expect("rows");
        assert!(rows.iter().all(|row| row["team"] == "eels") && rows.len() == 1, "{sessions}");
        let session = text(&welcome["session_id"]);
        for (path, body) in [
            ("session/pause", json!({"session_id": session})),
            ("session/void", json!({"session_id": session, "reason": "spite"})),
            ("run/void", json!({"run_id": obs["run_id"], "reason": "spite"})),
            ("team/rotate", json!({"team": "crabs"})),
            ("competition/close", json!({})),
            ("hand/approve", json!({"hand_id": "hand_0"})),
        ] {
            let path = format!("/v1/admin/{path}");
            cup.post(&path, &eels, &body).assert_problem(403, "forbidden");
            send(&cup.server, "POST", &path, "", b"{}").assert_problem(401, "not_authorized");
        }
        client.goes_on(2).await;
    }
}

#[tokio::test]
async fn viewers_and_strangers_administer_nothing() {
    let cup = Official::start();
    let viewer = text(&cup.order("token/add", json!({"role": "viewer", "label": "screen"}))["token"]);
    let paths = ["teams", "tokens", "hands", "audit", "backup", "export/runs", "export/sessions?format=csv"];
    for path in paths {
        let path = format!("/v1/admin/{path}");
        cup.get(&path, &viewer).assert_problem(403, "forbidden");
        get(&cup.server, &path).assert_problem(401, "not_authorized");
        let in_url = format!("{path}{}token={}", if path.contains('?') { '&' } else { '?' }, cup.organizer);
        get(&cup.server, &in_url).assert_problem(401, "not_authorized");
        let twice = bearer(&viewer) + &bearer(&cup.organizer);
        send(&cup.server, "GET", &path, &twice, b"").assert_problem(401, "not_authorized");
    }
    // The hall's screen shows their clocks.
    assert_eq!(cup.get("/v1/sessions", &viewer).json()["sessions"], json!([]));
    get(&cup.server, "/v1/sessions").assert_problem(401, "not_authorized");
    for path in
        ["/v1/runs/..%2f..%2fseed.secret/replay", "/v1/runs/%2e%2e/replay", "/v1/hands/..%2fseed.secret"]
    {
        let answer = cup.get(path, &cup.organizer);
        assert_eq!(answer.status, 404, "{path}: {}", answer.body);
    }
    for path in ["/seed.secret", "/../seed.secret", "/v1/../organizer.token", "/.palmares/organizer.token"] {
        assert_eq!(get(&cup.server, path).status, 404, "{path}");
    }
}

#[tokio::test]
async fn no_secret_stands_in_the_log_or_in_an_answer() {
    let cup = Official::start();
    let token = cup.team("crabs");
    cup.open();
    let (mut client, welcome, _) = cup.playing(&token).await;
    client.ask(json!({"op": "stop"})).await;
    get(&cup.server, &format!("/v1/competition?token={token}"));
    get(&cup.server, &format!("/nothing?token={token}"));
    let secret = std::fs::read_to_string(cup.folder().join("seed.secret")).expect("secret");
    let runs = cup.get("/v1/admin/export/runs", &cup.organizer).json();
    let seed = text(&runs[0]["seed_hex"]);
    let tokens = cup.get("/v1/admin/tokens", &cup.organizer).body;
    assert!(tokens.contains("\"role\":\"team\"") && !tokens.contains("secret_hash"), "{tokens}");
    let organizer = cup.organizer.clone();
    let half = |token: &str| token.rsplit('_').next().map(str::to_owned).expect("a secret half");
    cup.server.signal("TERM");
    let (status, log, _folder) = cup.server.wait();
    assert!(status.success());
    for hidden in
        [half(&token), half(&organizer), secret.trim().to_owned(), seed, text(&welcome["resume_token"])]
    {
        assert!(!log.contains(&hidden), "the log has {hidden}");
        assert!(!tokens.contains(&hidden));
    }
}

#[tokio::test]
async fn a_session_and_its_clock_outlive_a_crash() {
    for cup in Official::each().await {
        let token = cup.team("crabs");
        cup.open();
        let (mut client, welcome, obs) = cup.playing(&token).await;
        for tick in 0..3 {
            client.ask(json!({"op": "step", "tick": tick * 100, "action": {}, "repeat": 100})).await;
        }
        client.ask(json!({"op": "stop"})).await;
        let left = client.ask(json!({"op": "time"})).await["session_left_s"].as_f64().expect("a number");
        assert!(left <= 597.0, "{left}");
        client.ask(official_reset()).await;
        let cup = cup.crashed();
        let (mut client, back) = cup.greet(&token).await;
        assert_eq!(back["session_id"], welcome["session_id"], "{back}");
        let now = back["session_left_s"].as_f64().expect("a number");
        assert!(now <= left && now > left - 60.0, "{now} after {left}");
        let again = client.ask(official_reset()).await;
        let run = cup.get(&format!("/v1/runs/{}", text(&again["run_id"])), &token).json();
        assert_eq!(run["k"], 3, "the number of the run that was lost is not given again: {run}");
        assert_ne!(again["run_id"], obs["run_id"]);
    }
}

#[tokio::test]
async fn a_practice_server_does_not_open_the_database_of_a_competition() {
    let cup = Official::start();
    cup.server.signal("TERM");
    let (_, _, folder) = cup.server.wait();
    let output = std::process::Command::new(crate::harness::program())
        .args(["serve", "--listen", "127.0.0.1:0", "--data-dir"])
        .arg(folder.path())
        .env_remove("DATABASE_URL")
        .output()
        .expect("runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success() && said.contains("official competition"), "{said}");
    // Another secret is also detected.
    std::fs::write(folder.path().join("seed.secret"), "0".repeat(64)).expect("writes");
    let config = folder.path().join("competition.toml");
    let output = std::process::Command::new(crate::harness::program())
        .args(["serve", "--listen", "127.0.0.1:0", "--config"])
        .arg(&config)
        .arg("--data-dir")
        .arg(folder.path())
        .env_remove("DATABASE_URL")
        .output()
        .expect("runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success() && said.contains("seed secret"), "{said}");
}
