//! Numbers of a run that are given rather than drawn.

use palmares_models::hand::Hand;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::RangeInclusive;

/// Factors of mass and friction.
const FACTORS: RangeInclusive<f64> = 0.01..=100.0;
/// Factors of lengths.
const SIZES: RangeInclusive<f64> = 0.1..=10.0;
/// Components of gravity, m/s²: ten times that of the Earth either way.
const GRAVITY: RangeInclusive<f64> = -100.0..=100.0;

/// Factors of the objects, one for each in scene order, numbers of the hand, and gravity.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Given {
    /// Factors of masses.
    pub mass: Option<Vec<f64>>,
    /// Factors of friction coefficients.
    pub friction: Option<Vec<f64>>,
    /// Factors of lengths; the masses stay as they are.
    pub size: Option<Vec<f64>>,
    /// Numbers of the hand: each a factor of its own number or the number itself, as `[uncertain]` of its `hand.toml` says.
    pub hand: BTreeMap<String, f64>,
    /// Gravity of the run, m/s², world axes. The scene settles before, under the task's own.
    pub gravity: Option<[f64; 3]>,
    /// Factors of masses and inertias of the hand's links, in their order.
    pub link_mass: Option<Vec<f64>>,
}

impl Given {
    /// Checks the numbers for a hand.
    ///
    /// # Errors
    /// A number is out of bounds, or the hand has no uncertain number of this name.
    pub fn check(&self, hand: &Hand) -> Result<(), String> {
        let factors = [
            ("mass", &self.mass, FACTORS),
            ("friction", &self.friction, FACTORS),
            ("size", &self.size, SIZES),
            ("link_mass", &self.link_mass, FACTORS),
        ];
        for (name, factors, allowed) in factors {
            if let Some(bad) = factors.iter().flatten().find(|factor| !allowed.contains(factor)) {
                return Err(format!("{name}: found {bad}; wanted {} to {}", allowed.start(), allowed.end()));
            }
        }
        if let Some(bad) = self.gravity.iter().flatten().find(|component| !GRAVITY.contains(component)) {
            let (low, high) = (GRAVITY.start(), GRAVITY.end());
            return Err(format!("gravity: found {bad} m/s²; wanted {low} to {high}"));
        }
        if let Some(factors) = self.link_mass.as_ref().filter(|factors| factors.len() != hand.links.len()) {
            let (found, name, links) = (factors.len(), &hand.name, hand.links.len());
            return Err(format!("link_mass: found {found} factors; hand `{name}` has {links} links"));
        }
        for (name, number) in &self.hand {
            let Some(entry) = hand.uncertain.iter().find(|entry| entry.name == *name) else {
                let known: Vec<String> =
                    hand.uncertain.iter().map(|entry| format!("hand_{}", entry.name)).collect();
                let known = if known.is_empty() { "nothing".to_owned() } else { known.join(", ") };
                return Err(format!(
                    "found hand_{name}; hand `{}` has in [uncertain] of its hand.toml: {known}",
                    hand.name
                ));
            };
            let [low, high] = entry.range.ends();
            if !(low..=high).contains(number) {
                return Err(format!("hand_{name}: found {number}; wanted {low} to {high}"));
            }
        }
        Ok(())
    }
}
