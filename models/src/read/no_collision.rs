//! Pairs of links that never touch each other, from `hand.toml`.

use super::report::Report;
use super::settings::Settings;
use super::springs::unknown_link;
use super::urdf::reduce::Reduced;
use super::urdf::tree::Urdf;

/// The stated pairs, lower index first. A pair that fixed joints join is one body and needs none. Unknown links are kept as errors.
pub(crate) fn pairs(tree: &Urdf, reduced: &Reduced, settings: &Settings, at: &Report) -> Vec<[usize; 2]> {
    // A link that the loader left out touches nothing anyway.
    let body = |name: &String| {
        let link = tree.robot.links.iter().position(|link| link.name == *name);
        let link = at.keep(link.ok_or_else(|| unknown_link(name, "no_collision", at)))?;
        reduced.merged_into[link].map(|(body, _)| body)
    };
    let mut out = Vec::new();
    for [a, b] in &settings.no_collision {
        match (body(a), body(b)) {
            (Some(a), Some(b)) if a != b => out.push([a.min(b), a.max(b)]),
            _ => {}
        }
    }
    out
}
