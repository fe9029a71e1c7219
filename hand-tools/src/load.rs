//! Which hand is meant, and how far it is to close.

use anyhow::{Context, bail};
use palmares_models::builtin::builtin_hands;
use palmares_models::error::{LoadWarning, ModelError};
use palmares_models::hand::Hand;
use palmares_models::measure::{HandLimits, Sources};
use palmares_models::read::{self, LoadOptions, Loaded};
use std::path::Path;
use std::sync::Arc;

/// Reads the limits that a competition's file sets for hands.
pub type LimitsOf<'a> = &'a dyn Fn(&Path) -> anyhow::Result<HandLimits>;

/// A hand that was found.
pub(crate) struct Found {
    pub(crate) hand: Arc<Hand>,
    /// Where its numbers come from.
    pub(crate) sources: Sources,
    pub(crate) warnings: Vec<LoadWarning>,
}

/// A hand from a file, a folder, an archive, or, where there is none of that name, from the program itself.
pub(crate) fn load_hand(name: &str) -> Result<Found, ModelError> {
    let path = Path::new(name);
    if !path.exists()
        && let Some(hand) = Hand::builtin(name)
    {
        return Ok(Found { hand, sources: Sources::of_urdf(path), warnings: Vec::new() });
    }
    let Loaded { hand, sources, warnings } = read::hand(path, &LoadOptions::default())?;
    Ok(Found { hand: Arc::new(hand), sources, warnings })
}

/// What to try when a name is neither a file nor a hand.
pub(crate) fn hint(name: &str) -> Option<String> {
    let names: Vec<&str> = builtin_hands().iter().map(|hand| hand.name.as_str()).collect();
    (!Path::new(name).exists()).then(|| format!("hands that come with the program: {}", names.join(", ")))
}

/// Reads `0.2,0.5,1`: numbers from 0 to 1.
pub(crate) fn parse_sigma(text: &str) -> anyhow::Result<f64> {
    let sigma: f64 = text.trim().parse().with_context(|| format!("`{text}` is not a number"))?;
    if !(0.0..=1.0).contains(&sigma) {
        bail!("σ = {sigma} is out of range; valid: 0 (open) to 1 (closed)");
    }
    Ok(sigma)
}
