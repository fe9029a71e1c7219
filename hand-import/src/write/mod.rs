//! Writes a completed draft: `hand.urdf`, `hand.toml`. Every decision is a comment at its place in one of them.

pub(crate) mod settings;
pub(crate) mod tendon_lines;
pub(crate) mod urdf;

use std::collections::BTreeSet;
use std::fmt::Write as _;

use crate::complete::Complete;
use crate::decision::{At, Decision, Log};

/// Hands out each decision once.
pub(crate) struct Comments<'a> {
    open: Vec<&'a Decision>,
}

impl<'a> Comments<'a> {
    /// Splits the decisions between `hand.urdf` and `hand.toml`, which has those without an element in the other.
    pub(crate) fn split(log: &'a Log, hand: &Complete) -> (Comments<'a>, Comments<'a>) {
        let links: BTreeSet<&str> = hand.draft.links.iter().map(|link| link.name.as_str()).collect();
        let joints: BTreeSet<&str> = hand.draft.joints.iter().map(|joint| joint.name.as_str()).collect();
        let tendons: BTreeSet<&str> = hand
            .tendons
            .iter()
            .filter(|tendon| tendon.motor_in_urdf().is_some())
            .map(|tendon| tendon.name.as_str())
            .collect();
        let in_urdf = |at: &At| match at {
            At::Link(name) => links.contains(name.as_str()),
            At::Joint(name) => joints.contains(name.as_str()),
            At::Tendon(name) => tendons.contains(name.as_str()),
            At::Hand | At::Motor(_) => false,
        };
        let (urdf, settings) = log.decisions.iter().partition(|decision| in_urdf(&decision.at));
        (Comments { open: urdf }, Comments { open: settings })
    }

    /// The decisions at a place.
    pub(crate) fn at(&mut self, at: &At) -> Vec<String> {
        let (here, rest) = self.open.iter().partition(|decision| decision.at == *at);
        self.open = rest;
        here.into_iter().map(line).collect()
    }

    /// The decisions whose place satisfies a condition.
    pub(crate) fn all(&mut self, wanted: impl Fn(&At) -> bool) -> Vec<String> {
        let (here, rest) = self.open.iter().partition(|decision| wanted(&decision.at));
        self.open = rest;
        here.into_iter().map(line).collect()
    }
}

/// A decision on one line.
fn line(decision: &Decision) -> String {
    let file = decision.file.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let text = format!("{}: {file}, {}: {}", decision.kind.word(), decision.element, decision.text);
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// A number in full, so that it is read back bit for bit.
pub(crate) fn number(x: f64) -> String {
    let mut text = String::new();
    // `{:?}` is the shortest text that gives the same number.
    let _ = write!(text, "{x:?}");
    text.strip_suffix(".0").map(str::to_owned).unwrap_or(text)
}
