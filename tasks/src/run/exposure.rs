//! Images of a run.

use super::Run;
use super::cameras::Exposure;
use super::shots::{Shot, ShotError, shots};
use crate::sensing::Sensing;
use std::sync::Arc;

impl Run {
    /// The images that `wanted` names: see [`shots`].
    ///
    /// # Errors
    /// There is no such camera or channel, or it is not for this sensing.
    pub fn shots(&self, wanted: &[String], sensing: Sensing) -> Result<Vec<Shot>, ShotError> {
        shots(&self.task, &self.hand, wanted, sensing)
    }

    /// Exposes images of the present world or, with the latency of real cameras, of an earlier one. It renders nothing.
    pub fn expose(&mut self, shots: &[Shot]) -> Vec<Arc<Exposure>> {
        let mut image_cache = std::mem::take(&mut self.image_cache);
        let take = |shot: &Shot| {
            self.cameras.expose(*shot, self.tick, &mut image_cache, &self.pose_history, self.poses())
        };
        let taken = shots.iter().map(take).collect();
        self.image_cache = image_cache;
        taken
    }

    /// Images that real cameras have exposed and that [`Run::expose`] returns in their next period. A thread with time to spare can
    /// render them before a request names them.
    pub fn upcoming(&mut self, shots: &[Shot]) -> Vec<Arc<Exposure>> {
        let Run { cameras, image_cache, pose_history, tick, .. } = self;
        shots.iter().filter_map(|shot| cameras.upcoming(*shot, *tick, image_cache, pose_history)).collect()
    }
}
