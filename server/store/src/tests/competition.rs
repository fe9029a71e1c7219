//! Teams, tokens, run numbers, clocks, verification and ranking of an official competition.

use super::*;

fn entry<'a>(action: &'a str, subject: &'a str) -> NewAuditEntry<'a> {
    NewAuditEntry { actor: "tok_1", action, subject, reason: Some("because") }
}

fn token<'a>(token_id: &'a str, team: Option<&'a str>) -> NewToken<'a> {
    let role = if team.is_some() { "team" } else { "organizer" };
    NewToken { token_id, role, team, label: "", secret_hash: "ab" }
}

fn session<'a>(session_id: &'a str, team: &'a str) -> NewSession {
    NewSession {
        session_id: session_id.into(),
        team: team.into(),
        client_version: Some("1".into()),
        limit_s: Some(1800.0),
        mode: "official",
        token_hash: Some("cd".repeat(32)),
    }
}

#[tokio::test]
async fn teams_are_added_once_and_every_action_is_recorded() {
    for place in places().await {
        let store = place.open().await;
        assert_eq!(store.add_team("crabs", &entry("team.add", "crabs")).await.expect("adds"), None);
        for again in ["crabs", "Crabs", "crаbs"] {
            let had = store.add_team(again, &entry("team.add", again)).await.expect("knows");
            assert_eq!(had.as_deref(), Some("crabs"), "{again}");
        }
        assert!(
            store.has_team("crabs").await.expect("query") && !store.has_team("eels").await.expect("query")
        );
        store
            .add_token(&token("one", Some("crabs")), true, &entry("token.issue", "crabs"))
            .await
            .expect("adds");
        let issue = entry("token.rotate", "crabs");
        let revoked = store.add_token(&token("two", Some("crabs")), true, &issue).await.expect("adds");
        assert_eq!(revoked, ["one"]);
        assert!(store.token("one").await.expect("query").expect("there").revoked_unix_ms.is_some());
        assert_eq!(store.teams().await.expect("query")[0].live_tokens, 1);

        let audit = store.audit(0, 100).await.expect("query");
        let short: Vec<_> = audit.iter().map(|e| (e.seq, e.action.as_str(), e.subject.as_str())).collect();
        assert_eq!(
            short,
            [(1, "team.add", "crabs"), (2, "token.issue", "crabs"), (3, "token.rotate", "crabs")]
        );
        assert_eq!(audit[0].reason.as_deref(), Some("because"));
        assert_eq!(store.audit(2, 100).await.expect("query").len(), 1);
        store.close().await;
    }
}

#[tokio::test]
async fn the_last_organizers_token_stays() {
    for place in places().await {
        let store = place.open().await;
        let issue = entry("token.issue", "organizer");
        assert!(!store.has_organizer().await.expect("query"));
        store.add_token(&token("one", None), false, &issue).await.expect("adds");
        assert!(!store.revoke_token("one", &entry("token.revoke", "one")).await.expect("keeps"));
        store.add_token(&token("two", None), false, &issue).await.expect("adds");
        assert!(store.revoke_token("one", &entry("token.revoke", "one")).await.expect("revokes"));
        assert!(!store.revoke_token("one", &entry("token.revoke", "one")).await.expect("was"));
        assert!(!store.revoke_token("two", &entry("token.revoke", "two")).await.expect("keeps"));
        assert_eq!(
            store.audit(0, 100).await.expect("query").len(),
            3,
            "a refused revocation is not recorded"
        );
        store.close().await;
    }
}

#[tokio::test]
async fn no_run_number_is_given_twice() {
    for place in places().await {
        let store = place.open().await;
        let mut asked = Vec::new();
        for _ in 0..8 {
            let store = store.clone();
            asked.push(tokio::spawn(async move { store.next_k("a", "balls").await.expect("a number") }));
        }
        let mut given = Vec::new();
        for number in asked {
            given.push(number.await.expect("joins"));
        }
        given.sort_unstable();
        assert_eq!(given, [1, 2, 3, 4, 5, 6, 7, 8]);
        assert_eq!(store.next_k("a", "shelf").await.expect("a number"), 1);
        assert_eq!(store.next_k("b", "balls").await.expect("a number"), 1);
        store.close().await;
    }
}

