//! Named settings of Drake. They follow the documentation of `MultibodyPlantConfig`, `DefaultProximityProperties` and
//! `DiscreteContactApproximation`, version 1.51, and the Hydroelastic Contact User Guide. An option has the name of its field.

use crate::engine::option_set::{self, EngineOptions};
use crate::engine::surfaces::Surfaces;
use anyhow::Result;
use serde_json::{Map, Value};

/// Drake's options, by the names of their fields; what is not named keeps Drake's default.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// As on the command line.
    pub name: &'static str,
    /// Description, with the reason for the values.
    pub about: &'static str,
    /// The last value of an option that is named twice counts. `none` leaves a value to Drake's estimate.
    options: EngineOptions,
}

/// Fields of `MultibodyPlantConfig`.
const PLANT: [&str; 6] = [
    "contact_model",
    "discrete_contact_approximation",
    "stiction_tolerance",
    "penetration_allowance",
    "sap_near_rigid_threshold",
    "contact_surface_representation",
];
/// Fields of `DefaultProximityProperties`, which every shape gets.
const PROXIMITY: [&str; 6] = [
    "compliance_type",
    "hydroelastic_modulus",
    "hunt_crossley_dissipation",
    "relaxation_time",
    "point_stiffness",
    "margin",
];
/// Fields of `SimulatorConfig`; with any of them the plant is continuous, and the step is the largest of its integrator.
const SIMULATOR: [&str; 3] = ["integration_scheme", "accuracy", "use_error_control"];

/// All of them; the first are Drake's own.
pub const SETTINGS: &[Settings] = &[
    Settings {
        name: "default",
        about: "all defaults of Drake: one point a pair of shapes with a spring of 1e6 N/m and 50 s/m of Hunt & Crossley \
                dissipation, since shapes are not hydroelastic unless told so; approximation lagged",
        options: &[],
    },
    Settings {
        name: "continuous",
        about: "all defaults but a continuous plant, `time_step` 0, with Drake's own integrator, Runge & Kutta of third order, at fixed \
                steps",
        options: &[("integration_scheme", "runge_kutta3"), ("use_error_control", "false")],
    },
    Settings {
        name: "point_stiff",
        about: "`default` with springs of 1e8 N/m and a stiction tolerance of 0.01 mm/s: little overlap and slow slip of what \
                touches in a point",
        options: &[("point_stiffness", "1e8"), SLOW],
    },
    Settings {
        name: "hydroelastic_margin",
        about: "hydroelastic contact of all shapes but spheres and capsules, which holds a face at several points: free bodies are \
                compliant with Drake's own modulus, 1e7 Pa, fixed ones rigid; a margin of 1 mm, the largest that its documentation \
                advises: contact is foreseen, so that long steps do not chatter",
        options: &[COMPLIANT, MARGIN],
    },
    Settings {
        name: "hydroelastic_stiff",
        about: "`hydroelastic_margin` with 1e9 Pa and a stiction tolerance of 0.01 mm/s: nearer to rigid bodies",
        options: &[COMPLIANT, MARGIN, ("hydroelastic_modulus", "1e9"), SLOW],
    },
    Settings {
        name: "hydroelastic_similar",
        about: "`hydroelastic_margin` with the approximation similar, \"the preferred approximation\" where strong transients must be \
                resolved",
        options: &[COMPLIANT, MARGIN, ("discrete_contact_approximation", "similar")],
    },
    Settings {
        name: "hydroelastic_sap",
        about: "`hydroelastic_margin` with the approximation SAP, which regularizes friction as its numerics need it; its \
                dissipation is a relaxation time, by default 0.1 s",
        options: &[COMPLIANT, MARGIN, ("discrete_contact_approximation", "sap")],
    },
];

const COMPLIANT: (&str, &str) = ("compliance_type", "compliant");
const MARGIN: (&str, &str) = ("margin", "0.001");
const SLOW: (&str, &str) = ("stiction_tolerance", "1e-5");

impl Settings {
    /// Whether a scene can end otherwise than with the settings before: springs are between round bodies,
    /// pressure is between others.
    pub(in crate::engine) fn differ_with(&self, surfaces: Surfaces) -> bool {
        match (self.get("compliance_type"), self.get("point_stiffness")) {
            (Some(_), _) => surfaces.flat,
            (None, None) => true,
            (None, Some(_)) => surfaces.round,
        }
    }

    /// The same with other options.
    ///
    /// # Errors
    /// There is no option of such a name.
    pub(in crate::engine) fn with(
        &self,
        name: &'static str,
        about: &'static str,
        changes: EngineOptions,
    ) -> Result<Self> {
        let known = PLANT.iter().chain(&PROXIMITY).chain(&SIMULATOR);
        option_set::check("drake", changes, known)?;
        Ok(Settings { name, about, options: [self.options, changes].concat().leak() })
    }

    pub(in crate::engine) fn get(&self, option: &str) -> Option<&'static str> {
        option_set::get(self.options, option)
    }

    /// Fields of `MultibodyPlantConfig`.
    pub(super) fn plant(&self) -> Value {
        self.fields(&PLANT)
    }

    /// Fields of `DefaultProximityProperties`.
    pub(super) fn proximity(&self) -> Value {
        self.fields(&PROXIMITY)
    }

    /// Fields of `SimulatorConfig`; none of a discrete plant.
    pub(super) fn simulator(&self) -> Value {
        self.fields(&SIMULATOR)
    }

    fn fields(&self, of: &[&str]) -> Value {
        let value = |text: &str| match (text, text.parse::<f64>()) {
            (_, Ok(number)) => number.into(),
            ("none", _) => Value::Null,
            ("true" | "false", _) => (text == "true").into(),
            _ => text.into(),
        };
        let field = |key: &&str| Some(((*key).to_owned(), value(self.get(key)?)));
        of.iter().filter_map(field).collect::<Map<_, _>>().into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn settings_are_for_what_bodies_meet_with() {
        let names = |round, flat| -> Vec<&str> {
            SETTINGS.iter().filter(|it| it.differ_with(Surfaces { round, flat })).map(|it| it.name).collect()
        };
        assert_eq!(names(false, false), ["default", "continuous"]);
        assert_eq!(names(true, false), ["default", "continuous", "point_stiff"]);
        assert_eq!(names(false, true).len(), SETTINGS.len() - 1);
        assert_eq!(names(true, true).len(), SETTINGS.len());
    }

    #[test]
    fn options_go_where_drake_has_them() {
        let changes = &[("margin", "0.002"), ("point_stiffness", "none"), ("penetration_allowance", "1e-4")];
        let similar = SETTINGS.iter().find(|it| it.name == "hydroelastic_similar").expect("there are such");
        let changed = similar.with("changed", "changed", changes).expect("all of these are options");
        assert_eq!(
            changed.proximity(),
            json!({ "compliance_type": "compliant", "point_stiffness": null, "margin": 0.002 })
        );
        let plant = changed.plant();
        assert_eq!(plant["penetration_allowance"], 1e-4);
        assert_eq!(plant["discrete_contact_approximation"], "similar");
        let steps = similar.with("steps", "steps", &[("use_error_control", "false")]).expect("an option");
        assert_eq!(steps.simulator(), json!({ "use_error_control": false }));
        assert_eq!(similar.simulator(), json!({}), "a discrete plant has no integrator");
        let wrong = similar.with("name", "about", &[("solref", "1")]).expect_err("refused").to_string();
        assert!(wrong.contains("known options: contact_model, ") && wrong.contains("margin"), "{wrong}");
    }
}
