//! Time slots of teams, and the forecast of places.

use crate::harness::{Official, RULES, get, official_reset, step};
use serde_json::{Value, json};
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use tempfile::TempDir;

/// A time this many seconds from now, with its offset.
fn at(seconds: i64) -> String {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).expect("after 1970").as_secs() as i64;
    // The date of a number of days since 1970, by Howard Hinnant's `civil_from_days`.
    let (days, rest) = ((now + seconds).div_euclid(86_400), (now + seconds).rem_euclid(86_400));
    let z = days + 719_468;
    let era = z.div_euclid(146_097);
    let day_of_era = z.rem_euclid(146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * day_of_year + 2) / 153;
    let (day, month) = (day_of_year - (153 * shifted + 2) / 5 + 1, (shifted + 2) % 12 + 1);
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    let (hour, minute, second) = (rest / 3600, rest / 60 % 60, rest % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}+00:00")
}

fn csv(slots: &[(&str, i64, i64)]) -> String {
    let lines = slots.iter().map(|(team, begins, ends)| format!("{team},{},{}\n", at(*begins), at(*ends)));
    lines.fold("team,begins_at,ends_at\n".to_owned(), |all, line| all + &line)
}

fn import(cup: &Official, slots: &[(&str, i64, i64)]) -> Value {
    cup.order("schedule/import", json!({"csv": csv(slots), "reason": "the draw"}))
}

async fn hello(cup: &Official, token: &str) -> Value {
    cup.connect(token).await.ask(json!({"op": "hello", "client": "test"})).await
}

#[tokio::test]
async fn a_team_plays_in_its_slot_and_learns_when_it_begins() {
    for cup in Official::each().await {
        let (crabs, rays, eels) = (cup.team("crabs"), cup.team("rays"), cup.team("eels"));
        cup.open();
        let shown = import(&cup, &[("crabs", -60, 300), ("rays", 3600, 7200)]);
        assert_eq!(shown["slots"][0]["state"], "now", "{shown}");
        assert!(shown["warnings"].to_string().contains("without a slot cannot play: eels"), "{shown}");

        let early = hello(&cup, &rays).await;
        assert_eq!(early["code"], "not_scheduled", "{early}");
        let wait_s = early["retry_after_s"].as_f64().expect("seconds");
        assert!((3500.0..=3600.0).contains(&wait_s), "{early}");
        let message = early["message"].as_str().expect("text");
        assert!(message.contains("slot begins at 20") && message.contains("practise"), "{message}");
        let none = hello(&cup, &eels).await;
        assert_eq!(
            (&none["code"], &none["retry_after_s"]),
            (&json!("not_scheduled"), &Value::Null),
            "{none}"
        );

        // The session is at most as long as the rest of the slot, from the first reset on.
        let (mut client, welcome) = cup.greet(&crabs).await;
        assert_eq!(welcome["session_left_s"], 600.0);
        let obs = client.ask(official_reset()).await;
        let left_s = obs["session_left_s"].as_f64().expect("seconds");
        assert!((200.0..=300.0).contains(&left_s), "{left_s}");
        let competition = get(&cup.server, "/v1/competition").json();
        let (schedule, places) = (&competition["schedule"], &competition["places"]);
        assert_eq!((&schedule["slots"], &schedule["running"]), (&json!(2), &json!(1)), "{competition}");
        assert_eq!((&places["playing"], &places["free_within_s"]), (&json!(1), &json!(0.0)), "{competition}");
        assert!(!competition.to_string().contains("crabs"), "only counts are public: {competition}");

        // It stays so after a crash; and granted time is added.
        let cup = cup.crashed();
        let (mut client, _) = cup.greet(&crabs).await;
        let session = cup.get("/v1/sessions", &cup.organizer).json()["sessions"][0].clone();
        assert!(session["limit_s"].as_f64().is_some_and(|limit_s| limit_s <= 300.0), "{session}");
        assert_eq!(client.ask(official_reset()).await["op"], "obs");
        // An open session is not refused when its slot is over: its clock alone counts.
        cup.order("schedule/clear", json!({"team": "crabs"}));
        drop(client);
        let (mut client, _) = cup.greet(&crabs).await;
        client.ask(json!({"op": "stop"})).await;
        assert_eq!(client.ask(official_reset()).await["op"], "obs");

        // Without a schedule every team may begin.
        assert_eq!(cup.order("schedule/clear", json!({}))["slots"], json!([]));
        assert_eq!(hello(&cup, &eels).await["op"], "welcome");
        assert_eq!(get(&cup.server, "/v1/competition").json()["schedule"], Value::Null);
    }
}