#[tokio::test]
async fn a_team_has_a_number_of_sessions_and_voided_ones_do_not_count() {
    for place in places().await {
        let store = place.open().await;
        store.add_team("crabs", &entry("team.add", "crabs")).await.expect("adds");
        let mut asked = Vec::new();
        for i in 0..4 {
            let store = store.clone();
            let session = session(&format!("s{i}"), "crabs");
            asked.push(tokio::spawn(
                async move { store.begin_session(&session, Some(2)).await.expect("asks") },
            ));
        }
        let mut given = 0;
        for answer in asked {
            given += usize::from(answer.await.expect("joins"));
        }
        assert_eq!(given, 2);
        let open = store.sessions(Some("crabs")).await.expect("query");
        assert!(store.void_session(&open[0].session_id, &entry("session.void", "s")).await.expect("voids"));
        assert!(store.begin_session(&session("s9", "crabs"), Some(2)).await.expect("asks"));
        assert!(!store.begin_session(&session("s10", "crabs"), Some(2)).await.expect("asks"));
        store.close().await;
    }
}

#[tokio::test]
async fn a_clock_outlives_the_process() {
    for place in places().await {
        let store = place.open().await;
        store.begin_session(&session("s", "crabs"), None).await.expect("session");
        let unlimited = NewSession { limit_s: None, ..session("p", "crabs") };
        store.begin_session(&NewSession { mode: "practice", ..unlimited }, None).await.expect("session");
        let mut clock = ClockRow { started: true, wall_s: 12.25, simulated_s: 3.5, ..ClockRow::default() };
        // None and Some in turn: both go through the same prepared statement.
        store.save_clock(&held("s"), &clock, &[]).await.expect("saves");
        clock.run_from_s = Some(10.5);
        clock.refunded_s = 1.125;
        store.save_clock(&held("s"), &clock, &[]).await.expect("saves");
        assert!(store.pause_session("s", true, &entry("session.pause", "s")).await.expect("pauses"));
        assert!(!store.pause_session("s", true, &entry("session.pause", "s")).await.expect("is"));
        store.close().await;

        let store = place.open().await;
        store.end_lost_practice().await.expect("ends");
        let taken = store.take_sessions(usize::MAX, None).await.expect("takes");
        assert_eq!(taken.len(), 1, "{taken:?}");
        let found = store.resumable_session(&taken[0]).await.expect("query").expect("it is open");
        assert_eq!((found.clock, found.limit_s, found.paused), (clock, Some(1800.0), true));
        assert!(store.pause_session("s", false, &entry("session.resume", "s")).await.expect("goes on"));
        assert!(store.grant_time("s", 60.0, &entry("session.grant", "s")).await.expect("grants"));
        assert_eq!(store.session("s").await.expect("query").and_then(|s| s.limit_s), Some(1860.0));
        store.end_session(&taken[0]).await.expect("ends");
        assert!(store.take_sessions(usize::MAX, None).await.expect("takes").is_empty());
        store.close().await;
    }
}

