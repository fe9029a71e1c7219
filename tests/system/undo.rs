//! Commands of organizers that are taken back: a grant of time, and the void of a run.

use crate::harness::{Client, Official, RULES, official_reset};
use serde_json::{Value, json};
use tempfile::TempDir;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("a number, not {value}"))
}

/// Plays `seconds` and stops. Returns the result.
async fn played(client: &mut Client, seconds: u64) -> Value {
    assert_eq!(client.settled(official_reset()).await["op"], "obs");
    for tick in 0..seconds {
        client.ask(json!({"op": "step", "tick": tick * 100, "action": {}, "repeat": 100})).await;
    }
    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!(result["status"], "provisional", "{result}");
    result
}

async fn time(client: &mut Client) -> Value {
    client.ask(json!({"op": "time"})).await
}

fn act(cup: &Official, verb: &str, run_id: &Value) -> Value {
    cup.order(&format!("run/{verb}"), json!({"run_id": run_id, "reason": "the referee"}))
}

/// Teams and totals.
fn ranking(cup: &Official) -> Vec<(String, f64)> {
    let rows = cup.get("/v1/leaderboard", &cup.organizer).json()["rows"].clone();
    let rows = rows.as_array().expect("rows").iter();
    rows.map(|row| (row["team"].as_str().expect("a team").to_owned(), number(&row["total"]))).collect()
}

#[tokio::test]
async fn a_run_counts_again_and_its_time_is_taken_again() {
    for cup in Official::each().await {
        let token = cup.team("crabs");
        cup.open();
        let (mut client, welcome) = cup.greet(&token).await;
        let first = played(&mut client, 3).await;
        let second = played(&mut client, 2).await;
        let (run_id, before) = (&first["run_id"], ranking(&cup));
        cup.verified(run_id).await;
        cup.verified(&second["run_id"]).await;
        let counted = time(&mut client).await;

        act(&cup, "void", run_id);
        let void = time(&mut client).await;
        assert_eq!(number(&void["simulated_s"]), 2.0, "{void}");
        // While another run is open.
        assert_eq!(client.settled(official_reset()).await["op"], "obs");
        client.ask(json!({"op": "step", "tick": 0, "action": {}, "repeat": 100})).await;
        let restored = act(&cup, "unvoid", run_id);
        let status = &restored["run"]["status"];
        assert!(status == "provisional" || status == "verified", "{restored}");
        let back = time(&mut client).await;
        assert_eq!(number(&back["simulated_s"]), 6.0, "{back}");
        assert!(number(&back["refunded_s"]) < number(&void["refunded_s"]), "{void} {back}");
        assert!(number(&back["wall_s"]) >= number(&counted["wall_s"]), "{counted} {back}");
        client.ask(json!({"op": "stop"})).await;
        assert_eq!(ranking(&cup), before);
        cup.verified(run_id).await;
        let audit = cup.get("/v1/admin/audit", &cup.organizer).json();
        let of_run = audit["records"].as_array().expect("records").iter();
        let actions: Vec<_> =
            of_run.filter(|one| one["subject"] == *run_id).map(|one| &one["action"]).collect();
        assert_eq!(actions, ["run.void", "run.unvoid"]);

        // A run that counts is not restored, and one without a reason neither.
        let again = json!({"run_id": run_id, "reason": "twice"});
        cup.post("/v1/admin/run/unvoid", &cup.organizer, &again).assert_problem(409, "wrong_state");
        cup.post("/v1/admin/run/unvoid", &cup.organizer, &json!({"run_id": run_id}))
            .assert_problem(400, "bad_request");

        // After a crash, with the session closed in between.
        act(&cup, "void", run_id);
        let void = time(&mut client).await;
        let cup = cup.crashed();
        act(&cup, "unvoid", run_id);
        let (mut client, _) = cup.greet(&token).await;
        let back = time(&mut client).await;
        assert_eq!(number(&back["simulated_s"]) - number(&void["simulated_s"]), 3.0, "{void} {back}");
        let cup = cup.crashed();
        let (mut client, _) = cup.greet(&token).await;
        assert_eq!(time(&mut client).await["simulated_s"], back["simulated_s"]);
        assert_eq!(ranking(&cup), before);

        // A run of a session that has ended.
        cup.order("session/end", json!({"session_id": welcome["session_id"]}));
        let void = act(&cup, "void", run_id)["session"].clone();
        let back = act(&cup, "unvoid", run_id)["session"].clone();
        let taken_s = number(&back["clock_simulated_s"]) - number(&void["clock_simulated_s"]);
        assert_eq!((taken_s, &back["status"]), (3.0, &json!("ended")), "{void} {back}");
        assert!(number(&back["refunded_s"]) < number(&void["refunded_s"]), "{void} {back}");
        assert_eq!(ranking(&cup), before);
    }
}