#[tokio::test]
async fn a_session_ends_with_its_slot_and_a_slot_that_is_over_begins_none() {
    let cup = Official::start();
    let (crabs, rays) = (cup.team("crabs"), cup.team("rays"));
    cup.open();
    import(&cup, &[("crabs", -60, 4), ("rays", -60, 3)]);
    let (mut client, _) = cup.greet(&crabs).await;
    let (mut idle, _) = cup.greet(&rays).await;
    assert_eq!(client.ask(official_reset()).await["op"], "obs");
    client.goes_on(0).await;
    tokio::time::sleep(Duration::from_millis(4200)).await;
    client.refused(step(1), "session_over").await;
    let result = client.ask(json!({"op": "stop"})).await;
    assert_eq!(
        (&result["reason"], &result["status"]),
        (&json!("session_over"), &json!("provisional")),
        "{result}"
    );
    let late = idle.ask(official_reset()).await;
    assert_eq!(late["code"], "not_scheduled", "{late}");
    assert!(late["message"].as_str().is_some_and(|text| text.contains("ended at")), "{late}");
    let session = cup.get("/v1/sessions", &rays).json()["sessions"][0]["session_id"].clone();
    cup.order(
        "session/grant",
        json!({"session_id": session, "seconds": 90, "reason": "the door was locked"}),
    );
    let obs = idle.ask(official_reset()).await;
    assert!(obs["session_left_s"].as_f64().is_some_and(|left_s| left_s > 80.0 && left_s <= 90.0), "{obs}");
}

#[tokio::test]
async fn a_pause_moves_the_end_of_running_slots() {
    for cup in Official::each().await {
        let crabs = cup.team("crabs");
        cup.team("rays");
        cup.open();
        import(&cup, &[("crabs", -60, 3), ("rays", 3600, 7200)]);
        let slots = |cup: &Official| cup.get("/v1/admin/schedule", &cup.organizer).json()["slots"].clone();
        let before = slots(&cup);
        let (mut client, _) = cup.greet(&crabs).await;
        cup.order("competition/pause", json!({}));
        tokio::time::sleep(Duration::from_millis(3200)).await;
        assert_eq!(
            slots(&cup),
            before.as_array().map_or(json!(null), |slots| {
                let mut slots = slots.clone();
                slots[0]["state"] = "over".into();
                json!(slots)
            })
        );
        drop(client);
        // In the pause no slot is over.
        (client, _) = cup.greet(&crabs).await;
        cup.order("competition/resume", json!({}));
        let after = slots(&cup);
        let moved =
            after[0]["ends_unix_ms"].as_i64().expect("ms") - before[0]["ends_unix_ms"].as_i64().expect("ms");
        assert!((3200..20_000).contains(&moved), "{moved}");
        assert_eq!(after[1], before[1], "a later slot stays");
        assert_eq!(client.ask(official_reset()).await["op"], "obs");
    }
}

#[tokio::test]
async fn a_team_that_waits_for_a_place_keeps_the_rest_of_its_slot_and_is_in_the_queue() {
    let folder = TempDir::new().expect("temporary directory");
    let cup = Official::start_on(folder, &format!("{RULES}max_worlds = 1\n"), None);
    let (crabs, rays) = (cup.team("crabs"), cup.team("rays"));
    cup.open();
    import(&cup, &[("crabs", -60, 300), ("rays", -60, 200)]);
    let (mut playing, _, _) = cup.playing(&crabs).await;
    let (mut waiting, _) = cup.greet(&rays).await;
    let refusal = waiting.ask(official_reset()).await;
    assert_eq!(refusal["code"], "capacity", "{refusal}");
    let first = waiting.ask(json!({"op": "time"})).await;
    let left_s = first["session_left_s"].as_f64().expect("a number");
    assert!((100.0..=200.0).contains(&left_s), "{first}");
    tokio::time::sleep(Duration::from_millis(300)).await;
    assert_eq!(waiting.ask(json!({"op": "time"})).await["session_left_s"], left_s, "the clock is stopped");

    let competition = get(&cup.server, "/v1/competition").json();
    assert_eq!(competition["worlds"]["waiting"], 1, "{competition}");
    let within_s = competition["places"]["free_within_s"].as_f64().expect("a forecast");
    assert!(within_s > 100.0, "both sessions have to end: {competition}");
    let said = String::from_utf8(cup.admin(&["session", "list"]).stdout).expect("text");
    assert!(said.lines().any(|line| line.contains("rays") && line.contains("no. 1 in the queue")), "{said}");

    playing.ask(json!({"op": "stop"})).await;
    let obs = waiting.ask(official_reset()).await;
    let now_s = obs["session_left_s"].as_f64().expect("a number");
    assert!(obs["op"] == "obs" && now_s > left_s - 2.0, "{left_s}: {obs}");
    let sessions = cup.get("/v1/sessions", &rays).json();
    assert_eq!(sessions["sessions"][0].get("place_in_queue"), None, "{sessions}");
}

/// Longer than a session is kept in the queue without a request.
const LONG_PAUSE: Duration = Duration::from_millis(10_500);

