//! Names of teams, labels and hands: which are refused, which cause a message, and which stay valid.

use crate::harness::{Client, Official, Server, get, reset};
use serde_json::json;
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{ConnectOptions, Connection};

/// Latin `crabs` with a Cyrillic а.
const LOOKALIKE: &str = "crаbs";

#[tokio::test]
async fn organizers_add_no_team_with_an_invisible_name_or_one_that_looks_like_another() {
    for cup in Official::each().await {
        cup.team("crabs");
        let add = |name: &str| cup.post("/v1/admin/team/add", &cup.organizer, &json!({"team": name}));
        for (name, said) in [
            ("\u{200b}\u{2060}", "U+200B"),
            ("\u{3164}", "U+3164"),
            ("cr\u{202e}sba", "character 3 is U+202E"),
            ("...", "no letter or number"),
        ] {
            let answer = add(name);
            answer.assert_problem(400, "bad_request");
            assert!(answer.body.contains("team: ") && answer.body.contains(said), "{}", answer.body);
        }
        for name in [LOOKALIKE, "CRABS", "ｃｒａｂｓ"] {
            let answer = add(name);
            answer.assert_problem(409, "wrong_state");
            assert!(answer.body.contains("looks like the team `crabs`"), "{}", answer.body);
        }
        assert_eq!(cup.order("team/add", json!({"team": "  R&D \u{a0} 蟹 "}))["team"], "R&D 蟹");
        let label = json!({"role": "viewer", "label": "screen\u{202e}"});
        cup.post("/v1/admin/token/add", &cup.organizer, &label).assert_problem(400, "bad_request");
    }
}

#[tokio::test]
async fn in_practice_a_look_alike_is_reported_and_an_invisible_name_is_refused() {
    let server = Server::start();
    let (_, welcome) = Client::greet(&server, "crabs").await;
    assert!(welcome["note"].is_null(), "{welcome}");
    let (_, welcome) = Client::greet(&server, "crabs").await;
    assert!(welcome["note"].is_null(), "a team is not its own double: {welcome}");
    let (_, welcome) = Client::greet(&server, LOOKALIKE).await;
    assert!(welcome["note"].as_str().is_some_and(|note| note.contains("the team `crabs`")), "{welcome}");
    let mut client = Client::connect(&server).await;
    for name in ["\u{200b}", "cr\u{202e}sba", "a\u{1b}[2J"] {
        let refused = client.ask(json!({"op": "hello", "client": {"name": name}})).await;
        assert_eq!((&refused["op"], &refused["code"]), (&json!("error"), &json!("bad_request")), "{refused}");
        let said = refused["message"].as_str().expect("text");
        assert!(said.starts_with("the team's name: character ") && said.contains(" is U+"), "{said}");
    }
    get(&server, "/v1/hands?team=%E2%80%8B").assert_problem(400, "bad_request");
}

#[tokio::test]
async fn a_name_that_the_database_has_goes_on_as_it_is() {
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "crabs").await;
    client.goes_on(0).await;
    client.ask(json!({"op": "stop"})).await;
    let options = SqliteConnectOptions::new().filename(server.database());
    let old = "\u{202e}sbarc\u{200b}";
    let folder = server.kill();
    let mut database = options.connect().await.expect("opens");
    for table in ["sessions", "runs", "best"] {
        let sql = sqlx::AssertSqlSafe(format!("UPDATE {table} SET team = $1"));
        sqlx::query(sql).bind(old).execute(&mut database).await.expect("renamed");
    }
    database.close().await.expect("closes");
    let server = Server::start_in(folder, &[]);
    let (mut client, welcome) = Client::greet(&server, old).await;
    assert_eq!(welcome["team"], old, "{welcome}");
    assert_eq!(client.ask(reset()).await["op"], "obs");
    client.ask(json!({"op": "stop"})).await;
    let rows = get(&server, "/v1/leaderboard").json()["rows"].clone();
    assert_eq!((&rows[0]["team"], &rows[0]["runs"]), (&json!(old), &json!(2)), "{rows}");
    let page = get(&server, "/").body;
    assert!(page.contains("<bdi>\\u{202E}sbarc\\u{200B}</bdi>"), "{page}");
}
