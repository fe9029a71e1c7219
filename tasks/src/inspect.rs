//! Inspection of a hand for organizers: its figures, those of the built-in hands, the competition's limits, and overlaps at the
//! start.

use crate::overlap::Overlap;
use crate::run::reaches;
use crate::start::{may_overlap, overlaps};
use crate::task::Task;
use palmares_models::builtin::builtin_hands;
use palmares_models::hand::Hand;
use palmares_models::measure::{Bound, Figure, HandLimits, SPECS, Sources, Spec, number};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Maximum number of reported reasons.
const MAX_REASONS: usize = 12;

/// A figure of a hand with those of other hands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FigureRow {
    /// Name of the figure, also as a field of `[hand_limits]`.
    pub figure: String,
    /// Unit of the figure; empty for a count or a ratio.
    pub unit: String,
    /// Description of the figure.
    pub what: String,
    /// Value of the hand; absent if it has nothing of the kind.
    pub value: Option<f64>,
    /// File and element that it was found in.
    pub place: Option<String>,
    /// Values of the built-in hands, by their names.
    pub others: BTreeMap<String, f64>,
    /// The competition's limit; absent if there is none.
    pub limit: Option<f64>,
    /// `most` or `least`.
    pub bound: String,
    /// Whether the limit allows the value.
    pub allowed: bool,
    /// Whether the value is beyond those of all built-in hands.
    pub beyond_others: bool,
}

/// The figures of a hand, in a fixed order.
pub fn figures(hand: &Hand, sources: &Sources, limits: &HandLimits) -> Vec<FigureRow> {
    let own = hand.figures();
    let mut others: Vec<(&str, Vec<Figure>)> = Vec::new();
    for hand in builtin_hands() {
        let figures = hand.figures();
        let values = |figures: &[Figure]| figures.iter().map(|figure| figure.value).collect::<Vec<_>>();
        // A hand that differs in its skin only is not another one.
        if others.iter().all(|(_, known)| values(known) != values(&figures)) {
            others.push((&hand.name, figures));
        }
    }
    let find = |figures: &[Figure], name: &str| figures.iter().find(|f| f.spec.name == name).cloned();
    let row = |spec: &Spec| {
        let found = find(&own, spec.name);
        let others: BTreeMap<String, f64> = others
            .iter()
            .filter_map(|(name, figures)| Some(((*name).to_owned(), find(figures, spec.name)?.value)))
            .collect();
        let limit = limits.of(spec.name);
        let beyond = |value: f64| match spec.bound {
            Bound::Most => others.values().all(|other| value > *other),
            Bound::Least => others.values().all(|other| value < *other),
        };
        FigureRow {
            figure: spec.name.to_owned(),
            unit: spec.unit.to_owned(),
            what: spec.what.to_owned(),
            value: found.as_ref().map(|f| f.value),
            place: found.as_ref().map(|f| sources.location(f).to_string()),
            limit: limit.is_finite().then_some(limit),
            bound: match spec.bound {
                Bound::Most => "most".to_owned(),
                Bound::Least => "least".to_owned(),
            },
            allowed: found.as_ref().is_none_or(|f| limits.allows(f)),
            beyond_others: found.as_ref().is_some_and(|f| f.value != 0.0 && beyond(f.value)),
            others,
        }
    };
    SPECS.iter().map(row).collect()
}

impl FigureRow {
    /// One line about an unusual figure, with those of the built-in hands.
    pub fn in_words(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        let named = |(name, value): (&String, &f64)| format!("{} ({name})", number(*value));
        let least = self.others.iter().min_by(|a, b| a.1.total_cmp(b.1)).map(named);
        let most = self.others.iter().max_by(|a, b| a.1.total_cmp(b.1)).map(named);
        let others = match least.zip(most) {
            None => "no hand of the program has one".to_owned(),
            Some((least, most)) if least == most => least,
            Some((least, most)) => format!("{least} to {most}"),
        };
        let value = self.value.map_or("none".to_owned(), number);
        let place = self.place.as_deref().unwrap_or_default();
        format!("{place}: {} is {value}{unit} ({}; {others})", self.what, self.figure)
    }
}

/// The limits that a hand exceeds, as one text; None if it exceeds none.
pub fn beyond_limits(hand: &Hand, sources: &Sources, limits: &HandLimits) -> Vec<String> {
    limits.excesses(&hand.figures(), sources).iter().map(ToString::to_string).collect()
}

/// Overlaps of the hand at its start in each task, and errors of a hand that cannot be simulated or that the task's arm cannot bring there.
pub fn in_the_way(hand: &Arc<Hand>, tasks: &[Arc<Task>]) -> Vec<String> {
    let mut out = Vec::new();
    for task in tasks {
        match may_overlap(task, hand.clone()).and_then(|overlaps| reaches(task, hand).map(|()| overlaps)) {
            Ok(overlaps) => out.extend(overlaps.iter().map(|overlap| at_start(task, overlap))),
            Err(error) => out.push(error.to_string()),
        }
    }
    out
}

/// Why a hand can never be played in one of these tasks, whatever the seed: overlaps at its start, or an arm that does not reach
/// there.
pub fn never_fits(hand: &Arc<Hand>, tasks: &[Arc<Task>]) -> Vec<String> {
    let mut out = Vec::new();
    for task in tasks {
        match overlaps(task, hand.clone()).and_then(|overlaps| reaches(task, hand).map(|()| overlaps)) {
            Ok(overlaps) => out.extend(overlaps.iter().map(|overlap| at_start(task, overlap))),
            Err(error) => out.push(error.to_string()),
        }
    }
    out
}

fn at_start(task: &Task, overlap: &Overlap) -> String {
    format!("task `{}`: where the hand starts, {overlap}", task.name)
}

/// The first reasons as one text, and the number of further ones.
pub fn join_reasons(reasons: &[String]) -> String {
    let more = reasons.len().saturating_sub(MAX_REASONS);
    let mut text = reasons[..reasons.len() - more].join("\n");
    if more > 0 {
        text += &format!("\n... and {more} more");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn rows(change: impl FnOnce(&mut Hand)) -> Vec<FigureRow> {
        let mut hand = Hand::clone(&Hand::builtin("pinch").expect("it is built in"));
        change(&mut hand);
        figures(&hand, &Sources::of_urdf(Path::new("hand.urdf")), &HandLimits::default())
    }

    #[test]
    fn a_builtin_hand_is_within_the_range_of_all() {
        let rows = rows(|_| ());
        assert_eq!(rows.len(), SPECS.len());
        assert!(rows.iter().all(|row| row.allowed));
        assert_eq!(rows.iter().filter(|row| row.beyond_others).count(), 0);
    }

    #[test]
    fn an_unusual_figure_is_reported_with_place_and_other_hands() {
        let rows = rows(|hand| hand.links[2].geoms[0].friction = 2.4);
        let out: Vec<&FigureRow> = rows.iter().filter(|row| row.beyond_others).collect();
        let [row] = out.as_slice() else { panic!("{out:?}") };
        assert!(row.allowed);
        let text = row.in_words();
        assert!(text.contains("hand.urdf: link '") && text.contains("is 2.4 (friction; "), "{text}");
        assert!(text.contains("0.7 (robotiq_2f85) to 1.5 (reflex))"), "{text}");
    }
}
