//! Named settings of rapier. An option has the name of its field in `IntegrationParameters`.

use crate::engine::option_set::{Dimension, EngineOptions, FoundSettings};
use anyhow::{Context, Result, bail};
use palmares_bench::engine::RIGID;
use palmares_sim::Model;
use rapier3d_f64::dynamics::{FrictionModel, IntegrationParameters, SpringCoefficients};

/// Effort of rapier's solver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Effort {
    friction: FrictionModel,
    /// `num_solver_iterations`: each solves and moves the bodies by its part of the step.
    substeps: usize,
    /// `num_internal_pgs_iterations`: Gauss-Seidel sweeps of each.
    sweeps: usize,
}

/// The options of rapier that settings choose; the others keep rapier's defaults.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// As on the command line.
    pub name: &'static str,
    /// Description, with the reason for the values.
    pub about: &'static str,
    /// Typical length of the scene, m: rapier's tolerances are multiples of it.
    length_unit_m: f64,
    /// Frequency of contact springs, Hz: between free bodies, and with fixed ones.
    contact_hz: [f64; 2],
    /// Damping ratio of contact springs.
    damping_ratio: f64,
    /// Whether friction also acts in the pass that removes overlap.
    friction_in_bias_pass: bool,
    /// Whether contacts are foreseen as far as ours, and those of rigid bodies are as hard as the sub-steps resolve.
    fitted: bool,
    /// Whether reports play it only in scenes with a hand.
    pub(in crate::engine) hands_alone: bool,
    hand: Effort,
    free: Effort,
    /// Options that are changed last.
    pub(in crate::engine) changes: EngineOptions,
}

const COULOMB: FrictionModel = FrictionModel::Coulomb;
const SIMPLIFIED: FrictionModel = FrictionModel::Simplified;

/// All of them; the first are rapier's own.
pub const SETTINGS: &[Settings] = &[
    Settings {
        name: "default",
        about: "`IntegrationParameters::default()`: 4 solver iterations, contacts of 30 Hz (60 Hz with fixed bodies), damping \
                ratio 10, simplified friction",
        length_unit_m: 1.0,
        contact_hz: [30.0, 60.0],
        damping_ratio: 10.0,
        friction_in_bias_pass: false,
        fitted: false,
        hands_alone: false,
        hand: Effort { friction: SIMPLIFIED, substeps: 4, sweeps: 1 },
        free: Effort { friction: SIMPLIFIED, substeps: 4, sweeps: 1 },
        changes: &[],
    },
    STIFF120,
    Settings {
        name: "stiff120_2_steps",
        about: "the same with 2 sub-steps with a hand",
        hand: Effort { friction: COULOMB, substeps: 2, sweeps: 32 },
        hands_alone: true,
        ..STIFF120
    },
    Settings {
        name: "stiff120_4_steps",
        about: "the same with 4 sub-steps with a hand",
        hand: Effort { friction: COULOMB, substeps: 4, sweeps: 32 },
        hands_alone: true,
        ..STIFF120
    },
];

/// It keeps the cylinder at 8 and 16 ms from all starts, at 1.7 and 1.6 s of CPU a simulated second, and at 2 ms from two of eight.
pub const FOUND: &[FoundSettings] = &[FoundSettings {
    settings: "stiff120_4_steps+num_solver_iterations=8",
    scenes: &["softhand_cylinder", "grasps"],
}];

/// Contacts of 120 Hz: the default of 30 Hz lets links of a few grams sink.
///
/// With a hand one sub-step, since more would re-use a tension that was found for a whole step, and so the effort goes
/// into sweeps (16 hold less, 4 nothing). Free bodies are what rapier's sub-steps are made for; there its Coulomb model
/// loses 6 % of a cube's friction, and the simplified one is exact.
pub const STIFF120: Settings = Settings {
    name: "stiff120",
    about: "contacts of 120 Hz and damping ratio 5 (of rigid bodies a quarter of the rate of sub-steps), friction also in the \
            bias pass, length_unit 0.05, contacts foreseen over 2 mm + h · 1 m/s as ours; with a hand 1 sub-step of 32 sweeps \
            and Coulomb friction (16 sweeps hold less, 4 nothing), free bodies 4 sub-steps of 2 sweeps and simplified friction \
            (Coulomb stops a sliding cube 7 % late)",
    length_unit_m: 0.05,
    contact_hz: [120.0, 120.0],
    damping_ratio: 5.0,
    friction_in_bias_pass: true,
    fitted: true,
    hands_alone: false,
    hand: Effort { friction: COULOMB, substeps: 1, sweeps: 32 },
    free: Effort { friction: SIMPLIFIED, substeps: 4, sweeps: 2 },
    changes: &[],
};

