//! The short way in for `step` and `act`, which come hundreds of times a second: straight into their structs.
//!
//! It takes only what the long way takes too, and to the same bits; whatever else comes gives none, and the long way
//! says what is wrong with it.

use crate::MAX_SAFE_INTEGER;
use crate::request::{Act, Request, Step, one};
use palmares_tasks::{Action, BaseTarget};
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, Error, IgnoredAny, MapAccess, Visitor};
use serde::{Deserialize, de::DeserializeOwned};
use std::fmt;
use std::io::ErrorKind;
use std::marker::PhantomData;

/// A struct that must stand as a map: derived readers take lists as well.
#[derive(Debug)]
struct Map<T>(T);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Map<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Fields<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Fields<T> {
            type Value = T;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a map")
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<T, A::Error> {
                T::deserialize(MapAccessDeserializer::new(map))
            }
        }
        deserializer.deserialize_map(Fields(PhantomData)).map(Map)
    }
}

/// A field that may be left out but not be null.
fn present<'de, D: Deserializer<'de>, T: DeserializeOwned>(deserializer: D) -> Result<Option<T>, D::Error> {
    T::deserialize(deserializer).map(Some)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Message<'a> {
    op: &'a str,
    id: u64,
    #[serde(default, deserialize_with = "present")]
    tick: Option<u64>,
    #[serde(default, deserialize_with = "present")]
    repeat: Option<u32>,
    action: Map<Targets>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Targets {
    #[serde(default, deserialize_with = "present")]
    base: Option<Map<Base>>,
    #[serde(default, deserialize_with = "present")]
    hand: Option<Vec<Finite>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Base {
    #[serde(default, deserialize_with = "present")]
    position: Option<Vec<Finite>>,
    #[serde(default, deserialize_with = "present")]
    quat_xyzw: Option<Vec<Finite>>,
    #[serde(default, deserialize_with = "present")]
    linear: Option<Vec<Finite>>,
    #[serde(default, deserialize_with = "present")]
    angular: Option<Vec<Finite>>,
}

/// MessagePack can say NaN.
#[derive(Clone, Copy)]
struct Finite(f64);

impl<'de> Deserialize<'de> for Finite {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let x = f64::deserialize(deserializer)?;
        if x.is_finite() { Ok(Finite(x)) } else { Err(D::Error::custom("not finite")) }
    }
}

fn fixed<const N: usize>(entries: Vec<Finite>) -> Option<[f64; N]> {
    let entries: [Finite; N] = entries.try_into().ok()?;
    Some(entries.map(|Finite(x)| x))
}

impl Targets {
    fn action(self) -> Option<Action> {
        let base = match self.base {
            Some(Map(Base {
                position: Some(position),
                quat_xyzw: Some(quat),
                linear: None,
                angular: None,
            })) => Some(BaseTarget::Pose { position: fixed(position)?, quat_xyzw: fixed(quat)? }),
            Some(Map(Base { position: None, quat_xyzw: None, linear: Some(v), angular: Some(w) })) => {
                Some(BaseTarget::Twist { linear: fixed(v)?, angular: fixed(w)? })
            }
            Some(_) => return None,
            None => None,
        };
        let hand = self.hand.map(|entries| entries.into_iter().map(|Finite(x)| x).collect());
        Some(Action { base, hand })
    }
}

impl Message<'_> {
    fn request(self) -> Option<(u64, Request)> {
        if self.id > MAX_SAFE_INTEGER {
            return None;
        }
        let action = self.action.0.action()?;
        let request = match (self.op, self.tick, self.repeat) {
            ("step", Some(tick), repeat) => {
                Request::Step(Step { tick, action, repeat: repeat.unwrap_or_else(one) })
            }
            ("act", None, None) => Request::Act(Act { action }),
            _ => return None,
        };
        Some((self.id, request))
    }
}

/// A `step` or `act` in JSON and its id.
pub(crate) fn json(text: &str) -> Option<(u64, Request)> {
    serde_json::from_str::<Map<Message<'_>>>(text).ok()?.0.request()
}

/// A `step` or `act` in MessagePack and its id.
pub(crate) fn msgpack(bytes: &[u8]) -> Option<(u64, Request)> {
    let mut reader = rmp_serde::Deserializer::from_read_ref(bytes);
    let message = Map::<Message<'_>>::deserialize(&mut reader).ok()?.0;
    match IgnoredAny::deserialize(&mut reader) {
        // Nothing after the message.
        Err(rmp_serde::decode::Error::InvalidMarkerRead(end)) if end.kind() == ErrorKind::UnexpectedEof => {
            message.request()
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::super::request::{parse_long, value_of_msgpack};
    use super::*;
    use serde_json::{Value, json};

    /// Both ways, in both encodings; the short one may decline.
    fn same(message: &Value) -> bool {
        let text = message.to_string();
        let packed = rmp_serde::to_vec_named(message).expect("packs");
        let long = parse_long(message.clone());
        for (fast, long) in [
            (json(&text), parse_long(serde_json::from_str(&text).expect("JSON"))),
            (msgpack(&packed), parse_long(value_of_msgpack(&packed).expect("MessagePack"))),
        ] {
            if let Some((id, request)) = &fast {
                let expected = long.request.as_ref().expect("the long way takes it too");
                assert_eq!((Some(*id), format!("{request:?}")), (long.id, format!("{expected:?}")), "{text}");
            }
        }
        assert_eq!(json(&text).is_some(), msgpack(&packed).is_some(), "{text}");
        let hot = matches!(long.request, Ok(Request::Step(_) | Request::Act(_)));
        assert_eq!(json(&text).is_some(), hot, "{text}");
        hot
    }

    #[test]
    fn the_short_way_is_the_long_way() {
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
    fn what_is_not_finite_is_left_to_the_long_way() {
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
            let refusal = parse_long(value_of_msgpack(&packed).expect("reads")).request.expect_err("refused");
            assert!(
                refusal.message.contains("action.hand[0]: expected a finite number"),
                "{}",
                refusal.message
            );
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
}
