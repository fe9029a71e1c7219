//! A measurement on a hand whose uncertain numbers are at the ends of their ranges.

use anyhow::{Context, Result};
use palmares_models::hand::Hand;
use std::sync::Arc;

/// The least and the largest value over the ranges, one number after another, and the entry that moves it most.
#[derive(Clone, Debug)]
pub(crate) struct Ends {
    pub(crate) least: f64,
    pub(crate) largest: f64,
    pub(crate) most: String,
}

impl Ends {
    /// Whether a value is between them.
    pub(crate) fn contain(&self, value: f64) -> bool {
        (self.least..=self.largest).contains(&value)
    }
}

/// The values of a hand with each entry of `[uncertain]` at both ends of its range, the others as they are. Values that are missing,
/// because the hand holds nothing, are left out; none without entries.
pub(super) fn over_ranges(
    hand: &Arc<Hand>,
    value: impl Fn(&Arc<Hand>) -> Result<Option<f64>>,
) -> Result<Option<Ends>> {
    let own = value(hand)?;
    let mut found: Option<Ends> = None;
    let mut widest = 0.0;
    for (k, entry) in hand.uncertain.iter().enumerate() {
        let mut all: Vec<f64> = own.into_iter().collect();
        for end in entry.range.ends() {
            let mut numbers = vec![None; hand.uncertain.len()];
            *numbers.get_mut(k).context("an entry")? = Some(end);
            all.extend(value(&Arc::new(hand.drawn(&numbers)?))?);
        }
        let (least, largest) =
            all.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
        if all.is_empty() {
            continue;
        }
        let ends = found.get_or_insert(Ends { least, largest, most: entry.name.clone() });
        (ends.least, ends.largest) = (ends.least.min(least), ends.largest.max(largest));
        if largest - least > widest {
            (widest, ends.most) = (largest - least, entry.name.clone());
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_are_those_of_the_ranges_and_name_the_widest() {
        let hand = Hand::builtin("inspire_rh56").expect("built in");
        let limit =
            |hand: &Arc<Hand>| Ok(Some(hand.tendons[0].force_limit + 1e-3 * hand.tendons[0].stiffness));
        let ends = over_ranges(&hand, limit).expect("values").expect("it has ranges");
        // 1 N m and 20 N m/rad; factors of 0.8 to 1, and of 0.33 to 3.
        assert!((ends.least - 0.82).abs() < 1e-12 && (ends.largest - 1.06).abs() < 1e-12, "{ends:?}");
        assert_eq!(ends.most, "force_limit");
        assert!(ends.contain(0.9) && !ends.contain(1.1));
        assert!(over_ranges(&hand, |_| Ok(None)).expect("no values").is_none());
    }
}