#[tokio::test]
async fn the_clocks_of_all_sessions_are_saved_at_once_but_no_later_one_is_lost() {
    for place in places().await {
        let store = place.open().await;
        let names: Vec<String> = (0..202).map(|k| format!("s{k}")).collect();
        for name in &names {
            store.begin_session(&session(name, name), None).await.expect("session");
        }
        let clock = |wall_s, simulated_s, refunded_s, run_from_s| ClockRow {
            started: true,
            wall_s,
            simulated_s,
            refunded_s,
            run_from_s,
        };
        let save = async |clocks: &[(&str, ClockRow)]| {
            let saved = |&(name, clock): &(&str, ClockRow)| SavedClock {
                session_id: name.into(),
                epoch: held(name).epoch,
                clock,
                in_run: None,
            };
            store.save_clocks(&clocks.iter().map(saved).collect::<Vec<_>>()).await.expect("saves");
        };
        let saved = async |name: &str| {
            store.resumable_session(&held(name)).await.expect("query").map(|session| session.clock)
        };
        save(&[]).await;
        let first = [clock(10.0, 3.0, 0.0, None), clock(0.5, 9.5, 0.0, Some(9.5))];
        let all: Vec<_> = names.iter().enumerate().map(|(k, name)| (name.as_str(), first[k % 2])).collect();
        save(&all).await;
        for (name, clock) in [all[0], all[1], all[200], all[201]] {
            assert_eq!(saved(name).await, Some(clock), "{name}");
        }
        // Two sessions save a refund and a result, one ends; then come the clocks that were read before.
        let (refund, result) = (clock(8.0, 3.0, 2.0, None), clock(0.7, 19.5, 0.0, None));
        store.save_clock(&held("s0"), &refund, &[]).await.expect("saves");
        store.save_clock(&held("s1"), &result, &[]).await.expect("saves");
        store.end_session(&held("s2")).await.expect("ends");
        let later = clock(11.0, 9.5, 0.0, None);
        save(&[all[0], all[1], ("s2", later), ("s3", later)]).await;
        for (name, clock) in [("s0", refund), ("s1", result), ("s3", later)] {
            assert_eq!(saved(name).await, Some(clock), "{name}");
        }
        assert_eq!(store.session("s2").await.expect("query").map(|session| session.clock_wall_s), Some(10.0));
        let later = [clock(8.5, 3.0, 2.0, None), clock(20.0, 19.5, 0.0, Some(20.0))];
        save(&[("s0", later[0]), ("s1", later[1])]).await;
        assert_eq!((saved("s0").await, saved("s1").await), (Some(later[0]), Some(later[1])));
        // Another owner.
        let epoch = held("s4").epoch + 1;
        let stale = SavedClock { session_id: "s4".into(), epoch, clock: later[0], in_run: None };
        store.save_clocks(&[stale]).await.expect("saves nothing");
        assert_eq!(saved("s4").await, Some(first[0]));
        store.close().await;
    }
}

/// Adds the pending refunds to the clock's refunds.
fn refund(clock: ClockRow, pending: &[RunCost], revived: bool) -> RefundedClock {
    let more: f64 = pending.iter().map(|cost| cost.simulated_s).sum();
    RefundedClock { clock: ClockRow { refunded_s: clock.refunded_s + more, ..clock }, revived }
}

#[tokio::test]
async fn a_void_run_is_refunded_once() {
    for place in places().await {
        let store = place.open().await;
        for (k, run) in ["one", "two", "three"].into_iter().enumerate() {
            begin_in(&store, "official", "crabs", "balls", run, Some(k as u64 + 1), Sensing::Truth).await;
        }
        finish(&store, "one", 1.0, "provisional").await;
        finish(&store, "two", 1.0, "voided").await;
        finish(&store, "three", 1.0, "provisional").await;
        assert!(
            store.sessions_with_pending_refunds().await.expect("query").is_empty(),
            "no refunds for runs that count"
        );
        for run in ["one", "three"] {
            assert!(store.void_run(run, &entry("run.void", run)).await.expect("voids"));
        }
        store.end_session(&held("s-one")).await.expect("ends");
        store.end_session(&held("s-three")).await.expect("ends");
        store.close().await;

        // The refund is still pending in the next process.
        let store = place.open().await;
        assert_eq!(store.sessions_with_pending_refunds().await.expect("query"), ["s-one", "s-three"]);
        let pending = store.pending_refunds("s-one").await.expect("query");
        assert_eq!(pending, [RunCost { run_id: "one".into(), wall_s: 1.5, simulated_s: 3.25 }]);
        // Refunded by an open session, with its clock.
        store.save_clock(&held("s-one"), &ClockRow::default(), &["one".into()]).await.expect("saves");
        assert!(store.pending_refunds("s-one").await.expect("query").is_empty());
        // Refunded in the database alone: once, and reopened only with `reopen` and without another session.
        for (reopen, revived) in [(false, true), (true, true), (true, true)] {
            let done =
                store.refund("s-three", reopen, |_, clock, pending| refund(clock, pending, revived)).await;
            done.expect("refunds");
        }
        let row = store.session("s-three").await.expect("query").expect("there");
        assert_eq!((row.refunded_s, row.status.as_str()), (3.25, "ended"));
        assert!(store.sessions_with_pending_refunds().await.expect("query").is_empty());
        store.close().await;
    }
}

