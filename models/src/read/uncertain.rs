//! `[uncertain]` of `hand.toml`: numbers of the hand that are known as ranges.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::report::Report;
use crate::error::ModelError;
use crate::hand::tendon::MAX_EXPONENT;
use crate::hand::uncertain::{HandQuantity, Owner, Range, Uncertain};
use crate::hand::{Guide, Hand};

/// An entry.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct UncertainSettings {
    /// The quantity, if the entry does not have its name.
    of: Option<HandQuantity>,
    /// Range of a factor of the hand's own numbers.
    #[serde(default, deserialize_with = "crate::exact::optional")]
    factor: Option<[f64; 2]>,
    /// Range of the number itself.
    #[serde(default, deserialize_with = "crate::exact::optional")]
    value: Option<[f64; 2]>,
    /// Names of the parts that have the quantity, if not all of them have it.
    links: Option<Vec<String>>,
    joints: Option<Vec<String>>,
    motors: Option<Vec<String>>,
    tendons: Option<Vec<String>>,
}

/// Factors are from `1 / MOST_FACTOR` to `MOST_FACTOR`.
const MOST_FACTOR: f64 = 10.0;
/// Learners name entries as `hand_NAME`, and `hand_pose` is another thing.
const RESERVED: &str = "pose";
const MOST_ENTRIES: usize = 32;

/// The uncertain numbers of a hand, by name; those with a problem, which is kept, are left out.
pub(crate) fn uncertain(
    settings: &BTreeMap<String, UncertainSettings>,
    hand: &Hand,
    largest: f64,
    at: &Report,
) -> Vec<Uncertain> {
    at.keep(at.limit("[uncertain]", "entries", settings.len(), MOST_ENTRIES));
    let mut out: Vec<Uncertain> = Vec::new();
    for (name, own) in settings {
        let found = entry(name, own, hand, largest, at).and_then(|found| {
            let twice =
                |other: &&Uncertain| other.of == found.of && other.on.iter().any(|k| found.on.contains(k));
            match out.iter().find(twice) {
                None => Ok(found),
                Some(other) => Err(at.bad(
                    format!("[uncertain] {name}"),
                    format!("has the {} that '{}' has", found.of.name(), other.name),
                    format!("`{}` without those of '{}'", found.of.owner().field(), other.name),
                )),
            }
        });
        out.extend(at.keep(found));
    }
    out
}

fn entry(
    name: &str,
    own: &UncertainSettings,
    hand: &Hand,
    largest: f64,
    at: &Report,
) -> Result<Uncertain, ModelError> {
    let bad = |problem: String, valid: String| Err(at.bad(format!("[uncertain] {name}"), problem, valid));
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    if name == RESERVED || name.is_empty() || name.len() > 32 || !name.chars().all(plain) {
        let valid = format!("1 to 32 of a to z, 0 to 9 and _, but not '{RESERVED}'");
        return bad("has a name that is not valid".to_owned(), valid);
    }
    let known = || HandQuantity::ALL.iter().map(|of| of.name()).collect::<Vec<_>>().join(", ");
    let Some(of) = own.of.or_else(|| HandQuantity::ALL.iter().copied().find(|of| of.name() == name)) else {
        return bad("does not say of what".to_owned(), format!("`of` with one of: {}", known()));
    };
    let (on, everywhere) = members(name, own, of, hand, at)?;
    let range = range(name, own, of, largest, at)?;
    if of == HandQuantity::TendonFriction {
        let high = range.ends()[1];
        let exponent = |guide: &Guide| guide.wrap_angle * range.applied(high, guide.friction);
        let sum = |k: &usize| hand.tendons[*k].rubbing().map(|(guide, _)| exponent(guide)).sum::<f64>();
        let most = on.iter().map(sum).fold(0.0, f64::max);
        if most > MAX_EXPONENT {
            let problem = format!("lets friction times wrap angle along a tendon sum up to {most}");
            return bad(problem, format!("at most {MAX_EXPONENT}"));
        }
    }
    Ok(Uncertain { name: name.to_owned(), of, on, everywhere, range })
}

/// Indices of the parts that have the quantity, and whether these are all.
fn members(
    name: &str,
    own: &UncertainSettings,
    of: HandQuantity,
    hand: &Hand,
    at: &Report,
) -> Result<(Vec<usize>, bool), ModelError> {
    let bad = |problem: String, valid: String| Err(at.bad(format!("[uncertain] {name}"), problem, valid));
    let owner = of.owner();
    let given = [
        (Owner::Link, &own.links),
        (Owner::Joint, &own.joints),
        (Owner::Motor, &own.motors),
        (Owner::Tendon, &own.tendons),
    ];
    if let Some((other, _)) = given.iter().find(|(kind, list)| list.is_some() && *kind != owner) {
        let problem = format!("has `{}`, and {} is of {}", other.field(), of.name(), owner.field());
        return bad(problem, format!("`{}`", owner.field()));
    }
    let all = of.all_of(hand);
    if all.is_empty() {
        return bad(format!("is of {}, and the hand has none", of.name()), "another quantity".to_owned());
    }
    let Some(list) = given.into_iter().find_map(|(_, list)| list.as_ref()) else { return Ok((all, true)) };
    let names = hand.names_of(owner);
    let mut on = Vec::new();
    for wanted in list {
        match all.iter().find(|k| names[**k] == wanted) {
            Some(k) if !on.contains(k) => on.push(*k),
            _ => {
                let known: Vec<&str> = all.iter().map(|k| names[*k]).collect();
                let problem = format!("names '{wanted}', which has no {}, or twice", of.name());
                return bad(problem, format!("each once, of: {}", known.join(", ")));
            }
        }
    }
    if on.is_empty() {
        return bad(format!("has an empty list of {}", owner.field()), "at least one name".to_owned());
    }
    on.sort_unstable();
    let everywhere = on.len() == all.len();
    Ok((on, everywhere))
}

fn range(
    name: &str,
    own: &UncertainSettings,
    of: HandQuantity,
    largest: f64,
    at: &Report,
) -> Result<Range, ModelError> {
    let bad = |problem: String, valid: String| Err(at.bad(format!("[uncertain] {name}"), problem, valid));
    match (own.factor, own.value) {
        (Some([low, high]), None) => {
            let sound = (1.0 / MOST_FACTOR..=1.0).contains(&low) && (1.0..=MOST_FACTOR).contains(&high);
            if !sound || low == high {
                let valid = format!(
                    "[low, high] with low from {} to 1, high from 1 to {MOST_FACTOR}: the hand's own number is within its range",
                    1.0 / MOST_FACTOR
                );
                return bad(format!("has factor [{low}, {high}]"), valid);
            }
            Ok(Range::Factor([low, high]))
        }
        (None, Some([low, high])) => {
            let Some(bounds) = of.value() else {
                let problem = "has `value`, and arms differ from joint to joint".to_owned();
                return bad(problem, "`factor`".to_owned());
            };
            if !(bounds.allows(low) && low < high && high <= largest) {
                let valid = format!(
                    "[low, high], ascending, not negative and at most {largest:e}; a tendon's or motor's above 0"
                );
                return bad(format!("has value [{low}, {high}]"), valid);
            }
            Ok(Range::Value([low, high]))
        }
        _ => bad("has not one range".to_owned(), "`factor` or `value`, with [low, high]".to_owned()),
    }
}
