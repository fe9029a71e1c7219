//! Named settings of Drake. An option has the name that Drake's documentation gives it.

use crate::engine::option_set::EngineOptions;
use serde_json::{Map, Value, json};

/// The options of Drake that settings choose; the others keep Drake's defaults.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// As on the command line.
    pub name: &'static str,
    /// Description, with the reason for the values.
    pub about: &'static str,
    /// Of `MultibodyPlantConfig`.
    plant: EngineOptions,
    /// Modulus of hydroelastic contact, Pa.
    hydroelastic_modulus: f64,
    /// Hunt & Crossley dissipation, s/m.
    dissipation: Option<f64>,
}

const HYDROELASTIC: (&str, &str) = ("contact_model", "hydroelastic_with_fallback");

/// All of them; the first are Drake's own.
pub const SETTINGS: &[Settings] = &[
    Settings {
        name: "default",
        about: "defaults of `MultibodyPlantConfig` (lagged approximation); compliant hydroelastic contact of 1e7 Pa, its own \
                choice for objects without properties",
        plant: &[HYDROELASTIC],
        hydroelastic_modulus: 1e7,
        dissipation: None,
    },
    Settings {
        name: "sap",
        about: "`default` with the convex approximation SAP, which is the one with a proof of convergence",
        plant: &[HYDROELASTIC, ("discrete_contact_approximation", "sap")],
        hydroelastic_modulus: 1e7,
        dissipation: None,
    },
    Settings {
        name: "stiff",
        about: "`default` with hydroelastic contact of 1e9 Pa, nearer to rigid bodies",
        plant: &[HYDROELASTIC],
        hydroelastic_modulus: 1e9,
        dissipation: None,
    },
    Settings {
        name: "point",
        about: "`default` with one point a pair and a spring at it instead of hydroelastic contact",
        plant: &[("contact_model", "point")],
        hydroelastic_modulus: 1e7,
        dissipation: None,
    },
];

impl Settings {
    /// For the process: `plant` and `material` of the scene.
    pub(super) fn json(&self) -> (Value, Value) {
        let plant: Map<String, Value> =
            self.plant.iter().map(|(key, value)| ((*key).to_owned(), Value::from(*value))).collect();
        let mut material = json!({ "hydroelastic_modulus": self.hydroelastic_modulus, "resolution_hint": RESOLUTION });
        if let Some(dissipation) = self.dissipation {
            material["dissipation"] = dissipation.into();
        }
        (plant.into(), material)
    }
}

/// Edge of the facets of round hydroelastic surfaces, of the shape's smallest radius.
const RESOLUTION: f64 = 0.25;