#[tokio::test]
async fn a_refunded_session_opens_again_unless_its_team_has_another() {
    for place in places().await {
        let store = place.open().await;
        for (k, run) in ["one", "two"].into_iter().enumerate() {
            begin_in(&store, "official", "crabs", "balls", run, Some(k as u64 + 1), Sensing::Truth).await;
            finish(&store, run, 1.0, "provisional").await;
            store.end_session(&held(&format!("s-{run}"))).await.expect("ends");
            assert!(store.void_run(run, &entry("run.void", run)).await.expect("voids"));
        }
        for (session, becomes) in [("s-one", "open"), ("s-two", "ended")] {
            store
                .refund(session, true, |_, clock, pending| refund(clock, pending, true))
                .await
                .expect("refunds");
            let row = store.session(session).await.expect("query").expect("there");
            assert_eq!((row.refunded_s, row.status.as_str()), (3.25, becomes));
            assert_eq!(row.ended_unix_ms.is_none(), becomes == "open");
        }
        assert!(store.void_session("s-one", &entry("session.void", "s-one")).await.expect("voids"));
        store.close().await;
    }
}

#[tokio::test]
async fn a_result_and_the_clock_after_it_are_stored_together() {
    for place in places().await {
        let store = place.open().await;
        begin_in(&store, "official", "crabs", "balls", "r", Some(1), Sensing::Truth).await;
        let clock = ClockRow { started: true, wall_s: 9.5, simulated_s: 4.25, ..ClockRow::default() };
        let run = FinishedRunRow {
            held: &held("s-r"),
            replay: None,
            ended_unix_ms: None,
            run_id: "r",
            status: "provisional",
            outcome: &outcome(1.0),
            note: None,
            missed_ticks: 0,
            cost_s: (2.0, 4.25),
            clock: Some(clock),
        };
        store.finish_run(&run).await.expect("finish");
        let row = store.session("s-r").await.expect("query").expect("there");
        assert_eq!((row.clock_wall_s, row.clock_simulated_s), (9.5, 4.25));
        store.close().await;
    }
}

#[tokio::test]
async fn verification_decides_what_counts() {
    for place in places().await {
        let store = place.open().await;
        for (k, (run_id, score)) in [("good", 2.0), ("false", 5.0), ("void", 7.0)].into_iter().enumerate() {
            begin_in(&store, "official", "crabs", "balls", run_id, Some(k as u64 + 1), Sensing::Sensors)
                .await;
            let path = format!("replays/{run_id}.mcap");
            let replay = Some((path.as_str(), "ef"));
            assert_eq!(finish_with(&store, run_id, score, "provisional", replay).await, "provisional");
        }
        begin_in(&store, "official", "eels", "balls", "seen", Some(1), Sensing::Truth).await;
        finish(&store, "seen", 3.0, "provisional").await;
        assert_eq!(store.verification_queue().await.expect("query").waiting, 3);
        let mut claims = Vec::new();
        while let Some(claim) = store.claim_verification("a").await.expect("claims") {
            claims.push(claim);
        }
        let claimed: Vec<_> = claims.iter().map(|claim| claim.run_id.as_str()).collect();
        assert_eq!(claimed, ["good", "false", "void"]);
        assert_eq!(claims[0].replay_path, "replays/good.mcap");
        let decide =
            async |run_id, status| store.set_verdict("a", run_id, status, "300 ticks").await.expect("notes");
        assert!(decide("good", VerificationStatus::Verified).await);
        assert!(decide("false", VerificationStatus::Rejected).await);
        assert!(store.void_run("void", &entry("run.void", "void")).await.expect("voids"));
        assert!(!decide("void", VerificationStatus::Verified).await);

        let rows = store.leaderboard(true).await.expect("query");
        let short: Vec<_> = rows.iter().map(|r| (r.team.as_str(), r.total, r.sensors_rank)).collect();
        assert_eq!(short, [("eels", 3.0, None), ("crabs", 2.0, Some(1))]);
        assert_eq!(rows[1].tasks["balls"].status, "verified");
        assert!(store.reverify("false", &entry("run.reverify", "false")).await.expect("asks"));
        assert!(!store.reverify("void", &entry("run.reverify", "void")).await.expect("stays void"));
        assert_eq!(store.verification_queue().await.expect("query").waiting, 1);
        store.close().await;
    }
}

