//! Sensors of a hand and their accuracy. The simulation computes their readings.

use crate::camera::Camera;
use crate::{Pose, Vec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A tactile patch: a rectangle on the hand's surface, in the xy-plane of its frame, centred on it; z points
/// out of the hand. Equal taxels divide it without gaps.
#[derive(Clone, Debug)]
pub struct TactilePatch {
    /// Unique in the hand: `finger_1_distal`.
    pub name: String,
    /// Index into the hand's links.
    pub link: usize,
    /// Frame of the patch.
    pub link_from_patch: Pose,
    /// Half the extents along x and y, m.
    pub half_size: [f64; 2],
    /// Taxels along x and y.
    pub taxels: [usize; 2],
}

impl TactilePatch {
    /// Number of its taxels.
    pub fn len(&self) -> usize {
        self.taxels[0] * self.taxels[1]
    }

    /// Whether it has none; never the case in a valid hand.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The names of its taxels, along x first: its own name if it has one taxel, else numbered from 1 on.
    pub fn taxel_names(&self) -> impl Iterator<Item = String> {
        let alone = self.len() == 1;
        (1..=self.len()).map(move |k| if alone { self.name.clone() } else { format!("{}_{k}", self.name) })
    }

    /// Centre of a taxel in the frame of the patch, m.
    pub fn taxel_center(&self, taxel: usize) -> Vec3 {
        let [nx, ny] = self.taxels;
        let at = |k: usize, n: usize, half: f64| half * ((2 * k + 1) as f64 / n as f64 - 1.0);
        Vec3::new(at(taxel % nx, nx, self.half_size[0]), at(taxel / nx, ny, self.half_size[1]), 0.0)
    }
}

/// Properties of the sensors of a hand, and its sensors besides those of the motors. The arm that carries it
/// has the sensors of its wrist.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Sensors {
    /// Sensor of every motor.
    pub motors: MotorSensor,
    /// Encoders of joints; absent if the hand has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joints: Option<JointEncoders>,
    /// Taxels of its tactile patches.
    pub touch: Touch,
    /// Accelerometer; absent if the hand has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accelerometer: Option<Accelerometer>,
    /// Cameras on the hand.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<Camera>,
}

impl Sensors {
    /// Checks the numbers.
    ///
    /// # Errors
    /// The field, its value and the valid values.
    pub fn check(&self) -> Result<(), String> {
        let Sensors { motors, joints, touch, accelerometer, cameras } = self;
        let within = |field: &str, value: f64, low: f64, high: f64| {
            if (low..=high).contains(&value) {
                return Ok(());
            }
            Err(format!("{field} = {value}: {low} to {high}"))
        };
        within("motors.resolution", motors.resolution, 0.0, 1.0)?;
        within("motors.bias", motors.bias, 0.0, 1.0)?;
        within("motors.tension_noise", motors.tension_noise, 0.0, 1.0)?;
        within("motors.tension_gain", motors.tension_gain, 0.0, 1.0)?;
        if let Some(JointEncoders { on, resolution, bias, noise }) = joints {
            if let Some(twice) = on.iter().enumerate().find(|(k, name)| on[..*k].contains(name)) {
                return Err(format!("joints.on names '{}' twice", twice.1));
            }
            within("joints.resolution", *resolution, 0.0, 1.0)?;
            within("joints.bias", *bias, 0.0, 1.0)?;
            within("joints.noise", *noise, 0.0, 1.0)?;
        }
        within("touch.footprint", touch.footprint, 1e-4, 0.1)?;
        within("touch.depth", touch.depth, 1e-4, 0.1)?;
        within("touch.resolution", touch.resolution, 0.0, 100.0)?;
        within("touch.saturation", touch.saturation, 1e-3, 1e4)?;
        within("touch.noise", touch.noise, 0.0, 100.0)?;
        within("touch.rate_hz", touch.rate_hz, 0.1, 1e4)?;
        if let Some(Accelerometer { range, noise, bias, .. }) = accelerometer {
            within("accelerometer.range", *range, 1e-2, 1e5)?;
            within("accelerometer.noise", *noise, 0.0, 1e3)?;
            within("accelerometer.bias", *bias, 0.0, 1e3)?;
        }
        cameras.iter().try_for_each(Camera::check)
    }
}

/// The encoder of a motor, and its estimate of tension from the motor's current.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MotorSensor {
    /// Resolution of the position, in σ.
    pub resolution: f64,
    /// Standard deviation of its constant error, in σ.
    pub bias: f64,
    /// Standard deviation of the tension's noise, as a part of the tendon's largest force.
    pub tension_noise: f64,
    /// Standard deviation of the tension's constant error of scale.
    pub tension_gain: f64,
}

impl Default for MotorSensor {
    /// A 12-bit encoder on a motor whose current is known to two per cent.
    fn default() -> Self {
        MotorSensor { resolution: 1.0 / 4096.0, bias: 1e-3, tension_noise: 0.01, tension_gain: 0.02 }
    }
}

/// Encoders of joints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointEncoders {
    /// Coordinates with an encoder, in the order of the readings.
    pub on: Vec<String>,
    /// Resolution, rad.
    pub resolution: f64,
    /// Standard deviation of the constant error of each, rad.
    #[serde(default)]
    pub bias: f64,
    /// Standard deviation of the noise, rad.
    #[serde(default)]
    pub noise: f64,
}

/// Properties of a taxel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Touch {
    /// Distance by which the pressure below a contact point spreads to each side, m.
    pub footprint: f64,
    /// Largest distance of a touched point from the patch's plane, m: the bulge of a curved surface.
    pub depth: f64,
    /// Whether it measures forces along the surface.
    pub shear: bool,
    /// Resolution, N.
    pub resolution: f64,
    /// Largest force on a taxel, N.
    pub saturation: f64,
    /// Standard deviation of the noise, N.
    pub noise: f64,
    /// Readings per second.
    pub rate_hz: f64,
}

impl Default for Touch {
    /// A soft skin of three millimetres.
    fn default() -> Self {
        Touch {
            footprint: 0.003,
            depth: 0.002,
            shear: true,
            resolution: 0.01,
            saturation: 20.0,
            noise: 0.01,
            rate_hz: 100.0,
        }
    }
}

/// An accelerometer: it reads acceleration minus gravity, in the frame of its link.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Accelerometer {
    /// Link of the URDF that carries it.
    pub link: String,
    /// Largest magnitude along each axis, m/s².
    pub range: f64,
    /// Standard deviation of the noise, m/s².
    pub noise: f64,
    /// Standard deviation of the constant error, m/s².
    #[serde(default)]
    pub bias: f64,
}
