//! Competitions whose rules draw the numbers of the hands.

use crate::harness::{Official, RULES, get, official_reset};
use serde_json::{Value, json};
use tempfile::TempDir;

/// The hand of run k is drawn, and it is the same for all teams.
#[tokio::test]
async fn the_seed_of_a_run_draws_its_hand_for_all_teams_alike() {
    let rules = format!("{RULES}hand_spread = true\n");
    let cup = Official::start_on(TempDir::new().expect("a folder"), &rules, None);
    let tokens = [cup.team("crabs"), cup.team("eels")];
    cup.open();
    let competition: Value = serde_json::from_str(&get(&cup.server, "/v1/competition").body).expect("JSON");
    assert_eq!(competition["hand_spread"], true, "{competition}");
    let mut hashes: Vec<Vec<Value>> = Vec::new();
    for token in &tokens {
        let (mut client, welcome) = cup.greet(token).await;
        assert_eq!(welcome["competition"]["hand_spread"], true, "{welcome}");
        let mut pinch = official_reset();
        pinch["hand"] = json!("pinch");
        let refused = client.ask(pinch).await;
        // Without `hands` in the file, a hand without ranges is left out.
        assert_eq!(refused["code"], "unknown_hand", "{refused}");
        let hands = welcome["hands"].as_array().expect("hands").iter().map(|hand| &hand["name"]);
        assert!(hands.clone().any(|name| name == "softhand") && !hands.clone().any(|name| name == "pinch"));
        let mut of_team = Vec::new();
        for _ in 0..2 {
            client.ask(official_reset()).await;
            let closing = json!({"hand": [1.0]});
            let obs = client.ask(json!({"op": "step", "tick": 0, "action": closing, "repeat": 30})).await;
            assert_eq!(obs["tick"], 30, "{obs}");
            let result = client.ask(json!({"op": "stop"})).await;
            cup.verified(&result["run_id"]).await;
            of_team.push(result["state_hash"].clone());
        }
        hashes.push(of_team);
    }
    assert_eq!(hashes[0], hashes[1]);
    assert_ne!(hashes[0][0], hashes[0][1]);
}
