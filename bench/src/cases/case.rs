//! A case.

use super::setup::Setup;
use crate::case_report::{Figure, Invariants};
use crate::recorder::Recorder;
use anyhow::Result;

/// The result of a case without its times.
pub struct Finding {
    /// The case's own figure.
    pub error: Figure,
    /// Its checks.
    pub invariants: Invariants,
}

impl Recorder {
    /// The result with a case's figure and the checks that every case has.
    pub(super) fn finding(&self, error: Figure) -> Finding {
        Finding { error, invariants: self.invariants() }
    }
}

impl Finding {
    /// Adds the energy that appeared from nowhere, J.
    pub(super) fn with_energy_gain(mut self, gain_j: f64) -> Self {
        self.invariants.energy_gain_j = Some(gain_j);
        self
    }

    /// Adds the largest relative error of contact forces, 1.
    pub(super) fn with_force_error(mut self, part: f64) -> Self {
        self.invariants.force_error_percent = Some(100.0 * part);
        self
    }
}

/// A named case.
pub struct Case {
    /// Its name.
    pub name: &'static str,
    /// One line.
    pub about: &'static str,
    /// Whether rigid-body engines without our tendon compliance can run it.
    pub peers: bool,
    /// Runs it.
    pub run: Run,
}

/// Runs a case under a setup.
type Run = fn(&Setup, &mut Recorder) -> Result<Finding>;

impl Case {
    /// A case that every engine can run.
    pub(super) const fn new(name: &'static str, about: &'static str, run: Run) -> Self {
        Case { name, about, peers: true, run }
    }

    /// A case that only our engine can run.
    pub(super) const fn ours(name: &'static str, about: &'static str, run: Run) -> Self {
        Case { name, about, peers: false, run }
    }
}
