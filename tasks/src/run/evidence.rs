//! The knowledge of the referee after a tick, which explains why an object counts.

use crate::referee::{ObjectSnapshot, ObjectStatus};
use crate::task::AnyReferee;

/// A copy of the referee and its input, so that another thread than the world's can explain it.
#[derive(Clone, Debug)]
pub struct Evidence {
    pub(super) tick: u64,
    pub(super) referee: AnyReferee,
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
