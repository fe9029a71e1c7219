//! Plays that are known: the result of a search is their file, from which another one goes on.

use super::score::{End, Outcome, Score};
use super::table::{Found, Set};
use anyhow::{Context, Result, ensure};
use std::collections::BTreeMap;

/// A play of a scene: its step, µs, and its place among the starts or grasps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct At {
    pub step_us: u32,
    pub number: usize,
}

/// An overlap in mm as it is kept, so that a kept one decides as a fresh one.
pub(super) fn rounded(overlap_mm: f64) -> f64 {
    (100.0 * overlap_mm).round() / 100.0
}

/// The plays of each set, by its name.
pub(super) type Sets = BTreeMap<String, BTreeMap<At, Outcome>>;

/// `1:0s2.91 2:0u`: of each play its step in ms, place, letter of its end, and overlap in mm.
fn written(plays: &BTreeMap<At, Outcome>) -> String {
    let one = |(at, outcome): (&At, &Outcome)| {
        let overlap = outcome.overlap_mm.map_or(String::new(), |mm| mm.to_string());
        format!("{}:{}{}{overlap}", 1e-3 * f64::from(at.step_us), at.number, outcome.end.letter())
    };
    plays.iter().map(one).collect::<Vec<_>>().join(" ")
}

fn read(text: &str) -> Option<BTreeMap<At, Outcome>> {
    let one = |play: &str| {
        let (step_ms, rest) = play.split_once(':')?;
        let letter = rest.find(|c: char| c.is_ascii_lowercase())?;
        let end = End::of_letter(rest[letter..].chars().next()?)?;
        let overlap_mm = match &rest[letter + 1..] {
            "" => None,
            mm => Some(mm.parse().ok()?),
        };
        let step_us = (1e3 * step_ms.parse::<f64>().ok()?).round() as u32;
        Some((At { step_us, number: rest[..letter].parse().ok()? }, Outcome { end, overlap_mm }))
    };
    text.split_whitespace().map(one).collect()
}

/// The plays of a result.
///
/// # Errors
/// One that cannot be read.
pub(super) fn sets_of(found: &Found) -> Result<Sets> {
    let one = |set: &Set| {
        let plays = read(&set.plays).with_context(|| format!("the plays of `{}`", set.settings))?;
        let outcomes: Vec<Outcome> = plays.values().copied().collect();
        ensure!(
            Score::of(&outcomes).solved == set.solved,
            "`{}` counts other plays than it has",
            set.settings
        );
        Ok((set.settings.clone(), plays))
    };
    found.sets.iter().map(one).collect()
}

/// The sets of a result, those with more plays first, then the better ones.
pub(super) fn ranked(sets: &Sets) -> Vec<Set> {
    let score = |plays: &BTreeMap<At, Outcome>| Score::of(&plays.values().copied().collect::<Vec<_>>());
    let mut all: Vec<_> = sets.iter().map(|(name, plays)| (name, plays, score(plays))).collect();
    all.sort_by(|a, b| b.1.len().cmp(&a.1.len()).then(a.2.order(&b.2)));
    let set = |(name, plays, score): (&String, &BTreeMap<At, Outcome>, Score)| {
        let Score { solved, of, unfinished, .. } = score;
        Set { settings: name.clone(), solved, of, unfinished, plays: written(plays) }
    };
    all.into_iter().map(set).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plays_are_read_as_they_were_written() {
        let at = |step_us, number| At { step_us, number };
        let plays = BTreeMap::from([
            (at(1000, 0), Outcome { end: End::Solved, overlap_mm: Some(rounded(2.914)) }),
            (at(250, 11), Outcome { end: End::Lost, overlap_mm: None }),
            (at(2000, 3), Outcome { end: End::Deep, overlap_mm: Some(rounded(8.0)) }),
        ]);
        assert_eq!(written(&plays), "0.25:11l 1:0s2.91 2:3d8");
        assert_eq!(read(&written(&plays)), Some(plays));
        assert_eq!(read("1:0x2"), None);
    }
}