#[tokio::test]
async fn a_pause_of_the_competition_costs_no_place_in_the_queue() {
    let folder = TempDir::new().expect("temporary directory");
    let cup = Official::start_on(folder, &format!("{RULES}max_worlds = 1\n"), None);
    let (crabs, rays, eels) = (cup.team("crabs"), cup.team("rays"), cup.team("eels"));
    cup.open();
    let (mut playing, _, _) = cup.playing(&crabs).await;
    let (mut first, _) = cup.greet(&rays).await;
    let (mut second, _) = cup.greet(&eels).await;
    for waiting in [&mut first, &mut second] {
        assert_eq!(waiting.ask(official_reset()).await["code"], "capacity");
    }
    cup.order("competition/pause", json!({"reason": "fire alarm"}));
    tokio::time::sleep(LONG_PAUSE).await;
    cup.order("competition/resume", json!({}));
    // The later one asks first, also when a place is free.
    let refusal = second.ask(official_reset()).await;
    assert!(
        refusal["message"].as_str().is_some_and(|text| text.contains("1 session waits before")),
        "{refusal}"
    );
    playing.ask(json!({"op": "stop"})).await;
    assert_eq!(second.ask(official_reset()).await["code"], "capacity");
    assert_eq!(first.ask(official_reset()).await["op"], "obs");
}

#[test]
fn a_schedule_that_does_not_fit_is_refused_or_warned_about() {
    let folder = TempDir::new().expect("temporary directory");
    let cup = Official::start_on(folder, &format!("{RULES}max_worlds = 2\n"), None);
    for team in ["a", "b", "c"] {
        cup.team(team);
    }
    let shown = import(&cup, &[("a", 60, 1200), ("b", 600, 1800), ("c", 900, 1800)]);
    let warnings = shown["warnings"].to_string();
    assert!(
        warnings.contains("up to 3 teams play at once, and there are 2 places: 3 teams from 20"),
        "{warnings}"
    );
    let refused = |body: Value, verb: &str| {
        let answer = cup.post(&format!("/v1/admin/schedule/{verb}"), &cup.organizer, &body);
        (answer.status, answer.json()["detail"].as_str().unwrap_or_default().to_owned())
    };
    let unknown = refused(json!({"csv": csv(&[("crabs", 0, 9)])}), "import");
    assert!(unknown.0 == 404 && unknown.1.contains("no team crabs"), "{unknown:?}");
    let overlap = refused(json!({"csv": csv(&[("a", 0, 9), ("a", 8, 20)])}), "import");
    assert!(overlap.0 == 400 && overlap.1.contains("two slots of a overlap"), "{overlap:?}");
    let line =
        refused(json!({"csv": "team,begins_at,ends_at\na,2027-05-04 09:00,2027-05-04T10:00Z\n"}), "import");
    assert!(line.0 == 400 && line.1.contains("line 2: begins_at"), "{line:?}");
    // Nothing of these was stored or recorded.
    let records = cup.get("/v1/admin/audit", &cup.organizer).json()["records"].to_string();
    assert_eq!(records.matches("schedule.import").count(), 1, "{records}");
    let token = cup.team("d");
    assert_eq!(cup.post("/v1/admin/schedule/clear", &token, &json!({})).status, 403);
}

#[test]
fn the_schedule_from_the_command_line() {
    let cup = Official::start();
    cup.team("crabs");
    cup.team("rays");
    let file = cup.folder().join("slots.csv");
    std::fs::write(&file, csv(&[("crabs", 3600, 5400), ("rays", 3600, 5400)])).expect("a file");
    let run = |arguments: &[&str]| {
        let output = cup.admin(&[&["schedule"], arguments].concat());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{arguments:?}: {said}");
        (String::from_utf8(output.stdout).expect("text"), said)
    };
    let (table, said) = run(&["import", file.to_str().expect("a path"), "--reason", "the draw"]);
    assert!(table.lines().count() == 3 && table.contains(" 30 ") && said.is_empty(), "{table}{said}");
    let (moved, _) = run(&["move", "--by", "-10", "--reason", "we are early"]);
    assert_ne!(moved, table);
    let (moved, _) = run(&["move", "crabs", "--begins", &at(7200)]);
    assert!(
        moved.lines().nth(2).is_some_and(|line| line.contains("crabs") && line.contains(" 30 ")),
        "{moved}"
    );
    run(&["add", "crabs", "--begins", &at(9200), "--ends", &at(9900)]);
    let (_, said) = run(&["show"]);
    assert!(said.contains("more slots than their 1 session(s): crabs"), "{said}");
    let (json, _) = run(&["show", "--json"]);
    let shown: Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!((shown["slots"].as_array().map(Vec::len), &shown["places"]), (Some(3), &json!(32)));
    let (table, said) = run(&["clear", "crabs"]);
    assert!(
        table.lines().count() == 2 && said.contains("without a slot cannot play: crabs"),
        "{table}{said}"
    );
    assert!(run(&["clear"]).0.contains("no schedule"));
}
