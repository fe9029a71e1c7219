//! MJCF, MuJoCo's format.
//!
//! 1. `include.rs`: the XML with its includes. `defaults.rs`, `compiler.rs`: classes, units, orientations.
//! 2. `compile.rs` makes a [`Model`](model::Model) of it: bodies, joints and geoms. `actuation.rs` adds tendons and actuators,
//!    `constraints.rs` equalities, exclusions and keyframes, `couplings.rs` what tendons bind. `mesh.rs`, `inertia.rs` and
//!    `actuator.rs` compute what MuJoCo derives, `copies.rs` names what it copies.
//! 3. `length.rs`, `wrap.rs` and `motions.rs`: lengths of tendons, also over joints that follow others. `frames.rs`, `draft.rs`,
//!    `start.rs` and `tendons.rs`: the hand in it.

mod actuation;
mod actuator;
mod compile;
mod compiler;
mod constraints;
mod copies;
mod couplings;
mod defaults;
mod draft;
mod frames;
mod include;
mod inertia;
mod length;
mod mesh;
mod model;
mod motions;
mod principal;
mod start;
mod stated;
mod tendons;
#[cfg(test)]
mod tests;
mod wrap;

use crate::draft::Draft;
use crate::error::ImportError;
use crate::glance::{Glance, STATED};
use crate::read::reading::{Reading, settings};

/// Whether a file is MJCF.
pub(super) fn is(file: &Glance<'_>) -> bool {
    file.root == "mujoco"
}

/// Reads the document of a reading.
pub(super) fn read(reading: &mut Reading<'_>) -> Result<Draft, ImportError> {
    let settings = settings(reading)?;
    let (source, path) = (reading.source, reading.path.clone());
    let root = include::parse_with_includes(source, &path)?;
    if root.name != "mujoco" {
        return Err(ImportError::unreadable(source.display(&path), "the root element is not <mujoco>"));
    }
    let (model, meshes) = compile::compile(source, &path, &root, &mut reading.log);
    let mut draft = draft::draft(&model, &meshes, &mut reading.log);
    if let Some(text) = &settings {
        stated::leave_out(&mut draft, text, model.texts.get(STATED));
    }
    draft.settings = settings;
    Ok(draft)
}
