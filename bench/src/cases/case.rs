//! What a case is.

use super::setup::Setup;
use crate::recorder::Recorder;
use crate::report::{Figure, Invariants};
use anyhow::Result;

/// What a case returns beside its times.
pub struct Finding {
    /// The case's own figure.
    pub error: Figure,
    /// Its checks.
    pub invariants: Invariants,
}

/// A named case.
pub struct Case {
    /// Its name.
    pub name: &'static str,
    /// One line.
    pub about: &'static str,
    /// Whether rigid-body engines without tendon compliance of ours can be asked to run it.
    pub peers: bool,
    /// Runs it.
    pub run: fn(&Setup, &mut Recorder) -> Result<Finding>,
}
