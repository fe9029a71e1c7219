//! What the referee knows at a moment, for those who ask why an object counts.

use crate::referee::{ObjectSnapshot, ObjectStatus, Referee};

/// A copy of what the referee knows, to be explained where no world waits.
#[derive(Clone, Debug)]
pub struct Evidence {
    pub(super) tick: u64,
    pub(super) referee: Referee,
    pub(super) objects: Vec<ObjectSnapshot>,
    /// m/s
    pub(super) speeds: Vec<f64>,
}

impl Evidence {
    /// The referee's verdict on each object.
    pub fn explain(&self) -> Vec<ObjectStatus> {
        self.referee.explain(self.tick, &self.objects, &self.speeds)
    }
}
