//! Links without mass between two joints, as descriptions have them for joints of several axes: universal joints, flexures.

use crate::Pose;
use crate::hand::{Inertia, Link};
use crate::read::report::Report;

/// Part of the next link's inertia that a link without mass gets. The whole keeps its mass, and its inertia about the outer joint changes by
/// this part.
const SHARE: f64 = 0.02;

/// Gives each moving link without mass and shapes a part of the mass of the link behind it, if there is exactly one. `links` are
/// ordered parents first.
pub(super) fn share_mass(links: &mut [Link], report: &mut Report) {
    for i in (1..links.len()).rev() {
        if links[i].inertia.mass > 0.0 || !links[i].geoms.is_empty() {
            continue;
        }
        let mut behind = (i + 1..links.len()).filter(|&k| links[k].parent == Some(i));
        let (Some(k), None) = (behind.next(), behind.next()) else { continue };
        if links[k].inertia.mass <= 0.0 {
            continue;
        }
        let hinges = links[k].joint.iter().flat_map(|joint| &joint.hinges);
        let link_from_child = hinges.fold(Pose::IDENTITY, |pose, hinge| pose * hinge.pose(0.0));
        let whole = links[k].inertia;
        links[i].inertia = scaled(&whole, SHARE).moved(&link_from_child);
        links[k].inertia = scaled(&whole, 1.0 - SHARE);
        report.warn(
            format!("link '{}'", links[i].name),
            format!(
                "has no mass between two joints; takes {} % of that of '{}'",
                100.0 * SHARE,
                links[k].name
            ),
        );
    }
}

/// A part of a body of the same form.
fn scaled(inertia: &Inertia, part: f64) -> Inertia {
    Inertia { mass: part * inertia.mass, com: inertia.com, about_com: inertia.about_com * part }
}