#[tokio::test]
async fn a_run_that_cannot_count_again_stays_void_and_the_answer_says_why() {
    let rules = RULES.replace("session_s = 600", "session_s = 60");
    let cup = Official::start_on(TempDir::new().expect("temporary directory"), &rules, None);
    let token = cup.team("crabs");
    cup.open();
    let (mut client, welcome) = cup.greet(&token).await;
    let refused = |run_id: &Value, why: &str| {
        let body = json!({"run_id": run_id, "reason": "the referee"});
        let answer = cup.post("/v1/admin/run/unvoid", &cup.organizer, &body);
        answer.assert_problem(409, "wrong_state");
        assert!(answer.body.contains(why), "'{why}' is not in: {}", answer.body);
    };
    // The time that was given back is used for another run.
    let first = played(&mut client, 25).await;
    act(&cup, "void", &first["run_id"]);
    played(&mut client, 40).await;
    refused(&first["run_id"], "has been used");
    let run =
        cup.get(&format!("/v1/runs/{}", first["run_id"].as_str().expect("an id")), &cup.organizer).json();
    assert_eq!(run["status"], "voided", "{run}");
    // With that time granted it counts.
    cup.order(
        "session/grant",
        json!({"session_id": welcome["session_id"], "seconds": 30, "reason": "for the run"}),
    );
    act(&cup, "unvoid", &first["run_id"]);
    // A whole session is another thing.
    cup.order("session/void", json!({"session_id": welcome["session_id"], "reason": "all of it"}));
    refused(&first["run_id"], "its whole session is void");
}

#[tokio::test]
async fn a_grant_is_corrected_down_to_nothing_and_no_further() {
    for cup in Official::each().await {
        let token = cup.team("crabs");
        cup.open();
        let (mut client, welcome) = cup.greet(&token).await;
        let session_id = &welcome["session_id"];
        let grant = |seconds: f64| json!({"session_id": session_id, "seconds": seconds, "reason": "a slip"});
        cup.order("session/grant", grant(1200.0));
        assert_eq!(number(&time(&mut client).await["session_s"]), 1800.0);
        // It was to be two minutes.
        cup.order("session/grant", grant(-1080.0));
        assert_eq!(number(&time(&mut client).await["session_s"]), 720.0);
        let answer = cup.post("/v1/admin/session/grant", &cup.organizer, &grant(-121.0));
        answer.assert_problem(409, "wrong_state");
        assert!(answer.body.contains("120 s were granted in all"), "{}", answer.body);
        for wrong in [0.0, -90_000.0] {
            cup.post("/v1/admin/session/grant", &cup.organizer, &grant(wrong))
                .assert_problem(400, "bad_request");
        }
        let said = cup.admin(&[
            "session",
            "grant",
            session_id.as_str().expect("an id"),
            "--seconds",
            "-120",
            "--reason",
            "none",
        ]);
        assert!(said.status.success(), "{said:?}");
        assert_eq!(number(&time(&mut client).await["session_s"]), 600.0);
        let audit = cup.get("/v1/admin/audit", &cup.organizer).json();
        let grants = audit["records"].as_array().expect("records").iter();
        let grants = grants.filter(|one| one["action"] == "session.grant").map(|one| number(&one["seconds"]));
        assert_eq!(grants.collect::<Vec<_>>(), [1200.0, -1080.0, -120.0]);
        // Also after a restart.
        let cup = cup.crashed();
        let (mut client, _) = cup.greet(&token).await;
        assert_eq!(number(&time(&mut client).await["session_s"]), 600.0);
    }
}
