//! Refused messages, and their error texts.

use super::*;
use crate::request::ClientInfo;
use serde_json::json;

fn refusal(text: &str) -> (Option<u64>, Code, String) {
    let parsed = parse_json(text);
    match parsed.request {
        Ok(request) => panic!("accepted: {request:?}"),
        Err(refusal) => (parsed.id, refusal.code, refusal.message),
    }
}

#[test]
fn shape_errors_name_the_field() {
    let (id, code, message) = refusal(r#"{"op":"step","id":7,"tick":"x","action":{}}"#);
    assert_eq!((id, code), (Some(7), Code::BadRequest));
    assert!(message.starts_with("tick: "), "{message}");

    let (_, code, message) = refusal(r#"{"op":"reset","id":7,"task":"balls","hand":"h","mode":"slow"}"#);
    assert_eq!(code, Code::BadRequest);
    assert!(message.contains("mode: ") && message.contains("lockstep"), "{message}");

    let (_, _, message) = refusal(r#"{"op":"reset","id":7,"task":"balls"}"#);
    assert!(message.contains("`hand`"), "{message}");

    let (_, _, message) = refusal(r#"{"op":"stop","id":7,"why":1}"#);
    assert!(message.contains("`why`"), "{message}");

    let (_, _, message) = refusal(r#"{"op":"hello","id":7,"client":3}"#);
    assert!(message.contains("client: ") && message.contains("name"), "{message}");
}

#[test]
fn what_is_not_json_is_bad_json() {
    for text in ["", "{", "nonsense", r#"{"op":"step","id":1,"tick":NaN}"#, r#"{"a":1e999}"#, "{} {}"] {
        assert_eq!(refusal(text).1, Code::BadJson, "{text}");
    }
    let deep = "[".repeat(100_000);
    assert_eq!(refusal(&deep).1, Code::BadJson);
}

#[test]
fn an_id_is_a_safe_whole_number() {
    for id in ["-1", "1.5", "\"1\"", "null", "9007199254740992"] {
        let (echoed, code, message) = refusal(&format!(r#"{{"op":"time","id":{id}}}"#));
        assert_eq!((echoed, code), (None, Code::BadRequest), "{id}");
        assert!(message.starts_with("id: "), "{message}");
    }
    assert!(parse_json(r#"{"op":"time","id":9007199254740991}"#).request.is_ok());
}

#[test]
fn a_push_has_a_link_a_wrench_and_a_duration() {
    let parsed =
        parse_json(r#"{"op":"perturb","id":1,"link":"palm","wrench":{"force":[0,0,-5]},"duration_s":0.5}"#);
    assert!(matches!(parsed.request, Ok(Request::Perturb(push)) if push.wrench.torque == [0.0; 3]));
    let (_, code, message) =
        refusal(r#"{"op":"perturb","id":1,"link":"palm","wrench":{"force":[0,0]},"duration_s":0.5}"#);
    assert_eq!(code, Code::BadRequest);
    assert!(message.starts_with("wrench.force"), "{message}");
}

#[test]
fn a_version_may_follow_a_name() {
    let client = |text: &str| ClientInfo::Short(text.to_owned());
    assert_eq!(client("team/1.2").parts(), ("team", Some("1.2")));
    assert_eq!(client("either/or").parts(), ("either/or", None));
    assert_eq!(client("/1").parts(), ("", Some("1")));
}

#[test]
fn what_is_quoted_cannot_steer_who_reads_it() {
    let (_, _, message) = refusal("{\"op\":\"\u{202e}pets\\u001b[2J\",\"id\":7}");
    assert!(message.contains("`\\u{202E}pets\\u{001B}[2J`"), "{message}");
}

#[test]
fn what_an_action_may_be() {
    for good in [
        json!({}),
        json!({"hand": [0.5]}),
        json!({"hand": [0.5], "effort": [0.2]}),
        json!({"base": {"position": [0, 0, 1], "quat_xyzw": [0, 0, 0, 1]}}),
        json!({"base": {"linear": [0, 0, 1], "angular": [0, 0, 0.5]}, "hand": []}),
    ] {
        assert!(parse_action(Some(good.clone())).is_ok(), "{good}");
    }
}

#[test]
fn what_is_wrong_is_named() {
    for (action, part) in [
        (json!(null), "action: expected an object, not null"),
        (json!({"hand": null}), "action.hand: expected an array"),
        (json!({"effort": null}), "action.effort: expected an array"),
        (json!({"hand": [0.5, null]}), "action.hand[1]: expected a finite number, not null"),
        (json!({"hand": ["NaN"]}), "action.hand[0]: expected a finite number, not a string"),
        (json!({"fingers": 1}), "unknown field `fingers`"),
        (json!({"base": {"position": [0, 0, 1]}}), "expected {position, quat_xyzw}"),
        (
            json!({"base": {"position": [0, 0], "quat_xyzw": [0, 0, 0, 1]}}),
            "position: expected 3 numbers, got 2",
        ),
        (
            json!({"base": {"position": [0, 0, 0], "quat_xyzw": [0, 0, 0, 1], "linear": [0, 0, 0]}}),
            "action.base",
        ),
    ] {
        let refusal = parse_action(Some(action.clone())).expect_err("must be refused");
        assert_eq!(refusal.code, Code::BadAction);
        assert!(refusal.message.contains(part), "{action}: {}", refusal.message);
    }
}

/// Reads a message straight and through a tree, in both encodings; only what is wrong fails to be read straight.
fn same(message: &Value) -> bool {
    let text = message.to_string();
    let packed = rmp_serde::to_vec_named(message).expect("packs");
    let tree = of_tree(message.clone());
    for (straight, tree) in [
        (json(&text), of_tree(serde_json::from_str(&text).expect("JSON"))),
        (msgpack(&packed), of_tree(value_of_msgpack(&packed).expect("MessagePack"))),
    ] {
        if let Some((id, request)) = &straight {
            let expected = tree.request.as_ref().expect("a tree gives it too");
            assert_eq!((Some(*id), format!("{request:?}")), (tree.id, format!("{expected:?}")), "{text}");
        }
    }
    assert_eq!(json(&text).is_some(), msgpack(&packed).is_some(), "{text}");
    let hot = matches!(tree.request, Ok(Request::Step(_) | Request::Act(_)));
    assert_eq!(json(&text).is_some(), hot, "{text}");
    hot
}

#[test]
fn what_is_read_straight_is_read_through_a_tree_too() {
    let pose = json!({"position": [0, 0.1, -1e-7], "quat_xyzw": [0, 0, 0, 1]});
    for (message, hot) in [
        (json!({"op": "step", "id": 1, "tick": 0, "action": {}}), true),
        (json!({"op": "step", "id": 1, "tick": 0, "repeat": 3, "action": {"hand": [0.1, 1]}}), true),
        (json!({"op": "step", "id": 1, "tick": 0, "action": {"base": pose}}), true),
        (
            json!({"op": "act", "id": 1, "action": {"base": {"linear": [0, 0, 0], "angular": [1, 2, 3]}}}),
            true,
        ),
        (json!({"op": "act", "id": 1, "tick": 4, "action": {}}), false),
        (json!({"op": "act", "id": 1, "action": []}), false),
        (json!({"op": "act", "id": 1, "action": null}), false),
        (json!({"op": "act", "id": 1, "action": {"base": null}}), false),
        (json!({"op": "act", "id": 1, "action": {"base": [[0, 0, 0], [0, 0, 0, 1]]}}), false),
        (json!({"op": "step", "id": 1, "tick": 0, "action": {"hand": null}}), false),
        (json!({"op": "step", "id": 1, "tick": 0, "repeat": null, "action": {}}), false),
        (json!({"op": "step", "id": 1, "tick": null, "action": {}}), false),
        (json!({"op": "step", "id": 1, "tick": 0.0, "action": {}}), false),
        (json!({"op": "step", "id": -1, "tick": 0, "action": {}}), false),
        (json!({"op": "step", "id": MAX_SAFE_INTEGER + 1, "tick": 0, "action": {}}), false),
        (json!({"op": "step", "id": 1, "tick": 0, "action": {"hand": ["1"]}}), false),
        (json!({"op": "step", "id": 1, "tick": 0, "action": {"base": {"position": [0, 0, 0]}}}), false),
        (
            json!({"op": "step", "id": 1, "tick": 0, "action":
                {"base": {"position": [0, 0, 0, 0], "quat_xyzw": [0, 0, 0, 1]}}}),
            false,
        ),
        (json!({"op": "step", "id": 1, "tick": 0, "action": {}, "more": 1}), false),
        (json!({"op": "time", "id": 1}), false),
        (json!(["step", 1, 0, 1, {}]), false),
    ] {
        assert_eq!(same(&message), hot, "{message}");
    }
}

#[test]
fn what_is_not_finite_is_refused_through_a_tree() {
    for x in [f64::NAN, f64::INFINITY] {
        let action = std::collections::BTreeMap::from([("hand", vec![x])]);
        #[derive(serde::Serialize)]
        struct Raw<T> {
            op: &'static str,
            id: u64,
            action: T,
        }
        let packed = rmp_serde::to_vec_named(&Raw { op: "act", id: 1, action }).expect("packs");
        assert!(msgpack(&packed).is_none());
        let refusal = of_tree(value_of_msgpack(&packed).expect("reads")).request.expect_err("refused");
        assert!(refusal.message.contains("action.hand[0]: expected a finite number"), "{}", refusal.message);
    }
}

proptest::proptest! {
    #[test]
    fn numbers_come_through_to_the_bit(hand in proptest::collection::vec(proptest::num::f64::NORMAL, 0..5)) {
        let message = json!({"op": "act", "id": 3, "action": {"hand": hand}});
        assert!(same(&message));
        let Some((_, Request::Act(act))) = json(&message.to_string()) else { panic!("an act") };
        assert_eq!(act.action.hand, Some(hand));
    }
}

#[test]
fn a_frame_of_the_other_kind_is_refused() {
    let text = |encoding: Encoding| encoding.read_text(r#"{"op":"time","id":1}"#);
    let binary = |encoding: Encoding| encoding.read_binary(&packed());
    for (good, bad) in
        [(text(Encoding::Json), binary(Encoding::Json)), (binary(Encoding::MsgPack), text(Encoding::MsgPack))]
    {
        assert_eq!(good.id, Some(1));
        assert!(matches!(good.request, Ok(Request::Time(_))));
        let refusal = bad.request.expect_err("refused");
        assert_eq!(refusal.code, Code::BadJson);
        assert!(refusal.message.contains("frames only"), "{}", refusal.message);
    }
}

#[test]
fn what_is_not_messagepack_is_bad_json() {
    let deep = [vec![0x91; 2000], vec![0xc0]].concat();
    let more = [packed(), vec![0]].concat();
    for bytes in [&[][..], &[0xc1], &[0x82, 0xa2], &[0xdf, 0xff, 0xff, 0xff, 0xff], &deep, &more] {
        let parsed = Encoding::MsgPack.read_binary(bytes);
        assert_eq!(parsed.request.expect_err("refused").code, Code::BadJson, "{bytes:?}");
    }
}

fn packed() -> Vec<u8> {
    rmp_serde::to_vec_named(&serde_json::json!({"op": "time", "id": 1})).expect("packs")
}
