//! Files that somebody changed.

use super::*;
use crate::forge::{Change, rewritten};
use crate::format::{ACTION, EVENT, HASH, RESULT_RECORD};

/// Another σ in tick 42.
fn another_action(topic: &str, text: &str) -> String {
    if topic == ACTION && text.starts_with("{\"tick\":42,") {
        text.replace("\"hand\":[0.42", "\"hand\":[0.43")
    } else {
        text.into()
    }
}

#[test]
fn what_is_only_rewritten_is_accepted() {
    let scenario = Scenario::new("pinch", 60);
    let bytes = scenario.record().bytes;
    let again = rewritten(&bytes, &|_, text| text.into(), false, &scenario.signer);
    assert!(check(&again).is_ok());
}

#[test]
fn a_changed_action_breaks_the_chain_or_the_state() {
    let scenario = Scenario::new("pinch", 130);
    let bytes = scenario.record().bytes;
    // Even signed with the server's own key: the chain detects it.
    let refused = check(&rewritten(&bytes, &another_action, false, &scenario.signer)).expect_err("changed");
    assert_eq!(refused.name(), "chain_broken");
    assert!(refused.to_string().contains("tick 100"), "{refused}");
    // A new chain and another key: the key shows it to its owner, the simulation to everyone.
    let mallory = Signer::random().expect("key");
    let forged = rewritten(&bytes, &another_action, true, &mallory);
    let replay = read(&forged).expect("in itself sound");
    let refused = replay.signed_by(Some(&scenario.signer.public())).expect_err("another key");
    assert_eq!(refused.name(), "bad_signature");
    assert!(refused.to_string().contains(&mallory.public().to_string()), "{refused}");
    assert!(replay.signed_by(None).is_ok());
    let refused = verify(&replay, &[]).expect_err("another run");
    assert_eq!((refused.name(), refused.tick()), ("state_differs", Some(43)));
}

#[test]
fn files_with_the_state_every_hundred_ticks_are_read_too() {
    let scenario = Scenario::new("pinch", 130);
    let bytes = scenario.record().bytes;
    let less = |topic: &str, text: &str| {
        if topic != ACTION {
            return text.into();
        }
        let mut message: serde_json::Value = serde_json::from_str(text).expect("JSON");
        assert!(message.as_object_mut().expect("fields").remove("state").is_some());
        message.to_string()
    };
    let old = rewritten(&bytes, &less, true, &scenario.signer);
    assert_eq!(check(&old).expect("the same run").states, 3);
    let changed = move |topic: &str, text: &str| less(topic, &another_action(topic, text));
    let refused = check(&rewritten(&bytes, &changed, true, &scenario.signer)).expect_err("another run");
    assert_eq!((refused.name(), refused.tick()), ("state_differs", Some(100)));
    assert!(refused.to_string().contains("up to tick 0, and not recorded between"), "{refused}");
}

#[test]
fn a_changed_score_is_found_with_any_key() {
    let mut scenario = Scenario::new("pinch", 20);
    scenario.forge = |outcome| outcome.score += 1.0;
    let refused = check(&scenario.record().bytes).expect_err("forged");
    assert_eq!(refused.name(), "score_differs");
    scenario.forge = |outcome| outcome.events.clear();
    assert!(check(&scenario.record().bytes).is_ok(), "nothing happened in this run");
    scenario.forge = |outcome| outcome.ticks += 1;
    assert_eq!(check(&scenario.record().bytes).expect_err("forged").name(), "score_differs");
    scenario.forge = |outcome| outcome.state_hash = "0".repeat(16);
    assert_eq!(check(&scenario.record().bytes).expect_err("forged").name(), "state_differs");
    // Without the secret key: change, keep the signature.
    scenario.forge = |_| {};
    let better = |topic: &str, text: &str| {
        if topic == RESULT_RECORD { text.replace("\"score\":0.0", "\"score\":9.0") } else { text.into() }
    };
    let bytes = scenario.record().bytes;
    let forged = rewritten(&bytes, &better, false, &scenario.signer);
    assert_eq!(check(&forged).expect_err("changed").name(), "chain_broken");
    let mallory = Signer::random().expect("key");
    assert_eq!(
        check(&rewritten(&bytes, &better, true, &mallory)).expect_err("changed").name(),
        "score_differs"
    );
}

#[test]
fn an_action_that_cannot_have_been_applied_is_refused() {
    let scenario = Scenario::new("pinch", 60);
    let beyond = |topic: &str, text: &str| {
        if topic == ACTION && text.starts_with("{\"tick\":42,") {
            text.replace("\"hand\":[0.42", "\"hand\":[7.42")
        } else {
            text.into()
        }
    };
    let forged = rewritten(&scenario.record().bytes, &beyond, true, &scenario.signer);
    assert_eq!(check(&forged).expect_err("clipped").name(), "chain_broken");
}

#[test]
fn messages_must_be_complete_and_in_order() {
    let scenario = Scenario::new("pinch", 130);
    let bytes = scenario.record().bytes;
    let skip = |topic: &str, text: &str| {
        if topic == ACTION { text.replace("{\"tick\":42,", "{\"tick\":43,") } else { text.into() }
    };
    let later = |topic: &str, text: &str| {
        if topic == HASH { text.replace("\"tick\":100", "\"tick\":99") } else { text.into() }
    };
    let rubbish = |topic: &str, text: &str| {
        if topic == EVENT || topic == ACTION { "{}".into() } else { text.to_owned() }
    };
    for change in [&skip as &Change, &later, &rubbish] {
        let forged = rewritten(&bytes, change, true, &scenario.signer);
        assert_eq!(check(&forged).expect_err("changed").name(), "chain_broken");
    }
}

#[test]
fn what_the_bits_depend_on_must_be_the_same() {
    type Change = fn(&mut Header);
    let cases: [(&str, Change); 8] = [
        ("other_engine", |header| header.engine = "0.0.1+0000000000000000".into()),
        ("other_physics", |header| header.physics_hash = "0".repeat(64)),
        ("other_task", |header| header.task_hash = "0".repeat(64)),
        ("other_task", |header| header.task = "juggling".into()),
        ("other_hand", |header| header.hand_hash = "0".repeat(64)),
        ("other_hand", |header| header.hand = "claw".into()),
        ("other_hand", |header| header.hand = "reflex".into()),
        ("state_differs", |header| header.seed = Seed::from_u64(6)),
    ];
    for (name, change) in cases {
        let mut scenario = Scenario::new("pinch", 3);
        change(&mut scenario.header);
        let refused = check(&scenario.record().bytes).expect_err(name);
        assert_eq!(refused.name(), name, "{refused}");
    }
    let mut scenario = Scenario::new("pinch", 3);
    scenario.header.seed = Seed::from_u64(6);
    assert_eq!(check(&scenario.record().bytes).expect_err("another seed").tick(), Some(0));
}
