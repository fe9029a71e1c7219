//! Declaration of a camera in hands and tasks.

use crate::{Pose, Rotation, Vec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A depth camera with a colour image of the same view. Its optical frame has x to the right, y down and z
/// forward.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Unique among the cameras of a run: `wrist`.
    pub name: String,
    /// Link of the hand that carries it; absent for a fixed camera of a task.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub link: Option<String>,
    /// Origin of the optical frame, m: in the world for a camera of a task, in its link for one of a hand.
    #[serde(deserialize_with = "crate::exact::array")]
    pub position: [f64; 3],
    /// Orientation of the optical frame, x, y, z, w.
    #[serde(deserialize_with = "crate::exact::array")]
    pub quat_xyzw: [f64; 4],
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Horizontal field of view, degrees.
    pub fov_deg: f64,
    /// Smallest depth in an image, m.
    pub near: f64,
    /// Largest depth in an image, m.
    pub far: f64,
    /// Unit of the 16-bit depth, m.
    pub depth_unit: f64,
    /// Errors compared with an ideal camera.
    pub stereo: Stereo,
}

/// Errors of a real stereo camera in depth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stereo {
    /// Images per second.
    pub rate_hz: f64,
    /// Time from the exposure until the image is available, s.
    pub latency_s: f64,
    /// Distance between the two imagers, m; the second is to the right.
    pub baseline: f64,
    /// Standard deviation of the disparity, pixels.
    pub disparity_noise: f64,
    /// Resolution of the disparity, pixels.
    pub disparity_step: f64,
    /// Angle between surface normal and view beyond which there is no depth, degrees.
    pub grazing_deg: f64,
    /// Part of the pixels that drop out at random.
    pub dropout: f64,
}

/// Largest number of pixels of an image that a client may request.
pub const MAX_PIXELS: u64 = 1280 * 720;

impl Camera {
    /// Pose of the optical frame in the frame of its link, or of the world.
    pub fn pose(&self) -> Pose {
        let [x, y, z, w] = self.quat_xyzw;
        Pose::from_parts(Vec3::from_array(self.position), Rotation::from_xyzw(x, y, z, w).normalize())
    }

    /// Checks the numbers.
    ///
    /// # Errors
    /// The field, its value and the valid values.
    pub fn check(&self) -> Result<(), String> {
        let Camera {
            name,
            link: _,
            position,
            quat_xyzw,
            width,
            height,
            fov_deg,
            near,
            far,
            depth_unit,
            stereo,
        } = self;
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if !(1..=32).contains(&name.len()) || !name.chars().all(plain) {
            return Err(format!("name = {name:?}: 1 to 32 letters, digits and '_'"));
        }
        let within = |field: &str, value: f64, low: f64, high: f64| {
            if (low..=high).contains(&value) {
                return Ok(());
            }
            Err(format!("camera `{name}`: {field} = {value}: {low} to {high}"))
        };
        for x in position {
            within("position", *x, -10.0, 10.0)?;
        }
        let length = quat_xyzw.iter().map(|x| x * x).sum::<f64>().sqrt();
        within("length of quat_xyzw", length, 0.999, 1.001)?;
        within("fov_deg", *fov_deg, 1.0, 160.0)?;
        within("near", *near, 1e-3, 10.0)?;
        within("far", *far, near * 1.001, 100.0)?;
        within("depth_unit", *depth_unit, 1e-5, 0.1)?;
        within("far / depth_unit", far / depth_unit, 1.0, 65_535.0)?;
        let pixels = u64::from(*width) * u64::from(*height);
        if pixels == 0 || pixels > MAX_PIXELS {
            return Err(format!(
                "camera `{name}`: {width} x {height} pixels: at least one, at most 1280 x 720"
            ));
        }
        within("stereo.rate_hz", stereo.rate_hz, 0.1, 1000.0)?;
        within("stereo.latency_s", stereo.latency_s, 0.0, 1.0)?;
        within("stereo.baseline", stereo.baseline, 1e-3, 1.0)?;
        within("stereo.disparity_noise", stereo.disparity_noise, 0.0, 10.0)?;
        within("stereo.disparity_step", stereo.disparity_step, 0.0, 10.0)?;
        within("stereo.grazing_deg", stereo.grazing_deg, 1.0, 90.0)?;
        within("stereo.dropout", stereo.dropout, 0.0, 1.0)
    }
}
