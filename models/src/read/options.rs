//! Options for reading a hand.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::limits::Limits;

/// Source of a link's inertia.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum InertiaPolicy {
    /// The file's numbers; implausible ones are reported.
    #[default]
    FromFile,
    /// From the collision shapes and the stated mass.
    FromGeometry,
}

/// Options for reading a hand.
#[derive(Clone, Debug)]
pub struct LoadOptions {
    /// The `hand.toml`; `None` for the one next to the URDF, if it exists.
    pub settings: Option<PathBuf>,
    /// Used unless `hand.toml` says otherwise.
    pub inertia: InertiaPolicy,
    /// Coulomb friction of surfaces, unless `hand.toml` says otherwise.
    pub friction: f64,
    /// Support points kept of a mesh.
    pub hull_directions: usize,
    /// Edge radius of a mesh's hull, m.
    pub hull_rounding: f64,
    /// Limits for files.
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
