//! Which figures of a hand go beyond a competition's limits.

use std::fmt;

use super::figures::{Figure, number};
use super::limits::{Bound, HandLimits, Spec};
use super::sources::{SourceLocation, Sources};

/// A figure beyond its limit.
#[derive(Clone, Debug, PartialEq)]
pub struct Excess {
    /// What it is.
    pub spec: &'static Spec,
    /// What was found.
    pub found: f64,
    /// What is allowed.
    pub limit: f64,
    /// Which file and element states it.
    pub location: SourceLocation,
    /// Whether it is the size of something made of meshes: their unit may be wrong.
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
    /// The figures that go beyond, each with the file and element that states it.
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
