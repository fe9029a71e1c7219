//! Pairs of links that never touch each other, from `hand.toml`.

use super::report::Report;
use super::settings::Settings;
use super::urdf::reduce::Reduced;
use super::urdf::tree::Urdf;
use crate::error::ModelError;

/// The stated pairs, lower index first. A pair that fixed joints join is one body and needs none.
pub(crate) fn pairs(
    tree: &Urdf,
    reduced: &Reduced,
    settings: &Settings,
    at: &Report,
) -> Result<Vec<[usize; 2]>, ModelError> {
    let bad = |name: &String| at.bad("no_collision", format!("names link '{name}'"), "a <link> of the URDF");
    // None is a link that the loader left out, which touches nothing anyway.
    let body = |name: &String| {
        let link = tree.robot.links.iter().position(|link| link.name == *name);
        let link = link.ok_or_else(|| bad(name))?;
        Ok(reduced.merged_into[link].map(|(body, _)| body))
    };
    let mut out = Vec::new();
    for [a, b] in &settings.no_collision {
        match (body(a)?, body(b)?) {
            (Some(a), Some(b)) if a != b => out.push([a.min(b), a.max(b)]),
            _ => {}
        }
    }
    Ok(out)
}
