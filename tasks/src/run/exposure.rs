//! Pictures of a run.

use super::Run;
use super::cameras::{Exposure, Shot, ShotError};
use crate::observation::Sensing;

impl Run {
    /// The pictures that are asked for by `wanted`: the name of a camera for its depth, or `camera.channel` with one of
    /// `depth`, `rgb`, `bodies`.
    ///
    /// # Errors
    /// There is no such camera or channel, or it is not for this sensing.
    pub fn shots(&self, wanted: &[String], sensing: Sensing) -> Result<Vec<Shot>, ShotError> {
        self.cameras.shots(wanted, sensing)
    }

    /// Takes pictures of the world as it is, or with the latency of real cameras as it was. Nothing is drawn yet.
    pub fn expose(&self, shots: &[Shot]) -> Vec<Exposure> {
        let take = |shot: &Shot| self.cameras.expose(*shot, self.tick, &self.lately, self.poses());
        shots.iter().map(take).collect()
    }
}
