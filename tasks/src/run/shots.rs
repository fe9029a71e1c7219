//! Which pictures are asked for, by the words of a controller. Task and hand are enough to tell, before there is a run.

use crate::observation::Sensing;
use crate::task::Task;
use palmares_models::camera::Camera;
use palmares_models::hand::Hand;

/// Kinds of camera images.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Channels {
    pub(super) depth: bool,
    pub(super) rgb: bool,
    pub(super) bodies: bool,
}

/// A picture that is wanted of a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shot {
    /// Its place among the task's cameras and, after them, the hand's.
    pub(super) camera: usize,
    pub(super) channels: Channels,
}

/// Why pictures cannot be taken.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ShotError {
    /// There is no such camera.
    #[error("no camera `{name}`; there are: {known}")]
    Unknown {
        /// What was asked for.
        name: String,
        /// The cameras of the run.
        known: String,
    },
    /// There is no such channel.
    #[error("camera `{camera}` has no channel `{channel}`; there are: depth, rgb, bodies")]
    Channel {
        /// The camera.
        camera: String,
        /// What was asked for.
        channel: String,
    },
    /// Bodies are part of the truth.
    #[error("which body a pixel shows is told with sensing \"truth\" only")]
    Hidden,
}

/// The name of a camera of a hand in a task, which may have one of the same name.
pub fn camera_name(task: &Task, camera: &Camera) -> String {
    let taken = camera.link.is_some() && task.cameras.iter().any(|other| other.name == camera.name);
    if taken { format!("hand_{}", camera.name) } else { camera.name.clone() }
}

/// The pictures that are asked for by `wanted`: the name of a camera for its depth, or `camera.channel` with one of
/// `depth`, `rgb`, `bodies`.
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
        let (name, channel) = wanted.split_once('.').unwrap_or((wanted, "depth"));
        let camera = known.iter().position(|camera| camera == name).ok_or_else(|| ShotError::Unknown {
            name: name.chars().take(64).collect(),
            known: known.join(", "),
        })?;
        let place = shots.iter().position(|shot| shot.camera == camera).unwrap_or_else(|| {
            shots.push(Shot { camera, channels: Channels::default() });
            shots.len() - 1
        });
        let channels = &mut shots[place].channels;
        match channel {
            "depth" => channels.depth = true,
            "rgb" => channels.rgb = true,
            "bodies" if sensing == Sensing::Truth => channels.bodies = true,
            "bodies" => return Err(ShotError::Hidden),
            _ => {
                let channel = channel.chars().take(64).collect();
                return Err(ShotError::Channel { camera: name.to_owned(), channel });
            }
        }
    }
    Ok(shots)
}
