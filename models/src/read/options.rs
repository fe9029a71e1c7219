//! How a hand is read, where its files leave a choice.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::limits::Limits;

/// Where a link's inertia comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum InertiaPolicy {
    /// What the file states; what cannot be true is reported.
    #[default]
    FromFile,
    /// From the collision shapes and the stated mass.
    FromGeometry,
}

/// How to read a hand.
#[derive(Clone, Debug)]
pub struct LoadOptions {
    /// The `hand.toml`; `None` for the one beside the URDF, if there is one.
    pub settings: Option<PathBuf>,
    /// Used unless `hand.toml` says otherwise.
    pub inertia: InertiaPolicy,
    /// Coulomb friction of surfaces, unless `hand.toml` says otherwise.
    pub friction: f64,
    /// Support points kept of a mesh.
    pub hull_directions: usize,
    /// Edge radius of a mesh's hull, m.
    pub hull_rounding: f64,
    /// Bounds on what a file may ask for.
    pub limits: Limits,
}

impl Default for LoadOptions {
    fn default() -> LoadOptions {
        LoadOptions {
            settings: None,
            inertia: InertiaPolicy::FromFile,
            friction: 1.0,
            hull_directions: 64,
            hull_rounding: 2e-3,
            limits: Limits::default(),
        }
    }
}