#[tokio::test]
async fn a_run_that_ends_in_a_voided_session_is_void() {
    for place in places().await {
        let store = place.open().await;
        begin_in(&store, "official", "crabs", "balls", "r", Some(1), Sensing::Sensors).await;
        assert!(store.void_session("s-r", &entry("session.void", "s-r")).await.expect("voids"));
        assert_eq!(finish(&store, "r", 9.0, "provisional").await, "voided");
        assert!(store.leaderboard(true).await.expect("query").is_empty());
        store.close().await;
    }
}

#[tokio::test]
async fn a_hand_waits_for_a_decision() {
    for place in places().await {
        let store = place.open().await;
        for (hand_id, team) in [("h1", "crabs"), ("h2", "eels")] {
            let (sha256, warnings) = ("ab", "[]");
            let hand = NewHand { hand_id, team, name: "claw", sha256, bytes: 9, warnings };
            store.add_hand(&hand).await.expect("adds");
        }
        assert_eq!(store.hands(None).await.expect("query").len(), 2);
        assert_eq!(store.hands(Some("eels")).await.expect("query")[0].status, "pending");
        assert!(store.decide_hand("h2", true, &entry("hand.approve", "h2")).await.expect("approves"));
        assert!(!store.decide_hand("h3", true, &entry("hand.approve", "h3")).await.expect("knows none"));
        assert_eq!(
            store.hand("h2").await.expect("query").map(|hand| hand.status).as_deref(),
            Some("approved")
        );
        assert_eq!(
            store.hand("h1").await.expect("query").map(|hand| hand.status).as_deref(),
            Some("pending")
        );
        assert_eq!(store.pin_setting("state", "open").await.expect("sets"), "open");
        assert_eq!(store.pin_setting("state", "closed").await.expect("keeps"), "open");
        let change = entry("state", "closed");
        store.change_settings(&[("state", "closed")], &change).await.expect("sets");
        assert_eq!(store.setting("state").await.expect("query").as_deref(), Some("closed"));
        store.close().await;
    }
}

/// As on several servers with one database: each has a lock of its own for numbers.
#[tokio::test]
async fn numbers_of_records_and_announcements_hold_with_three_servers() {
    for place in places().await {
        let store = place.open().await;
        let servers = (0..3).map(|server| {
            let mut store = store.clone();
            store.audit = Default::default();
            tokio::spawn(async move {
                let reason = format!("by {server}");
                let entry = NewAuditEntry { actor: "test", action: "x", subject: "y", reason: Some(&reason) };
                for _ in 0..60 {
                    store.record(&entry).await.expect("recorded");
                    store.announce("lunch", &entry).await.expect("announced");
                }
            })
        });
        for server in servers.collect::<Vec<_>>() {
            server.await.expect("no failure");
        }
        let numbers: Vec<i64> = store.audit(0, 1000).await.expect("query").iter().map(|e| e.seq).collect();
        assert_eq!(numbers, (1..=360).collect::<Vec<_>>());
        let numbers: Vec<i64> =
            store.announcements(1000).await.expect("query").iter().map(|a| a.id).collect();
        assert_eq!(numbers, (1..=180).rev().collect::<Vec<_>>());
        store.close().await;
    }
}
