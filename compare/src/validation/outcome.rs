//! A study, how much of it is measured, and what came of it.

use super::ends::Ends;
use anyhow::Result;
use palmares_bench::cases::Setup;
use palmares_bench::measured::{Measured, Spread};
use serde_json::{Value, json};

/// What a row tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A number of the hand was chosen so that ours agrees: the row tests nothing.
    Calibration,
    /// No number of the hand was chosen for it.
    Prediction,
}

impl Kind {
    /// As on the page.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Kind::Calibration => "calibration",
            Kind::Prediction => "prediction",
        }
    }
}

/// Plays a measurement at both ends of the hand's uncertain ranges; none where these say nothing.
pub(crate) type PlayEnds = fn(&Effort) -> Result<Option<Ends>>;

/// A published measurement and ours.
pub(crate) struct Study {
    /// Its name in the line of JSON.
    pub(crate) key: &'static str,
    /// Whether a number of the hand was fitted to it.
    pub(crate) kind: Kind,
    /// Its heading.
    pub(crate) title: &'static str,
    /// The publication.
    pub(crate) source: &'static str,
    /// The experiment there.
    pub(crate) protocol: &'static str,
    /// The experiment here.
    pub(crate) here: &'static str,
    /// The published number; none where none was found.
    pub(crate) published: Option<f64>,
    /// The publication's own words for it.
    pub(crate) theirs: &'static str,
    /// Its unit.
    pub(crate) unit: &'static str,
    /// Why ours differs.
    pub(crate) why: &'static str,
    /// Takes ours; empty where the hand is not built in.
    pub(crate) measure: fn(&Effort) -> Result<Vec<Measured>>,
    /// Takes ours with each uncertain number of the hand at the ends of its range; none where it is not taken.
    pub(crate) ends: Option<PlayEnds>,
}

/// How much is measured.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// Our engine at the step of the measurement.
    pub(crate) setup: Setup,
    /// Whether few placements do.
    pub(crate) few: bool,
}

/// A study with what was measured: the compared quantity first.
pub(crate) struct Outcome {
    pub(crate) study: &'static Study,
    pub(crate) measured: Vec<Measured>,
    pub(crate) ends: Option<Ends>,
}

impl Outcome {
    /// Mean and range of the compared quantity; none where no placement held the object.
    pub(crate) fn spread(&self) -> Option<Spread> {
        self.measured.first().and_then(Measured::spread)
    }

    /// Its values, for the line of JSON. A number that is missing is null.
    pub(super) fn entry(&self) -> Value {
        let spread = self.spread();
        let of = |part: fn(Spread) -> f64| spread.map(part).filter(|x| x.is_finite());
        let first = self.measured.first();
        json!({
            "kind": self.study.kind.name(),
            "published": self.study.published,
            "unit": self.study.unit,
            "ours_mean": of(|s| s.mean),
            "ours_min": of(|s| s.least),
            "ours_max": of(|s| s.largest),
            "placements": first.map_or(0, |m| m.placements.len()),
            "lost": first.map_or(0, Measured::lost),
        })
    }
}
