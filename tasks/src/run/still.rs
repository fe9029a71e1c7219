//! A moment of a run that is drawn later.

use super::cameras::Cameras;
use super::view::View;
use palmares_models::Pose;
use palmares_senses::camera::Film;
use std::sync::Arc;

/// The bodies of a run at one moment, to be drawn later and on any thread.
#[derive(Clone, Debug)]
pub struct Still {
    cameras: Arc<Cameras>,
    poses: Vec<(usize, Pose)>,
}

impl Still {
    pub(super) fn new(cameras: Arc<Cameras>, poses: Vec<(usize, Pose)>) -> Self {
        Still { cameras, poses }
    }

    /// sRGB, three bytes a pixel: with shadows and smooth edges. `film` has the memory.
    pub fn picture(&self, view: &View, film: &mut Film) -> Vec<u8> {
        self.cameras.film(self.poses.iter().copied(), view, film)
    }
}

impl Cameras {
    fn film(&self, moved: impl Iterator<Item = (usize, Pose)>, view: &View, film: &mut Film) -> Vec<u8> {
        let poses = self.placed(moved);
        let at = self.optical(&poses, view.link(), view.pose());
        film.picture(self.geometry(), &poses, at, view.lens(), self.colors(), self.studio().light())
    }
}
