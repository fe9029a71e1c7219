//! Long lists for organizers: filters, pages, tables.

use crate::harness::Official;
use serde_json::{Value, json};
use std::process::Output;

fn text(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).expect("text")
}

/// A run of a few ticks in the team's session; its id.
async fn played(client: &mut crate::harness::Client, task: &str) -> String {
    let reset = client.ask(json!({"op": "reset", "task": task, "hand": "softhand"})).await;
    assert_eq!(reset["op"], "obs", "{reset}");
    client.ask(json!({"op": "step", "tick": 0, "action": {"hand": [0.2]}, "repeat": 3})).await;
    let result = client.ask(json!({"op": "stop"})).await;
    result["run_id"].as_str().expect("an id").to_owned()
}

#[tokio::test]
async fn runs_are_listed_by_team_task_status_and_time_a_page_at_a_time() {
    for cup in Official::each().await {
        let tokens = ["crabs", "eels"].map(|team| cup.team(team));
        cup.open();
        let mut runs = Vec::new();
        for token in &tokens {
            let (mut client, _) = cup.greet(token).await;
            for task in ["balls", "shelf", "balls"] {
                runs.push(played(&mut client, task).await);
            }
        }
        for run in &runs {
            cup.verified(&json!(run)).await;
        }
        cup.order("run/void", json!({"run_id": runs[4], "reason": "a test"}));
        let listed = |query: &str| -> (Vec<String>, bool) {
            let list = cup.get(&format!("/v1/admin/runs?{query}"), &cup.organizer).json();
            let rows = list["runs"].as_array().expect("rows");
            let ids = rows.iter().map(|run| run["run_id"].as_str().expect("an id").to_owned()).collect();
            (ids, list["more"].as_bool().expect("a flag"))
        };
        let newest_first = |wanted: &[usize]| wanted.iter().map(|k| runs[*k].clone()).collect::<Vec<_>>();
        let times: Vec<i64> = runs
            .iter()
            .map(|id| cup.get(&format!("/v1/runs/{id}"), &cup.organizer).json()["started_unix_ms"].as_i64())
            .map(|time| time.expect("a time"))
            .collect();
        for (query, wanted, more) in [
            (String::new(), &[5, 4, 3, 2, 1, 0][..], false),
            ("team=eels".into(), &[5, 4, 3], false),
            ("task=balls&team=crabs".into(), &[2, 0], false),
            ("status=voided".into(), &[4], false),
            ("team=newts".into(), &[], false),
            (format!("since_unix_ms={}", times[3]), &[5, 4, 3], false),
            (format!("until_unix_ms={}&task=shelf", times[3]), &[1], false),
            ("limit=2".into(), &[5, 4], true),
            (format!("limit=2&after={}", runs[4]), &[3, 2], true),
            (format!("limit=2&after={}", runs[2]), &[1, 0], false),
        ] {
            assert_eq!(listed(&query), (newest_first(wanted), more), "{query}");
        }
        for query in ["status=lost", "after=run_none", "limit=x", "nonsense=1"] {
            let answer = cup.get(&format!("/v1/admin/runs?{query}"), &cup.organizer);
            answer.assert_problem(400, "bad_request");
        }

        let table = text(&cup.admin(&["run", "list", "--team", "crabs"]));
        let lines: Vec<&str> = table.lines().collect();
        assert!(lines[0].contains("began (UTC)") && lines.len() == 4, "{table}");
        for (line, run) in lines[1..].iter().zip(&runs) {
            assert!(
                line.contains(run.as_str()) && line.contains(" crabs ") && line.contains(" verified "),
                "{table}"
            );
        }
        let table = text(&cup.admin(&["run", "list", "--status", "voided", "--since", "2h"]));
        assert!(
            table.contains(&runs[4]) && table.contains("a test") && table.lines().count() == 2,
            "{table}"
        );
        let table = text(&cup.admin(&["run", "list", "--until", "2020-01-01"]));
        assert_eq!(table, "no runs\n");
        let table = text(&cup.admin(&["run", "list", "--limit", "2"]));
        assert!(table.lines().nth(2).is_some_and(|line| line.contains(&runs[5])), "the newest: {table}");
        assert!(table.ends_with("there are more: raise --limit\n"), "{table}");
        let list: Value = serde_json::from_str(&text(&cup.admin(&["run", "list", "--json"]))).expect("JSON");
        assert_eq!(list["runs"].as_array().expect("rows").len(), 6);
        let refused = cup.admin(&["run", "list", "--status", "lost"]);
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(!refused.status.success() && said.contains("provisional"), "{said}");
    }
}

