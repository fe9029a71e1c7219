//! Arguments: the hand, and σ.

use anyhow::{Context, bail};
use palmares_models::builtin::builtin_hands;
use palmares_models::error::{LoadWarning, ModelError, Refused};
use palmares_models::hand::Hand;
use palmares_models::measure::{HandLimits, Sources};
use palmares_models::read::{self, LoadOptions, Loaded};
use std::path::Path;
use std::sync::Arc;

/// Reads the limits that a competition's file sets for hands.
pub type LimitsOf<'a> = &'a dyn Fn(&Path) -> anyhow::Result<HandLimits>;

/// A loaded hand.
pub(crate) struct Found {
    pub(crate) hand: Arc<Hand>,
    /// Origin of its numbers.
    pub(crate) sources: Sources,
    pub(crate) warnings: Vec<LoadWarning>,
}

/// Loads a hand from a file, a folder or an archive, or the built-in hand of that name.
///
/// # Errors
/// Every problem, and the warnings beside them.
pub(crate) fn examine_hand(name: &str) -> Result<Found, Refused> {
    let path = Path::new(name);
    if !path.exists()
        && let Some(hand) = Hand::builtin(name)
    {
        return Ok(Found { hand, sources: Sources::of_urdf(path), warnings: Vec::new() });
    }
    let Loaded { hand, sources, warnings } = read::examine(path, &LoadOptions::default())?;
    Ok(Found { hand: Arc::new(hand), sources, warnings })
}

/// As [`examine_hand`], with one error.
pub(crate) fn load_hand(name: &str) -> Result<Found, ModelError> {
    examine_hand(name).map_err(Refused::into_error)
}

/// A hint with the built-in hands, if there is no file of this name.
pub(crate) fn hint(name: &str) -> Option<String> {
    let names: Vec<&str> = builtin_hands().iter().map(|hand| hand.name.as_str()).collect();
    (!Path::new(name).exists()).then(|| format!("built-in hands: {}", names.join(", ")))
}

/// Reads one σ, from 0 to 1.
pub(crate) fn parse_sigma(text: &str) -> anyhow::Result<f64> {
    let sigma: f64 = text.trim().parse().with_context(|| format!("`{text}` is not a number"))?;
    if !(0.0..=1.0).contains(&sigma) {
        bail!("σ = {sigma} is out of range; valid: 0 (open) to 1 (closed)");
    }
    Ok(sigma)
}

/// Index of the link of that name.
pub(crate) fn link_of(hand: &Hand, name: &str) -> anyhow::Result<usize> {
    hand.link(name).with_context(|| {
        let names: Vec<&str> = hand.links.iter().map(|link| link.name.as_str()).collect();
        format!("hand `{}` has no link `{name}`; its links: {}", hand.name, names.join(", "))
    })
}
