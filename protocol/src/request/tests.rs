//! What is refused, and how it is said.

use super::*;

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
