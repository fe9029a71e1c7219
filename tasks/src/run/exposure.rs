//! Pictures of a run.

use super::Run;
use super::cameras::Exposure;
use super::shots::{Shot, ShotError, shots};
use crate::observation::Sensing;
use std::sync::Arc;

impl Run {
    /// The pictures that are asked for by `wanted`: see [`shots`].
    ///
    /// # Errors
    /// There is no such camera or channel, or it is not for this sensing.
    pub fn shots(&self, wanted: &[String], sensing: Sensing) -> Result<Vec<Shot>, ShotError> {
        shots(&self.task, &self.hand, wanted, sensing)
    }

    /// Takes pictures of the world as it is, or with the latency of real cameras as it was. Nothing is drawn yet.
    pub fn expose(&mut self, shots: &[Shot]) -> Vec<Arc<Exposure>> {
        let mut image_cache = std::mem::take(&mut self.image_cache);
        let take = |shot: &Shot| {
            self.cameras.expose(*shot, self.tick, &mut image_cache, &self.pose_history, self.poses())
        };
        let taken = shots.iter().map(take).collect();
        self.image_cache = image_cache;
        taken
    }

    /// Pictures that real cameras have taken and that [`Run::expose`] will give in their next period: who has time may
    /// draw them before they are asked for.
    pub fn upcoming(&mut self, shots: &[Shot]) -> Vec<Arc<Exposure>> {
        let Run { cameras, image_cache, pose_history, tick, .. } = self;
        shots.iter().filter_map(|shot| cameras.upcoming(*shot, *tick, image_cache, pose_history)).collect()
    }
}
