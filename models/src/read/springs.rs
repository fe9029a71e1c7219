//! Springs across joints, and pins that close chains of links, from `hand.toml`.

use super::actuation::arms;
use super::report::Report;
use super::settings::Settings;
use super::urdf::reduce::Reduced;
use super::urdf::tree::Urdf;
use crate::Vec3;
use crate::error::{LoadWarning, ModelError};
use crate::hand::{Hand, Linkage, Spring};

/// Springs across several joints, by name; those with a problem, which is kept, are left out.
pub(crate) fn springs(tree: &Urdf, reduced: &Reduced, settings: &Settings, at: &Report) -> Vec<Spring> {
    let mut out = Vec::new();
    for (name, own) in &settings.springs {
        let element = format!("[springs.{name}]");
        let Some(arms) = arms(tree, reduced, &own.joints, &element, at) else { continue };
        if arms.is_empty() {
            at.keep::<()>(Err(at.bad(element, "acts on no joint", "joints = { joint = entry, … }")));
            continue;
        }
        out.push(Spring { name: name.clone(), arms, numbers: own.numbers() });
    }
    out
}

/// Pins, by name; those with a problem, which is kept, are left out.
pub(crate) fn linkages(tree: &Urdf, reduced: &Reduced, settings: &Settings, at: &Report) -> Vec<Linkage> {
    let mut out = Vec::new();
    for (name, own) in &settings.linkages {
        let element = format!("[linkages.{name}]");
        let end = |side: usize| {
            let link = tree.robot.links.iter().position(|link| link.name == own.links[side]);
            let place = link.and_then(|link| reduced.merged_into[link]);
            let place = place.ok_or_else(|| unknown_link(&own.links[side], &element, at));
            let (link, pose) = at.keep(place)?;
            Some((link, pose.transform_point(Vec3::from_array(own.points[side]))))
        };
        let (Some((a, near)), Some((b, far))) = (end(0), end(1)) else { continue };
        if a == b {
            let problem = format!("links '{}' and '{}' are one body", own.links[0], own.links[1]);
            at.keep::<()>(Err(at.bad(element, problem, "two links that move against each other")));
            continue;
        }
        out.push(Linkage { name: name.clone(), links: [a, b], points: [near, far], numbers: own.numbers() });
    }
    out
}

/// The error about a link that is not there.
pub(super) fn unknown_link(link: &str, element: &str, at: &Report) -> ModelError {
    at.bad(element, format!("names link '{link}'"), "a <link> of the URDF")
}

/// Pins that no position of the joints within their limits closes; `rest` closes the others.
pub(crate) fn open_pins(hand: &Hand, rest: &[f64], at: &Report) -> Vec<LoadWarning> {
    /// Gap above which a pin is open, m.
    const OPEN: f64 = 1e-4;
    let gap = |pin: &Linkage| pin.at(hand, rest).gap.length();
    let open = hand.linkages.iter().map(|pin| (pin, gap(pin))).filter(|(_, gap)| *gap > OPEN);
    open.map(|(pin, gap)| LoadWarning {
        file: at.file.clone(),
        element: format!("[linkages.{}]", pin.name),
        message: format!("its points are {gap:.2e} m apart, and no position of the joints joins them: are points and limits right?"),
    })
    .collect()
}
