//! Encoders: of motors, of joints, and of the arm that carries the hand.

use crate::noise::{Noise, SensorNoise};
use palmares_models::hand::Hand;
use palmares_models::hand::sensors::{JointEncoders, MotorSensor};
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::state::MotorState;
use serde::{Deserialize, Serialize};

/// Standard deviation of where the arm believes the base to be along each axis, m: a third of the largest error of an
/// industrial arm as it is delivered, 0.65 mm (Slamani, Nubiola and Bonev, Industrial Robot 39(1), 2012).
const ARM_BIAS_M: f64 = 2.2e-4;
/// The same about each axis, rad: a third of 2.8 mrad (ibid.).
const ARM_BIAS_RAD: f64 = 9.3e-4;
/// Least step of the base's pose as the arm's encoders give it, m and rad; chosen.
const ARM_STEP: f64 = 1e-5;

/// The multiple of `step` that is nearest, of two the one farther from zero.
pub(crate) fn quantised(x: f64, step: f64) -> f64 {
    let steps = x / step;
    // A cast, since not every processor has an instruction for `round`.
    if steps.abs() < 1e15 { (steps + 0.5f64.copysign(steps)) as i64 as f64 * step } else { x }
}

/// What a motor's sensors read: position and velocity in σ, tension of its tendons.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MotorReading {
    /// σ the motor has reached.
    pub position: f64,
    /// dσ/dt, 1/s.
    pub velocity: f64,
    /// Tension of its tendons, in the tendon's unit.
    pub tension: f64,
}

/// The errors of a motor's sensors in one run.
#[derive(Clone, Debug)]
struct MotorErrors {
    bias: f64,
    gain: f64,
    /// Standard deviation of the tension, in its unit.
    deviation: f64,
    noise: SensorNoise,
    last: Option<f64>,
}

/// The sensors of all motors.
#[derive(Clone, Debug)]
pub(crate) struct Motors {
    sensor: MotorSensor,
    errors: Vec<MotorErrors>,
}

impl Motors {
    pub(crate) fn new(hand: &Hand, noise: &Noise) -> Self {
        let sensor = hand.sensors.motors;
        let errors = hand.motors.iter().enumerate().map(|(k, motor)| {
            let noise = noise.sensor(&format!("motor {}", motor.name));
            let mut drawn = noise.sample(0);
            let strongest = hand.tendons.iter().filter(|tendon| tendon.motor == k);
            let strongest = strongest.map(|tendon| tendon.force_limit).fold(0.0, f64::max);
            MotorErrors {
                bias: sensor.bias * drawn.normal(),
                gain: 1.0 + sensor.tension_gain * drawn.normal(),
                deviation: sensor.tension_noise * strongest,
                noise,
                last: None,
            }
        });
        Motors { sensor, errors: errors.collect() }
    }

    /// Where each motor was at its last reading, σ.
    pub(crate) fn last(&self) -> Vec<Option<f64>> {
        self.errors.iter().map(|errors| errors.last).collect()
    }

    /// Sets it.
    pub(crate) fn set_last(&mut self, last: &[Option<f64>]) {
        for (errors, last) in self.errors.iter_mut().zip(last) {
            errors.last = *last;
        }
    }

    /// A tick has passed. `tensions` of each motor's tendons together.
    pub(crate) fn tick(
        &mut self,
        tick: u64,
        tick_s: f64,
        motors: &[MotorState],
        tensions: &[f64],
    ) -> Vec<MotorReading> {
        let read = |((errors, motor), tension): ((&mut MotorErrors, &MotorState), &f64)| {
            let position = quantised(motor.position + errors.bias, self.sensor.resolution);
            let velocity = errors.last.map_or(0.0, |last| (position - last) / tick_s);
            errors.last = Some(position);
            let noise = errors.deviation * errors.noise.sample(tick + 1).normal();
            MotorReading { position, velocity, tension: tension * errors.gain + noise }
        };
        self.errors.iter_mut().zip(motors).zip(tensions).map(read).collect()
    }
}

/// The encoders of joints.
#[derive(Clone, Debug)]
pub(crate) struct Joints {
    encoders: JointEncoders,
    coordinates: Vec<usize>,
    bias: Vec<f64>,
    noise: SensorNoise,
}

/// The coordinates that have an encoder.
pub(crate) fn encoded(hand: &Hand) -> Vec<usize> {
    let on = hand.sensors.joints.iter().flat_map(|encoders| &encoders.on);
    on.filter_map(|name| hand.coordinate(name)).collect()
}

impl Joints {
    /// None when the hand has no encoders.
    pub(crate) fn new(hand: &Hand, noise: &Noise) -> Option<Self> {
        let encoders = hand.sensors.joints.clone()?;
        let coordinates = encoded(hand);
        let noise = noise.sensor("joints");
        let mut drawn = noise.sample(0);
        let bias = coordinates.iter().map(|_| encoders.bias * drawn.normal()).collect();
        Some(Joints { encoders, coordinates, bias, noise })
    }

    pub(crate) fn read(&self, tick: u64, q: &[f64]) -> Vec<f64> {
        let mut drawn = self.noise.sample(tick + 1);
        let one = |(&coordinate, bias): (&usize, &f64)| {
            let noisy = q[coordinate] + bias + self.encoders.noise * drawn.normal();
            quantised(noisy, self.encoders.resolution)
        };
        self.coordinates.iter().zip(&self.bias).map(one).collect()
    }
}

/// Pose and velocity of the base as the arm's encoders give them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BaseReading {
    /// World pose.
    pub pose: Pose,
    /// m/s
    pub linear: Vec3,
    /// rad/s
    pub angular: Vec3,
}

/// The arm's encoders.
#[derive(Clone, Debug)]
pub(crate) struct Arm {
    shift: Vec3,
    turn: Rotation,
    /// The last reading.
    pub(crate) last: Option<Pose>,
}

impl Arm {
    pub(crate) fn new(noise: &Noise) -> Self {
        let mut drawn = noise.sensor("arm").sample(0);
        let shift = Vec3::from_array(drawn.normal3()) * ARM_BIAS_M;
        let turn = Rotation::from_scaled_axis(Vec3::from_array(drawn.normal3()) * ARM_BIAS_RAD);
        Arm { shift, turn, last: None }
    }

    /// A tick has passed.
    pub(crate) fn tick(&mut self, tick_s: f64, base: Pose, angular: Vec3) -> BaseReading {
        let place = (base.translation + self.shift).to_array().map(|x| quantised(x, ARM_STEP));
        let pose = Pose::from_parts(Vec3::from_array(place), (self.turn * base.rotation).normalize());
        let linear = self.last.map_or(Vec3::ZERO, |last| (pose.translation - last.translation) / tick_s);
        let angular = angular.to_array().map(|x| quantised(x, ARM_STEP / tick_s));
        self.last = Some(pose);
        BaseReading { pose, linear, angular: Vec3::from_array(angular) }
    }
}