/// A search changes these options, one at a time.
pub const SPACE: &[Dimension] = &[
    Dimension("num_solver_iterations", &["1", "2", "4", "8"]),
    Dimension("num_internal_pgs_iterations", &["1", "4", "16", "32", "64"]),
    Dimension("num_internal_stabilization_iterations", &["0", "2", "4"]),
    Dimension("natural_frequency", &["30", "60", "120", "240", "480", "1000"]),
    Dimension("damping_ratio", &["0.5", "1", "2", "5", "10"]),
    Dimension("friction_model", &["coulomb", "simplified"]),
    Dimension("friction_in_bias_pass", &["true", "false"]),
    Dimension("length_unit", &["0.02", "0.05", "0.1", "1"]),
    Dimension("normalized_max_corrective_velocity", &["0.2", "1", "10", "40"]),
    Dimension("normalized_prediction_distance", &["0.02", "0.1"]),
    Dimension("normalized_allowed_linear_error", &["0.0005"]),
    Dimension("warmstart_coefficient", &["0", "0.9"]),
    Dimension("max_ccd_substeps", &["0", "4"]),
];

impl Settings {
    /// The same with other options.
    ///
    /// # Errors
    /// There is no option of such a name, or it has no such value.
    pub(in crate::engine) fn with(
        &self,
        name: &'static str,
        about: &'static str,
        changes: EngineOptions,
    ) -> Result<Self> {
        let mut tried = IntegrationParameters::default();
        for (option, value) in changes {
            change(&mut tried, option, value)?;
        }
        Ok(Settings { name, about, changes, ..*self })
    }

    /// Sets rapier up for a scene.
    pub(super) fn apply(&self, parameters: &mut IntegrationParameters, model: &Model) {
        let config = model.config();
        let Effort { friction, substeps, sweeps } =
            if model.hand().is_some() { self.hand } else { self.free };
        parameters.friction_model = friction;
        parameters.num_solver_iterations = substeps;
        parameters.num_internal_pgs_iterations = sweeps;
        parameters.length_unit = self.length_unit_m;
        parameters.friction_in_bias_pass = self.friction_in_bias_pass;
        // Impulses are read from the manifolds, which clusters would leave out; our scenes have few composites.
        parameters.contact_recycling = false;
        parameters.contact_clustering = false;
        parameters.normalized_max_linear_velocity = f64::MAX;
        let mut contact_hz = self.contact_hz;
        if self.fitted {
            parameters.normalized_prediction_distance = config.margin(false) / self.length_unit_m;
            if config.contact_stiffness >= RIGID {
                let resolved = 0.25 * substeps as f64 / config.step_s;
                contact_hz = contact_hz.map(|hz| hz.max(resolved));
            }
        }
        let [softness, fixed] = contact_hz.map(|natural_frequency| SpringCoefficients {
            natural_frequency,
            damping_ratio: self.damping_ratio,
        });
        parameters.contact_softness = softness;
        parameters.static_contact_softness = fixed;
        for (option, value) in self.changes {
            // It has been tried in `with`.
            let _ = change(parameters, option, value);
        }
    }
}

/// Sets an option; `natural_frequency` and `damping_ratio` are those of all contacts.
fn change(parameters: &mut IntegrationParameters, option: &str, value: &str) -> Result<()> {
    let number = || value.parse::<f64>().with_context(|| format!("{option}: `{value}` is no number"));
    let count = || value.parse::<usize>().with_context(|| format!("{option}: `{value}` is no count"));
    let flag = || value.parse::<bool>().with_context(|| format!("{option}: `{value}` is not true or false"));
    let p = parameters;
    match option {
        "num_solver_iterations" => p.num_solver_iterations = count()?,
        "num_internal_pgs_iterations" => p.num_internal_pgs_iterations = count()?,
        "num_internal_stabilization_iterations" => p.num_internal_stabilization_iterations = count()?,
        "max_ccd_substeps" => p.max_ccd_substeps = count()?,
        "natural_frequency" => {
            p.contact_softness.natural_frequency = number()?;
            p.static_contact_softness.natural_frequency = number()?;
        }
        "damping_ratio" => {
            p.contact_softness.damping_ratio = number()?;
            p.static_contact_softness.damping_ratio = number()?;
        }
        "friction_model" => {
            p.friction_model = match value {
                "coulomb" => COULOMB,
                "simplified" => SIMPLIFIED,
                _ => bail!("{option}: `{value}` is not coulomb or simplified"),
            }
        }
        "friction_in_bias_pass" => p.friction_in_bias_pass = flag()?,
        "length_unit" => p.length_unit = number()?,
        "normalized_max_corrective_velocity" => p.normalized_max_corrective_velocity = number()?,
        "normalized_prediction_distance" => p.normalized_prediction_distance = number()?,
        "normalized_allowed_linear_error" => p.normalized_allowed_linear_error = number()?,
        "warmstart_coefficient" => p.warmstart_coefficient = number()?,
        _ => bail!("unknown option `{option}` of rapier"),
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_option_of_the_search_can_be_set_to_each_of_its_values() {
        for Dimension(option, values) in SPACE {
            for value in *values {
                let mut parameters = IntegrationParameters::default();
                change(&mut parameters, option, value).expect("it is an option");
            }
        }
        let wrong = STIFF120.with("name", "about", &[("damping", "1")]).expect_err("refused").to_string();
        assert!(wrong.contains("unknown option `damping`"), "{wrong}");
    }
}
