//! Hundreds of viewers that are silent, ask for nothing that exists, or never read, beside a team that plays.

use crate::harness::{Client, Official, get};
use serde_json::json;
use std::time::{Duration, Instant};

/// Viewers of each kind.
const VIEWERS: usize = 80;
/// Ticks of the run.
const TICKS: u64 = 400;
/// More than the buffers of all viewers, far less than all that is sent to them, MiB.
const MEMORY_MIB: u64 = 200;

#[tokio::test]
async fn a_flood_of_viewers_disturbs_no_run_and_leaves_nothing() {
    let cup = Official::start();
    let team = cup.team("crabs");
    let screen = cup.order("token/add", json!({"role": "viewer", "label": "hall"}))["token"].clone();
    let screen = screen.as_str().expect("a token");
    cup.open();
    let (mut client, welcome, obs) = cup.playing(&team).await;
    let before = cup.server.most_memory_mib();
    let mut crowd: Vec<Client> = Vec::new();
    for k in 0..VIEWERS {
        crowd.push(cup.watch(None).await);
        let mut asking = cup.watch(None).await;
        for request in 0..20 {
            let unknown = format!("ses_{k}_{request}");
            asking
                .try_send(&json!({"op": "subscribe", "id": request, "session_id": unknown}).to_string())
                .await;
        }
        crowd.push(asking);
        // It gets every tick and takes none.
        let mut following = cup.watch(Some(screen)).await;
        let subscribe = json!({"op": "subscribe", "session_id": welcome["session_id"]});
        assert_eq!(following.ask(subscribe).await["op"], "subscribed");
        crowd.push(following);
    }
    assert!(get(&cup.server, "/metrics").body.contains(&format!("palmares_viewers {}\n", crowd.len())));
    for tick in 0..TICKS {
        client.goes_on(tick).await;
    }
    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!((&result["op"], &result["ticks"]), (&json!("result"), &json!(TICKS)), "{result}");
    cup.verified(&obs["run_id"]).await;
    if let Some((before, after)) = before.zip(cup.server.most_memory_mib()) {
        assert!(after - before < MEMORY_MIB, "from {before} to {after} MiB");
    }
    drop(crowd);
    let began = Instant::now();
    while !get(&cup.server, "/metrics").body.contains("palmares_viewers 0\n") {
        assert!(began.elapsed() < Duration::from_secs(20), "{}", get(&cup.server, "/metrics").body);
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}
