//! Pictures of the present world by ideal cameras of any size, for learners and films. The images of real cameras, with their
//! latency and errors, are those of [`Run::expose`].

use super::Run;
use super::shots::{ShotError, camera_name};
use super::studio::{FILM, FILM_SIZE};
use palmares_models::Pose;
use palmares_models::camera::MAX_PIXELS;
use palmares_senses::camera::{GBuffer, Intrinsics, shade};

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

fn sized((width, height): (u32, u32)) -> Result<(u32, u32), ViewError> {
    let pixels = u64::from(width) * u64::from(height);
    if (1..=MAX_PIXELS).contains(&pixels) {
        Ok((width, height))
    } else {
        Err(ViewError::Size { width, height })
    }
}

impl Run {
    /// The view of a camera of task or hand, with its own number of pixels or another; its horizontal field of view stays. The name
    /// [`FILM`] is that of a view which shows fingers and objects, unless a camera has it.
    ///
    /// # Errors
    /// There is no such camera, too many pixels, or none.
    pub fn view(&self, name: &str, size: Option<(u32, u32)>) -> Result<View, ViewError> {
        let cameras = || self.task.cameras.iter().chain(&self.hand.sensors.cameras);
        let Some(camera) = cameras().find(|camera| camera_name(&self.task, camera) == name) else {
            if name == FILM {
                return Ok(self.film_view(sized(size.unwrap_or(FILM_SIZE))?));
            }
            let known = cameras().map(|camera| camera_name(&self.task, camera)).chain([FILM.to_owned()]);
            let known = known.collect::<Vec<_>>().join(", ");
            return Err(ShotError::Unknown { name: name.chars().take(64).collect(), known }.into());
        };
        let (width, height) = sized(size.unwrap_or((camera.width, camera.height)))?;
        let lens = Intrinsics::new(width, height, camera.fov_deg, camera.near, camera.far);
        let link = camera.link.as_deref().and_then(|link| self.hand.link(link));
        Ok(View { lens, pose: camera.pose(), link })
    }

    /// The view of a camera that no task has: its optical frame at a pose in a link or in the world, with a horizontal field of
    /// view in degrees.
    ///
    /// # Errors
    /// There is no such link, too many pixels, or none.
    pub fn own_view(
        &self,
        pose: Pose,
        link: Option<&str>,
        fov_deg: f64,
        size: (u32, u32),
        range_m: (f64, f64),
    ) -> Result<View, ViewError> {
        let (width, height) = sized(size)?;
        let index = |name: &str| {
            self.hand.link(name).ok_or_else(|| {
                let known: Vec<&str> = self.hand.links.iter().map(|link| link.name.as_str()).collect();
                ViewError::Link { name: name.chars().take(64).collect(), known: known.join(", ") }
            })
        };
        let link = link.map(index).transpose()?;
        Ok(View { lens: Intrinsics::new(width, height, fov_deg, range_m.0, range_m.1), pose, link })
    }

    /// Draws the present world: depth and body of every pixel, with normals for [`Run::colours`].
    pub fn draw(&self, view: &View, image: &mut GBuffer) {
        self.cameras.draw(self.poses(), view.link, view.pose, &view.lens, image);
    }

    /// sRGB of a drawn image with normals, three bytes a pixel.
    pub fn colours(&self, view: &View, image: &GBuffer) -> Vec<u8> {
        shade(image, &view.lens, self.cameras.colors())
    }
}
