//! Makes of a draft a hand that Palmares can load: fills what is missing, replaces what a hand does not have.
//!
//! 1. `tree.rs`: one tree with unique names.
//! 2. `shapes.rs`: shapes that touch.
//! 3. `joints.rs`: ball joints become hinges, couplings linear, limits consistent, joints without shapes fixed. `followers.rs`: springs,
//!    tendons and motors of a joint that follows another belong to its leader. `mass.rs`: masses of moving links.
//! 4. `motors.rs`: tendons with their motors. `servos.rs`: motors of one joint. `fingers.rs`: rows of joints with such motors.

mod fingers;
mod followers;
mod joints;
mod mass;
mod motors;
mod servos;
mod shapes;
mod tree;

use std::collections::BTreeSet;

use palmares_models::error::LoadWarning;
use palmares_models::hand::Motor;

use crate::decision::Log;
use crate::draft::Draft;
use crate::meshes::{self, Meshes};
use crate::options::ImportOptions;
use crate::source::Source;

pub(crate) use fingers::{Finger, fingers};
pub(crate) use mass::shown;
pub(crate) use motors::{SPRING_LAG, STRETCH, Wound, counted};
pub(crate) use servos::{Servo, ServoNumbers};

/// A draft without gaps.
pub(crate) struct Complete {
    pub(crate) draft: Draft,
    pub(crate) meshes: Meshes,
    /// Links whose inertia comes from their shapes instead of the source.
    pub(crate) inertia_from_shapes: BTreeSet<String>,
    /// In the order of the source.
    pub(crate) motors: Vec<Motor>,
    pub(crate) tendons: Vec<Wound>,
    /// In the order of the source.
    pub(crate) servos: Vec<Servo>,
}

impl Complete {
    /// Links of which the loader says that their inertia is far from that of their shapes.
    pub(crate) fn stand_in_inertias(&self, warnings: &[LoadWarning]) -> Vec<String> {
        if self.draft.settings.is_some() {
            return Vec::new();
        }
        let found = warnings.iter().filter(|warning| warning.message.contains("inertia = \"from_geometry\""));
        let elements: BTreeSet<&str> = found.map(|warning| warning.element.as_str()).collect();
        let links = self.draft.links.iter().map(|link| &link.name);
        links.filter(|name| elements.contains(format!("link '{name}'").as_str())).cloned().collect()
    }
}

/// Completes a draft.
pub(crate) fn complete(
    mut draft: Draft,
    source: &Source,
    options: &ImportOptions,
    log: &mut Log,
) -> Complete {
    tree::check(&mut draft, log);
    draft.note_drawn();
    // Before the joints: one that moves no shape does not lead others.
    shapes::complete(&mut draft, options, log);
    joints::complete(&mut draft, log);
    followers::complete(&mut draft, log);
    let meshes = meshes::convert(&mut draft, source, log);
    joints::idle(&mut draft, log);
    // Only shapes can touch.
    let touches = |name: &String| draft.links.iter().any(|l| l.name == *name && !l.collisions.is_empty());
    let touching = |pair: &[String; 2]| pair.iter().all(touches);
    let exclusions: Vec<[String; 2]> =
        draft.exclusions.iter().filter(|pair| touching(pair)).cloned().collect();
    draft.exclusions = exclusions;
    mass::complete(&mut draft, &meshes, log);
    let inertia_from_shapes = mass::implausible(&draft, log);
    let (motors, tendons, servos) = motors::complete(&mut draft, log);
    Complete { draft, meshes, inertia_from_shapes, motors, tendons, servos }
}
