//! The images that a request names. Task and hand determine them, before there is a run.

use crate::sensing::Sensing;
use crate::task::Task;
use palmares_models::camera::Camera;
use palmares_models::hand::Hand;
use palmares_senses::channels::cameras::{DEPTH, IMAGES, ImageChannel};

/// The images of one exposure of a camera that are wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shot {
    /// Index of the camera: the task's, then the hand's.
    pub(super) camera: usize,
    /// The wanted images, in the order of [`IMAGES`].
    images: [bool; IMAGES.len()],
}

impl Shot {
    /// Whether this image is wanted.
    pub(super) fn has(&self, image: &ImageChannel) -> bool {
        IMAGES.iter().zip(self.images).any(|(known, wanted)| wanted && known.name == image.name)
    }
}

/// Error of an image that cannot be taken.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ShotError {
    /// There is no such camera.
    #[error("no camera `{name}`; there are: {known}")]
    Unknown {
        /// The name in the request.
        name: String,
        /// The cameras of the run.
        known: String,
    },
    /// There is no such channel.
    #[error("camera `{camera}` has no channel `{channel}`; there are: {known}")]
    Channel {
        /// The camera.
        camera: String,
        /// The channel in the request.
        channel: String,
        /// The channels of cameras.
        known: String,
    },
    /// Bodies are part of the truth.
    #[error("the bodies of the pixels need sensing \"truth\"")]
    Hidden,
}

/// The name of a camera of a hand in a task, which may have one of the same name.
pub fn camera_name(task: &Task, camera: &Camera) -> String {
    let taken = camera.link.is_some() && task.cameras.iter().any(|other| other.name == camera.name);
    if taken { format!("hand_{}", camera.name) } else { camera.name.clone() }
}

/// The images that a request names: by the name of a camera for its depth, or by `camera.channel` with the name of one of
/// [`IMAGES`].
///
/// # Errors
/// There is no such camera or channel, or it is not for this sensing.
pub fn shots(task: &Task, hand: &Hand, wanted: &[String], sensing: Sensing) -> Result<Vec<Shot>, ShotError> {
    if wanted.is_empty() {
        return Ok(Vec::new());
    }
    let cameras = task.cameras.iter().chain(&hand.sensors.cameras);
    let known: Vec<String> = cameras.map(|camera| camera_name(task, camera)).collect();
    let mut shots: Vec<Shot> = Vec::new();
    for wanted in wanted {
        let (name, channel) = wanted.split_once('.').unwrap_or((wanted, DEPTH.name));
        let camera = known.iter().position(|camera| camera == name).ok_or_else(|| ShotError::Unknown {
            name: name.chars().take(64).collect(),
            known: known.join(", "),
        })?;
        let place = shots.iter().position(|shot| shot.camera == camera).unwrap_or_else(|| {
            shots.push(Shot { camera, images: Default::default() });
            shots.len() - 1
        });
        let Some(image) = IMAGES.iter().position(|image| image.name == channel) else {
            let channel = channel.chars().take(64).collect();
            let known = IMAGES.map(|image| image.name).join(", ");
            return Err(ShotError::Channel { camera: name.to_owned(), channel, known });
        };
        if IMAGES[image].truth && sensing != Sensing::Truth {
            return Err(ShotError::Hidden);
        }
        shots[place].images[image] = true;
    }
    Ok(shots)
}
