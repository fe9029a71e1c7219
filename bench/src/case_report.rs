//! The report of one run of a case.

use crate::measured::Measured;
use serde::{Deserialize, Serialize};

/// One JSON object per run of a case.
#[derive(Clone, Debug, Serialize)]
pub struct CaseReport {
    /// Name of the case.
    pub case: String,
    /// Name of the engine: `own`, `rapier`, `mujoco`, `drake`.
    pub engine: String,
    /// Name of its settings.
    pub settings: String,
    /// Step, s.
    pub dt_s: f64,
    /// Simulated time per CPU time of the thread.
    pub rtf: f64,
    /// CPU time per step, µs.
    pub us_per_step: Times,
    /// The case's own figure.
    pub error: Figure,
    /// The measurements of the case on a hand, if it repeats a published one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub measured: Vec<Measured>,
    /// Checks of the run; null where the case has none.
    pub invariants: Invariants,
}

/// CPU time per step, µs.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Times {
    /// Kinematics, mass matrix, bias.
    pub dynamics: f64,
    /// Broad and narrow phase.
    pub collision: f64,
    /// Islands, Newton, integration.
    pub solver: f64,
    /// Everything.
    pub total: f64,
    /// The slowest step.
    pub worst: f64,
}

/// A named number.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Figure {
    /// Its name.
    pub name: String,
    /// The number; null when the reference run was left out.
    pub value: Option<f64>,
    /// Its unit.
    pub unit: String,
    /// The bound, where no smaller value is better: such a figure describes the outcome, not an error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub within: Option<f64>,
    /// Whether it is the difference from the same scene on the same engine at a far smaller step. It measures how much the
    /// outcome depends on the step, not whether the outcome is right.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub from_own_fine_run: bool,
}

impl Figure {
    /// An error: the nearer to zero the better.
    pub fn new(name: &str, value: f64, unit: &str) -> Self {
        Figure {
            name: name.to_owned(),
            value: Some(value),
            unit: unit.to_owned(),
            within: None,
            from_own_fine_run: false,
        }
    }

    /// A difference from the engine's own run at a far smaller step; without a value when that was left out.
    pub fn from_own_fine_run(name: &str, value: Option<f64>, unit: &str) -> Self {
        Figure { value, from_own_fine_run: true, ..Figure::new(name, 0.0, unit) }
    }

    /// A figure that must stay `within` a bound; below it, no value is better than another.
    pub fn bounded(name: &str, value: f64, unit: &str, within: f64) -> Self {
        Figure { within: Some(within), ..Figure::new(name, value, unit) }
    }
}

/// Checks of a run.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Invariants {
    /// The object is still in the hand at the end.
    pub held: Option<bool>,
    /// Speed of the object against the palm while held still, mm/s.
    pub slip_mm_s: Option<f64>,
    /// Deepest overlap of shapes, mm.
    pub max_penetration_mm: Option<f64>,
    /// Bound of the overlap of shapes, mm ([`crate::overlap`]): of several worlds, that of the world nearest
    /// to its bound.
    pub overlap_bound_mm: Option<f64>,
    /// The deepest overlap there, as a part of the bound.
    pub overlap_of_bound: Option<f64>,
    /// Deepest overlap of shapes at the end of the hold, mm.
    pub hold_penetration_mm: Option<f64>,
    /// Standard deviation of the tension while held still, in the tendon's unit.
    pub tension_chatter: Option<f64>,
    /// Largest unbalanced joint torque at the end of the hold, N·m.
    pub static_residual_nm: Option<f64>,
    /// Largest difference of a tension from its cable's law, `clamp(K (s − R q) − b R q̇, 0, f_max)`, at the end of
    /// the hold, N·m.
    pub tension_balance_nm: Option<f64>,
    /// Steps in which Newton did not reach its tolerance.
    pub newton_unconverged: Option<u64>,
    /// Energy that appeared from nowhere, J.
    pub energy_gain_j: Option<f64>,
    /// Largest relative error of contact forces that statics knows, %.
    pub force_error_percent: Option<f64>,
    /// Largest change of the angular momentum where nothing turns the scene from outside, % of the largest.
    pub momentum_error_percent: Option<f64>,
}
