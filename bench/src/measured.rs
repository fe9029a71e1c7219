//! A measurement on a hand, repeated over placements of the object.

use serde::{Deserialize, Serialize};
use std::fmt;

/// One quantity over several placements, beside its published value.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Measured {
    /// The measured quantity.
    pub quantity: String,
    /// Its unit.
    pub unit: String,
    /// The hand.
    pub hand: String,
    /// The value that a publication gives for this hand, if one was found.
    pub published: Option<f64>,
    /// Every placement, with its value; none where the hand did not hold the object.
    pub placements: Vec<(String, Option<f64>)>,
}

/// Mean and range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// Least.
    pub least: f64,
    /// Largest.
    pub largest: f64,
}

impl Spread {
    /// The spread of some values; none of no value.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Spread> {
        let values: Vec<f64> = values.into_iter().collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let (least, largest) =
            values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
        (!values.is_empty()).then_some(Spread { mean, least, largest })
    }
}

impl Measured {
    /// Mean and range over the placements in which the object was held.
    pub fn spread(&self) -> Option<Spread> {
        Spread::of(self.placements.iter().filter_map(|(_, value)| *value))
    }

    /// Number of placements in which the object was not held.
    pub fn lost(&self) -> usize {
        self.placements.iter().filter(|(_, value)| value.is_none()).count()
    }

    /// Distance of the mean from the published value, as a part of it; none without both.
    pub fn departure(&self) -> Option<f64> {
        Some((self.spread()?.mean / self.published? - 1.0).abs())
    }
}

impl fmt::Display for Measured {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Measured { quantity, unit, hand, .. } = self;
        match self.spread() {
            Some(Spread { mean, least, largest }) => write!(
                f,
                "  measured   {hand}, {quantity}: {mean:.2} {unit} in the mean, {least:.2} to {largest:.2}"
            )?,
            None => write!(f, "  measured   {hand}, {quantity}: the object was never held")?,
        }
        if let Some(published) = self.published {
            write!(f, "; published {published} {unit}")?;
        }
        writeln!(f, "; lost {} of {}", self.lost(), self.placements.len())?;
        for (placement, value) in &self.placements {
            let value = value.map_or("lost".into(), |x| format!("{x:.2} {unit}"));
            writeln!(f, "             {placement}: {value}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lost_object_does_not_count_in_the_mean() {
        let measured = Measured {
            quantity: "force".into(),
            unit: "N".into(),
            hand: "h".into(),
            published: Some(20.0),
            placements: vec![("a".into(), Some(18.0)), ("b".into(), None), ("c".into(), Some(26.0))],
        };
        assert_eq!(measured.spread(), Some(Spread { mean: 22.0, least: 18.0, largest: 26.0 }));
        assert_eq!(measured.lost(), 1);
        assert!((measured.departure().expect("both are known") - 0.1).abs() < 1e-12);
        assert_eq!(Spread::of([]), None);
    }
}
