//! A camera that draws the present world.

use super::shots::ShotError;
use palmares_models::Pose;
use palmares_models::camera::MAX_PIXELS;
use palmares_senses::camera::Intrinsics;

/// A camera and the number of its pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    lens: Intrinsics,
    /// Pose of the optical frame: in a link, or in the world.
    pose: Pose,
    link: Option<usize>,
}

/// The reason why there is no such view.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ViewError {
    /// There is no such camera.
    #[error(transparent)]
    Camera(#[from] ShotError),
    /// There is no such link.
    #[error("no link `{name}`; there are: {known}")]
    Link {
        /// The name in the request.
        name: String,
        /// The links of the hand.
        known: String,
    },
    /// Too many pixels, or none.
    #[error("a picture of {width} × {height} pixels; wanted 1 to {MAX_PIXELS} of them")]
    Size {
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
    },
}

impl View {
    pub(super) fn new(lens: Intrinsics, pose: Pose, link: Option<usize>) -> Self {
        View { lens, pose, link }
    }

    pub(super) fn pose(&self) -> Pose {
        self.pose
    }

    pub(super) fn link(&self) -> Option<usize> {
        self.link
    }

    /// Its intrinsics.
    pub fn lens(&self) -> &Intrinsics {
        &self.lens
    }
}
