//! The leaderboard as JSON and as a page.

use crate::harness::{Client, Server, get, reset};
use serde_json::json;

async fn play(server: &Server, team: &str, runs: u64) {
    let (mut client, _) = Client::greet(server, team).await;
    for _ in 0..runs {
        assert_eq!(client.ask(reset()).await["op"], "obs");
        client.goes_on(0).await;
        assert_eq!(client.ask(json!({"op": "stop"})).await["status"], "practice");
    }
    client.send(r#"{"op":"bye","id":1}"#).await;
    assert_eq!(client.closed().await.0, 1000);
}

#[tokio::test]
async fn an_empty_leaderboard_says_how_to_start() {
    let server = Server::start();
    assert_eq!(get(&server, "/v1/leaderboard").json()["rows"], json!([]));
    let page = get(&server, "/");
    assert_eq!(page.status, 200);
    assert!(page.head.contains("content-type: text/html"), "{}", page.head);
    assert!(
        page.body.contains("No finished run yet") && page.body.contains(server.address()),
        "{}",
        page.body
    );
}

#[tokio::test]
async fn teams_are_ranked_by_total_then_by_time() {
    let server = Server::start();
    let hostile = "<b>\"R&D\"</b>";
    play(&server, "early", 1).await;
    play(&server, hostile, 2).await;
    let answer = get(&server, "/v1/leaderboard").json();
    let rows = answer["rows"].as_array().expect("rows");
    assert_eq!(rows.len(), 2, "{answer}");
    // One tick moves no ball: the totals are equal and the time decides.
    assert_eq!(
        (&rows[0]["team"], &rows[0]["rank"], &rows[0]["runs"]),
        (&json!("early"), &json!(1), &json!(1))
    );
    assert_eq!(
        (&rows[1]["team"], &rows[1]["rank"], &rows[1]["runs"]),
        (&json!(hostile), &json!(2), &json!(2))
    );
    assert_eq!(rows[0]["total"], rows[0]["tasks"]["balls"]["score"], "{answer}");
    let best = rows[1]["tasks"]["balls"]["run_id"].as_str().expect("an id");
    assert_eq!(get(&server, &format!("/v1/runs/{best}")).json()["team"], hostile);

    let page = get(&server, "/").body;
    assert!(page.contains("&lt;b&gt;&quot;R&amp;D&quot;&lt;/b&gt;") && !page.contains("<b>"), "{page}");
}

#[tokio::test]
async fn an_open_run_is_not_on_the_leaderboard() {
    let server = Server::start();
    let (mut client, _) = Client::playing(&server, "busy").await;
    client.goes_on(0).await;
    assert_eq!(get(&server, "/v1/leaderboard").json()["rows"], json!([]));
}
