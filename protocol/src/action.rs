//! Reads the action of a step; an error names the wrong value and the expected one.

use crate::text::shortened;
use palmares_tasks::{Action, BaseTarget};
use serde::de::{Deserialize, Deserializer, Error, Expected, IgnoredAny, MapAccess, SeqAccess, Visitor};
use std::fmt;
use std::marker::PhantomData;

/// An action. The run checks whether the lengths of `hand` and `effort` fit the hand.
pub(crate) struct ActionFields(pub(crate) Action);

impl<'de> Deserialize<'de> for ActionFields {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Entry::deserialize(deserializer).map(|Entry(action)| ActionFields(action))
    }
}

/// A value of an action: a number, a list or a map.
trait Shape<'de>: Sized {
    fn expected(f: &mut fmt::Formatter<'_>) -> fmt::Result;

    fn number(_: f64) -> Option<Self> {
        None
    }

    /// `None` if the value is not a list.
    fn list<A: SeqAccess<'de>>(_: A) -> Result<Option<Self>, A::Error> {
        Ok(None)
    }

    /// `None` if the value is not a map.
    fn map<A: MapAccess<'de>>(_: A) -> Result<Option<Self>, A::Error> {
        Ok(None)
    }
}

/// Reads a value of an action.
struct Entry<S>(S);

impl<'de, S: Shape<'de>> Deserialize<'de> for Entry<S> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Reader(PhantomData)).map(Entry)
    }
}

struct Reader<S>(PhantomData<S>);

impl<'de, S: Shape<'de>> Reader<S> {
    fn or_else<E: Error>(self, entry: Option<S>, kind: &str) -> Result<S, E> {
        entry.ok_or_else(|| E::custom(format_args!("expected {}, not {kind}", &self as &dyn Expected)))
    }
}

impl<'de, S: Shape<'de>> Visitor<'de> for Reader<S> {
    type Value = S;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        S::expected(f)
    }

    fn visit_unit<E: Error>(self) -> Result<S, E> {
        self.or_else(None, "null")
    }

    fn visit_bool<E: Error>(self, _: bool) -> Result<S, E> {
        self.or_else(None, "a boolean")
    }

    fn visit_str<E: Error>(self, _: &str) -> Result<S, E> {
        self.or_else(None, "a string")
    }

    fn visit_i64<E: Error>(self, x: i64) -> Result<S, E> {
        self.visit_f64(x as f64)
    }

    fn visit_u64<E: Error>(self, x: u64) -> Result<S, E> {
        self.visit_f64(x as f64)
    }

    fn visit_f64<E: Error>(self, x: f64) -> Result<S, E> {
        self.or_else(S::number(x), "a number")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<S, A::Error> {
        let entry = S::list(list)?;
        self.or_else(entry, "an array")
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<S, A::Error> {
        let entry = S::map(map)?;
        self.or_else(entry, "an object")
    }
}

impl<'de> Shape<'de> for f64 {
    fn expected(f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a finite number")
    }

    /// MessagePack has NaN.
    fn number(x: f64) -> Option<Self> {
        x.is_finite().then_some(x)
    }
}

impl<'de> Shape<'de> for Vec<f64> {
    fn expected(f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an array of numbers")
    }

    fn list<A: SeqAccess<'de>>(mut list: A) -> Result<Option<Self>, A::Error> {
        let mut numbers = Vec::new();
        while let Some(Entry(x)) = list.next_element()? {
            numbers.push(x);
        }
        Ok(Some(numbers))
    }
}

impl<'de, const N: usize> Shape<'de> for [f64; N] {
    fn expected(f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "an array of {N} numbers")
    }

    fn list<A: SeqAccess<'de>>(mut list: A) -> Result<Option<Self>, A::Error> {
        let (mut numbers, mut count) = ([0.0; N], 0);
        while let Some(Entry(x)) = list.next_element()? {
            if let Some(number) = numbers.get_mut(count) {
                *number = x;
            }
            count += 1;
        }
        if count == N {
            Ok(Some(numbers))
        } else {
            Err(A::Error::custom(format_args!("expected {N} numbers, got {count}")))
        }
    }
}

/// Refuses a map with an unknown field; `unknown`: the first one.
fn refuse_unknown<E: Error>(unknown: Option<String>, known: &str) -> Result<(), E> {
    match unknown {
        Some(name) => {
            Err(E::custom(format_args!("unknown field `{}`; there are: {known}", shortened(&name))))
        }
        None => Ok(()),
    }
}

impl<'de> Shape<'de> for Action {
    fn expected(f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object")
    }

    fn map<A: MapAccess<'de>>(mut map: A) -> Result<Option<Self>, A::Error> {
        let (mut base, mut hand, mut effort, mut unknown) = (None, None, None, None);
        while let Some(name) = map.next_key::<String>()? {
            match name.as_str() {
                "base" => base = Some(map.next_value::<Entry<_>>()?.0),
                "hand" => hand = Some(map.next_value::<Entry<_>>()?.0),
                "effort" => effort = Some(map.next_value::<Entry<_>>()?.0),
                _ => {
                    map.next_value::<IgnoredAny>()?;
                    unknown.get_or_insert(name);
                }
            }
        }
        refuse_unknown(unknown, "base, hand, effort")?;
        Ok(Some(Action { base, hand, effort }))
    }
}

impl<'de> Shape<'de> for BaseTarget {
    fn expected(f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object")
    }

    fn map<A: MapAccess<'de>>(mut map: A) -> Result<Option<Self>, A::Error> {
        let (mut position, mut quat_xyzw, mut linear, mut angular) = (None, None, None, None);
        let mut joints = None;
        let mut unknown = None;
        while let Some(name) = map.next_key::<String>()? {
            match name.as_str() {
                "position" => position = Some(map.next_value::<Entry<_>>()?.0),
                "quat_xyzw" => quat_xyzw = Some(map.next_value::<Entry<_>>()?.0),
                "linear" => linear = Some(map.next_value::<Entry<_>>()?.0),
                "joints" => joints = Some(map.next_value::<Entry<_>>()?.0),
                "angular" => angular = Some(map.next_value::<Entry<_>>()?.0),
                _ => {
                    map.next_value::<IgnoredAny>()?;
                    unknown.get_or_insert(name);
                }
            }
        }
        refuse_unknown(unknown, "position and quat_xyzw, or linear and angular, or joints")?;
        match (position, quat_xyzw, linear, angular, joints) {
            (Some(position), Some(quat_xyzw), None, None, None) => {
                Ok(Some(BaseTarget::Pose { position, quat_xyzw }))
            }
            (None, None, None, None, Some(joints)) => Ok(Some(BaseTarget::Joints { joints })),
            (None, None, Some(linear), Some(angular), None) => {
                Ok(Some(BaseTarget::Twist { linear, angular }))
            }
            _ => Err(A::Error::custom("expected {position, quat_xyzw}, {linear, angular} or {joints}")),
        }
    }
}
