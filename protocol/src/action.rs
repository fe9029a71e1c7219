//! The action of a step, read by hand: its errors have a code of their own and name the entry.

use crate::code::{Code, Refusal};
use crate::request::kind_of;
use crate::text::shortened;
use palmares_tasks::{Action, BaseTarget};
use serde_json::{Map, Value};

fn bad(message: String) -> Refusal {
    Refusal::new(Code::BadAction, message)
}

/// Reads an action.
///
/// # Errors
/// `bad_action`, naming the entry and what would be right. Whether the length of `hand` fits the hand is for
/// the run to say.
pub(crate) fn parse_action(value: Value) -> Result<Action, Refusal> {
    let mut fields = object("action", value)?;
    let base = fields.remove("base").map(parse_base).transpose()?;
    let hand = match fields.remove("hand") {
        Some(Value::Array(entries)) => Some(numbers("action.hand", &entries)?),
        Some(other) => {
            return Err(bad(format!("action.hand: expected an array of numbers, not {}", kind_of(&other))));
        }
        None => None,
    };
    no_more("action", &fields, "base, hand")?;
    Ok(Action { base, hand })
}

fn parse_base(value: Value) -> Result<BaseTarget, Refusal> {
    let mut fields = object("action.base", value)?;
    let mut take = |name: &str| fields.remove(name);
    let (position, quat_xyzw) = (take("position"), take("quat_xyzw"));
    let (linear, angular) = (take("linear"), take("angular"));
    no_more("action.base", &fields, "position and quat_xyzw, or linear and angular")?;
    match (position, quat_xyzw, linear, angular) {
        (Some(position), Some(quat_xyzw), None, None) => Ok(BaseTarget::Pose {
            position: vector("action.base.position", &position)?,
            quat_xyzw: vector("action.base.quat_xyzw", &quat_xyzw)?,
        }),
        (None, None, Some(linear), Some(angular)) => Ok(BaseTarget::Twist {
            linear: vector("action.base.linear", &linear)?,
            angular: vector("action.base.angular", &angular)?,
        }),
        _ => Err(bad("action.base: expected {position, quat_xyzw} or {linear, angular}".into())),
    }
}

fn object(path: &str, value: Value) -> Result<Map<String, Value>, Refusal> {
    match value {
        Value::Object(fields) => Ok(fields),
        other => Err(bad(format!("{path}: expected an object, not {}", kind_of(&other)))),
    }
}

fn no_more(path: &str, fields: &Map<String, Value>, known: &str) -> Result<(), Refusal> {
    match fields.keys().next() {
        Some(name) => Err(bad(format!("{path}: unknown field `{}`; there are: {known}", shortened(name)))),
        None => Ok(()),
    }
}

fn numbers(path: &str, entries: &[Value]) -> Result<Vec<f64>, Refusal> {
    let number = |(i, entry): (usize, &Value)| match entry.as_f64() {
        Some(number) if number.is_finite() => Ok(number),
        _ => Err(bad(format!("{path}[{i}]: expected a finite number, not {}", kind_of(entry)))),
    };
    entries.iter().enumerate().map(number).collect()
}

fn vector<const N: usize>(path: &str, value: &Value) -> Result<[f64; N], Refusal> {
    let Value::Array(entries) = value else {
        return Err(bad(format!("{path}: expected an array of {N} numbers, not {}", kind_of(value))));
    };
    let numbers = numbers(path, entries)?;
    <[f64; N]>::try_from(numbers)
        .map_err(|numbers| bad(format!("{path}: expected {N} numbers, got {}", numbers.len())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn what_an_action_may_be() {
        for good in [
            json!({}),
            json!({"hand": [0.5]}),
            json!({"base": {"position": [0, 0, 1], "quat_xyzw": [0, 0, 0, 1]}}),
            json!({"base": {"linear": [0, 0, 1], "angular": [0, 0, 0.5]}, "hand": []}),
        ] {
            assert!(parse_action(good.clone()).is_ok(), "{good}");
        }
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (action, part) in [
            (json!(null), "action: expected an object, not null"),
            (json!({"hand": null}), "action.hand: expected an array"),
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
            let refusal = parse_action(action.clone()).expect_err("must be refused");
            assert_eq!(refusal.code, Code::BadAction);
            assert!(refusal.message.contains(part), "{action}: {}", refusal.message);
        }
    }
}
