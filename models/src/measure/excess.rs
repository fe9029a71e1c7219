//! Figures of a hand that exceed a competition's limits.

use std::fmt;

use super::figures::{Figure, number};
use super::limits::{Bound, HandLimits, Spec};
use super::sources::{SourceLocation, Sources};

/// A figure beyond its limit.
#[derive(Clone, Debug, PartialEq)]
pub struct Excess {
    /// The figure.
    pub spec: &'static Spec,
    /// Its value.
    pub found: f64,
    /// The limit.
    pub limit: f64,
    /// File and element that state it.
    pub location: SourceLocation,
    /// Whether it is the size of a mesh: its unit may be wrong.
    pub of_mesh: bool,
}

impl fmt::Display for Excess {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Spec { name, unit, what, bound, .. } = self.spec;
        let side = if *bound == Bound::Most { "at most" } else { "at least" };
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        let (found, limit) = (number(self.found), number(self.limit));
        write!(
            f,
            "{}: {what} is {found}{unit}; valid: {side} {limit}{unit} (hand_limits.{name})",
            self.location
        )?;
        if self.of_mesh {
            write!(f, "; a mesh in millimetres needs scale=\"0.001 0.001 0.001\"")?;
        }
        Ok(())
    }
}

impl HandLimits {
    /// The figures that exceed limits, each with the file and element that state it.
    pub fn excesses(&self, figures: &[Figure], sources: &Sources) -> Vec<Excess> {
        let beyond = |figure: &&Figure| !self.allows(figure);
        let excess = |figure: &Figure| Excess {
            spec: figure.spec,
            found: figure.value,
            limit: self.of(figure.spec.name),
            location: sources.location(figure),
            of_mesh: figure.of_mesh,
        };
        figures.iter().filter(beyond).map(excess).collect()
    }

    /// Whether a figure is within its limit.
    pub fn allows(&self, figure: &Figure) -> bool {
        let limit = self.of(figure.spec.name);
        match figure.spec.bound {
            Bound::Most => figure.value <= limit,
            Bound::Least => figure.value >= limit,
        }
    }
}