#[tokio::test]
async fn the_audit_has_the_organizers_label_and_granted_seconds() {
    for cup in Official::each().await {
        let token = cup.team("crabs");
        cup.open();
        let (_, welcome) = cup.greet(&token).await;
        let session = welcome["session_id"].as_str().expect("an id");
        let anna = cup.order("token/add", json!({"role": "organizer", "label": "anna"}))["token"].clone();
        let grant = json!({"session_id": session, "seconds": 90.5, "reason": "late start"});
        cup.post("/v1/admin/session/grant", anna.as_str().expect("a token"), &grant);
        let records = cup.get("/v1/admin/audit", &cup.organizer).json()["records"].clone();
        let last = &records.as_array().expect("records")[records.as_array().map_or(0, Vec::len) - 1];
        assert_eq!((&last["action"], &last["label"]), (&json!("session.grant"), &json!("anna")), "{last}");
        assert_eq!((&last["seconds"], &records[0]["seconds"]), (&json!(90.5), &Value::Null));
        let table = text(&cup.admin(&["audit"]));
        let line = table.lines().last().expect("a record");
        for part in [" anna ", " session.grant ", " 90.5 ", "late start", &format!(" {session} "), " 20"] {
            assert!(line.contains(part), "{part}: {table}");
        }
        let seq = last["seq"].as_i64().expect("a number");
        let newer = text(&cup.admin(&["audit", "--after", &(seq - 1).to_string()]));
        assert_eq!(newer.lines().count(), 2, "{newer}");
        let csv = text(&cup.admin(&["export", "audit"]));
        assert!(csv.starts_with("seq,utc,actor,action,subject,reason,unix_ms,label,seconds\r\n"), "{csv}");
        assert!(csv.trim_end().ends_with(",anna,90.5"), "{csv}");
    }
}

#[test]
fn a_name_may_begin_with_a_hyphen() {
    let cup = Official::start();
    let refused = cup.admin(&["team", "add", "--fast"]);
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(!refused.status.success() && said.contains("'--fast'") && said.contains("no option"), "{said}");
    text(&cup.admin(&["team", "add", "-fast"]));
    text(&cup.admin(&["token", "add", "viewer", "--label", "-screen"]));
    text(&cup.admin(&["team", "rotate", "-fast", "--reason", "-5 minutes"]));
    text(&cup.admin(&["team", "rotate", "--", "-fast"]));
    assert!(text(&cup.admin(&["team", "list"])).contains(" -fast "));
    assert!(text(&cup.admin(&["token", "list"])).contains(" -screen "));
    assert!(text(&cup.admin(&["audit"])).contains(" -5 minutes\n"));
    assert_eq!(text(&cup.admin(&["run", "list", "--team", "-fast"])), "no runs\n");
    text(&cup.admin(&["announce", "-10 minutes"]));
    let slot = |begin: &str, end: &str| [format!("2099-05-04T{begin}:00Z"), format!("2099-05-04T{end}:00Z")];
    let [begins, ends] = &slot("09:00", "09:40");
    let added = text(&cup.admin(&["schedule", "add", "-fast", "--begins", begins, "--ends", ends]));
    assert!(added.contains(" -fast  2099-05-04T09:00:00Z"), "{added}");
    let [begins, ends] = &slot("10:00", "10:40");
    let moved = cup.admin(&["schedule", "move", "-fast", "--begins", begins, "--ends", ends]);
    assert!(text(&moved).contains("2099-05-04T10:00:00Z"));
    assert!(text(&cup.admin(&["schedule", "move", "--by", "-60"])).contains("2099-05-04T09:00:00Z"));
    let refused = cup.admin(&["schedule", "clear", "--fast"]);
    assert!(String::from_utf8_lossy(&refused.stderr).contains("no option"), "{refused:?}");
    assert!(text(&cup.admin(&["schedule", "clear", "-fast", "--reason", "-"])).starts_with("no schedule"));
}
