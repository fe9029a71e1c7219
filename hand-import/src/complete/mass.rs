//! Masses: links that move need one.

use std::collections::{BTreeMap, BTreeSet};

use palmares_models::hand::Inertia;
use palmares_models::measure::HandLimits;
use palmares_models::{Mat3, Vec3};

use crate::decision::{At, Log};
use crate::draft::{Draft, Geometry, Inertial, Link};
use crate::meshes::Meshes;

/// Density of a link without a mass: that of plastics, kg/m³.
const DENSITY: f64 = 1000.0;
/// Mass of a link without mass and shape, kg, and its inertia, kg·m²: a ball of 1 cm radius.
const LIGHT: (f64, f64) = (1e-3, 4e-8);

/// Gives a mass to each moving body without one.
pub(crate) fn complete(draft: &mut Draft, meshes: &Meshes, log: &mut Log) {
    if draft.settings.is_some() {
        return;
    }
    for link in &mut draft.links {
        if link.inertial.is_some_and(|inertial| inertial.mass < 0.0) {
            let element = format!("link '{}'", link.name);
            log.problem(At::Link(link.name.clone()), element, "has a negative mass; it is left out");
            link.inertial = None;
        }
    }
    let least = HandLimits::default().least_link_mass_kg;
    for body in bodies(draft) {
        let links = || draft.links.iter().filter(|link| body.contains(&link.name));
        let mass: f64 = links().filter_map(|link| link.inertial).map(|inertial| inertial.mass).sum();
        if mass >= least || is_coupler(draft, &body) {
            continue;
        }
        if mass > 0.0
            && let Some(name) = body.iter().next()
        {
            let text =
                format!("weighs {mass:.3e} kg, less than the {least} kg that a link of a hand may have");
            log.guessed(At::Link(name.clone()), format!("link '{name}'"), text);
        }
        let volumes: BTreeMap<String, f64> =
            links().map(|link| (link.name.clone(), volume(link, meshes))).filter(|(_, v)| *v > 0.0).collect();
        if volumes.is_empty() {
            let Some(name) = body.iter().next().cloned() else { continue };
            let (mass, i) = LIGHT;
            let inertial = Inertial { mass, inertia: [i, 0.0, 0.0, i, 0.0, i], ..Inertial::default() };
            if let Some(link) = draft.links.iter_mut().find(|link| link.name == name) {
                link.inertial = Some(inertial);
            }
            log.guessed(
                At::Link(name.clone()),
                format!("link '{name}'"),
                "moves without mass and shape; taken is 1 g",
            );
            continue;
        }
        for (name, volume) in volumes {
            let mass = (DENSITY * volume).max(LIGHT.0);
            let text =
                format!("has no mass; taken are {mass:.4} kg, its shapes at {DENSITY} kg/m³, at least 1 g");
            log.guessed(At::Link(name.clone()), format!("link '{name}'"), text);
            if let Some(link) = draft.links.iter_mut().find(|link| link.name == name) {
                let inertial = link.inertial.unwrap_or_default();
                link.inertial = Some(Inertial { mass, inertia: [0.0; 6], ..inertial });
            }
        }
    }
}

/// Links whose inertia is missing or one that no rigid body has: theirs is better taken from their shapes.
pub(crate) fn implausible(draft: &Draft, log: &mut Log) -> BTreeSet<String> {
    if draft.settings.is_some() {
        return BTreeSet::new();
    }
    let shaped =
        |link: &&Link| link.inertial.filter(|inertial| inertial.mass > 0.0 && !link.collisions.is_empty());
    let named = |wrong: &dyn Fn(Inertial) -> bool| -> Vec<&str> {
        let links = draft.links.iter().filter(|link| shaped(link).is_some_and(wrong));
        links.map(|link| link.name.as_str()).collect()
    };
    let missing = |inertial: Inertial| [0, 3, 5].iter().all(|k| inertial.inertia[*k] == 0.0);
    let impossible = |Inertial { mass, inertia: [xx, xy, xz, yy, yz, zz], .. }: Inertial| {
        let about_com = Mat3::from_cols(Vec3::new(xx, xy, xz), Vec3::new(xy, yy, yz), Vec3::new(xz, yz, zz));
        Inertia { mass, com: Vec3::ZERO, about_com }.implausible().is_some()
    };
    let (without, wrong) = (named(&missing), named(&|inertial| !missing(inertial) && impossible(inertial)));
    for (problem, names) in
        [("states no inertia for", &without), ("no rigid body has the inertia of", &wrong)]
    {
        if !names.is_empty() {
            let text = format!("{problem} {}; theirs come from their shapes", shown(names));
            log.guessed(At::Hand, "robot", text);
        }
    }
    without.into_iter().chain(wrong).map(str::to_owned).collect()
}

/// How many links these are, and the names of the first ones.
pub(crate) fn shown(links: &[&str]) -> String {
    let first = links.iter().take(6).copied().collect::<Vec<_>>().join(", ");
    let more = if links.len() > 6 { ", …" } else { "" };
    format!("{} {} ({first}{more})", links.len(), if links.len() == 1 { "link" } else { "links" })
}

/// Links that fixed joints connect, by the moving link that they follow.
fn bodies(draft: &Draft) -> Vec<BTreeSet<String>> {
    let mut bodies: BTreeMap<&str, BTreeSet<String>> = BTreeMap::new();
    for link in &draft.links {
        bodies.entry(draft.body_of(&link.name)).or_default().insert(link.name.clone());
    }
    bodies.into_values().collect()
}

/// The link between the two hinges of a rolling joint: it touches nothing, and both hinges have one coordinate.
fn is_coupler(draft: &Draft, body: &BTreeSet<String>) -> bool {
    if body.len() != 1 || draft.links.iter().any(|l| body.contains(&l.name) && !l.collisions.is_empty()) {
        return false;
    }
    let to = draft.joints.iter().find(|joint| body.contains(&joint.child));
    let mut from = draft.joints.iter().filter(|joint| body.contains(&joint.parent));
    let (Some(to), Some(second), None) = (to, from.next(), from.next()) else { return false };
    let leader = |name: &str| {
        let mut name = name.to_owned();
        while let Some(coupling) = draft.couplings.iter().find(|coupling| coupling.joint == name) {
            name.clone_from(&coupling.leader);
        }
        name
    };
    leader(&to.name) == leader(&second.name)
}

/// Volume of a link's shapes, m³; overlaps count twice.
fn volume(link: &Link, meshes: &Meshes) -> f64 {
    use std::f64::consts::PI;
    let of = |geometry: &Geometry| match geometry {
        Geometry::Box([a, b, c]) => a * b * c,
        Geometry::Sphere { radius } => 4.0 / 3.0 * PI * radius.powi(3),
        Geometry::Cylinder { radius, length } => PI * radius.powi(2) * length,
        Geometry::Capsule { radius, length } => PI * radius.powi(2) * (length + 4.0 / 3.0 * radius),
        Geometry::Ellipsoid([a, b, c]) => 4.0 / 3.0 * PI * a * b * c,
        Geometry::Mesh(mesh) => meshes.volume(mesh),
    };
    link.collisions.iter().map(|part| of(&part.geometry)).sum()
}
