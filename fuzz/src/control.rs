//! The frames of controllers, in both encodings. A message that both encodings can express gives the same request or the same
//! error in both.

use crate::parts::Seeds;
use palmares_protocol::encoding::Payload;
use palmares_protocol::{Encoding, Parsed, Reply};
use serde_json::{Value, json};

pub(crate) fn run(data: &[u8]) -> bool {
    let packed = Encoding::MsgPack.read_binary(data);
    check(&packed);
    if let Some(value) = of_msgpack(data)
        && let Ok(text) = serde_json::to_string(&value)
    {
        same(&packed, &Encoding::Json.read_text(&text), &value);
    }
    let Ok(text) = std::str::from_utf8(data) else { return packed.request.is_ok() };
    let read = Encoding::Json.read_text(text);
    check(&read);
    if let Ok(value) = serde_json::from_str::<Value>(text)
        && let Ok(bytes) = rmp_serde::to_vec(&value)
    {
        same(&read, &Encoding::MsgPack.read_binary(&bytes), &value);
        let again = serde_json::to_string(&value).expect("a value is JSON");
        same(&read, &Encoding::Json.read_text(&again), &value);
    }
    packed.request.is_ok() || read.request.is_ok()
}

/// The value of a whole message in MessagePack, if JSON can express it. Deeper ones than the readers allow are left out.
fn of_msgpack(data: &[u8]) -> Option<Value> {
    let mut reader = rmp_serde::Deserializer::from_read_ref(data);
    reader.set_max_depth(DEPTH);
    let value = serde::Deserialize::deserialize(&mut reader).ok()?;
    reader.get_ref().is_empty().then_some(value)
}

/// Depth up to which both encodings take a message.
const DEPTH: usize = 100;

fn depth(value: &Value) -> usize {
    match value {
        Value::Array(list) => 1 + list.iter().map(depth).max().unwrap_or(0),
        Value::Object(map) => 1 + map.values().map(depth).max().unwrap_or(0),
        _ => 1,
    }
}

fn same(one: &Parsed, other: &Parsed, value: &Value) {
    if depth(value) >= DEPTH {
        return;
    }
    assert_eq!(one.id, other.id, "{value}");
    match (&one.request, &other.request) {
        (Ok(one), Ok(other)) => assert_eq!(format!("{one:?}"), format!("{other:?}"), "{value}"),
        (Err(one), Err(other)) => assert_eq!(one.code, other.code, "{value}: {one:?}, {other:?}"),
        _ => panic!("{value}: {:?}, {:?}", one.request, other.request),
    }
}

/// The error of a refused message can be written in both encodings, with the same content and within bounds.
fn check(parsed: &Parsed) {
    let Err(refusal) = &parsed.request else { return };
    let reply = Reply::refused(parsed.id, refusal);
    let Ok(Payload::Text(text)) = Encoding::Json.write(&reply, 0) else { panic!("{refusal:?}") };
    let Ok(Payload::Binary(bytes)) = Encoding::MsgPack.write(&reply, 0) else { panic!("{refusal:?}") };
    let text_value: Value = serde_json::from_str(&text).expect("the server writes JSON");
    let packed_value: Value = rmp_serde::from_slice(&bytes).expect("the server writes MessagePack");
    assert_eq!(text_value, packed_value);
}

pub(crate) fn seeds() -> Seeds {
    let pose = json!({"position": [0.0, 0.25, -0.5], "quat_xyzw": [0.0, 1.0, 0.0, 1e-3]});
    let twist = json!({"linear": [0.1, 0, -1], "angular": [1e-300, 2, 3e2]});
    let messages = [
        json!({"op": "hello", "id": 1, "client": "crabs/1.0"}),
        json!({"op": "hello", "id": 1, "client": {"name": "crabs", "version": "1"}, "resume_token": "ab", "session_s": 60.5}),
        json!({"op": "reset", "id": 2, "task": "balls", "hand": "softhand", "mode": "realtime", "sensing": "sensors",
               "noise": "real", "seed": 7, "cameras": ["top", "palm.rgb"], "options": {}}),
        json!({"op": "step", "id": 3, "tick": 0, "action": {"base": pose, "hand": [0.5, 1]}, "repeat": 4, "cameras": ["a"]}),
        json!({"op": "step", "id": 4, "tick": 4, "action": {}}),
        json!({"op": "act", "id": 9007199254740991_u64, "action": {"base": twist}}),
        json!({"op": "perturb", "id": 5, "link": "palm", "wrench": {"force": [1, 2, 3], "torque": [0, 0, 0.1]}, "duration_s": 0.1}),
        json!({"op": "stop", "id": 6}),
        json!({"op": "time", "id": 7}),
        json!({"op": "bye", "id": 8}),
    ];
    let mut seeds = Seeds::new();
    for (k, message) in messages.iter().enumerate() {
        let op = message["op"].as_str().unwrap_or_default();
        seeds.push((format!("{k}_{op}.json"), message.to_string().into_bytes()));
        seeds.push((format!("{k}_{op}.msgpack"), rmp_serde::to_vec(message).expect("a value")));
    }
    seeds
}
