//! A run at tick 0, from which a referee begins.

use super::snapshot::ObjectSnapshot;
use super::space::Corners;

/// A run at tick 0.
pub(crate) struct RunStart<'a> {
    /// Length of a tick, s.
    pub(crate) tick_s: f64,
    /// Regions of the task, by name.
    pub(crate) regions: Vec<(&'a str, Corners)>,
    /// Names of the objects, in scene order; none if they differ from seed to seed.
    pub(crate) names: Vec<String>,
    /// The objects, in scene order.
    pub(crate) objects: &'a [ObjectSnapshot],
}

impl RunStart<'_> {
    /// The region of a name.
    pub(crate) fn region(&self, name: &str) -> Option<Corners> {
        self.regions.iter().find(|(known, _)| *known == name).map(|(_, corners)| *corners)
    }

    /// Index of the object of a name, in scene order.
    pub(crate) fn object(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|known| known == name)
    }
}
