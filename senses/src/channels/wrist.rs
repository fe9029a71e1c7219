//! The force/torque sensor between arm and hand: a Robotiq FT 300-S.
//!
//! Robotiq's instruction manual gives the noise as the standard deviation over one second, 0.1 N in force, 0.005 N·m about
//! the axes across and 0.003 N·m about the flange's, a range of 300 N and 30 N·m, steps of 0.01 N and 0.001 N·m, and 100
//! readings a second. No maker publishes the drift; [`DRIFT_N`] and the zero at the beginning are chosen here: ten weighings
//! of 3 kg by a user of the FT 300 scattered by 0.6 N.

use crate::declaration::{Channel, Column, Record};
use crate::moment::Moment;
use crate::noise::{Noise, SensorNoise};
use crate::quantise::quantised;
use crate::sensor::Sensor;
use palmares_models::hand::Hand;
use serde::{Deserialize, Serialize};

/// Standard deviation of a force, N.
const FORCE_NOISE: f64 = 0.1;
/// Standard deviations of the torques, N·m.
const TORQUE_NOISE: [f64; 3] = [0.005, 0.005, 0.003];
/// Resolution of a force and of a torque, N and N·m.
const STEP: (f64, f64) = (0.01, 0.001);
/// Largest force and torque along and about each axis, N and N·m.
const RANGE: (f64, f64) = (300.0, 30.0);
/// Standard deviation of the drift of a force's zero in a minute, N; of a torque's a tenth of it in N·m.
const DRIFT_N: f64 = 0.1;
/// Standard deviation of the zero when a run begins, N; of a torque's a tenth of it in N·m. The sensor was set to zero with
/// the hand on it.
const ZERO_N: f64 = 0.05;
/// Time from one reading to the next, s. With ticks that are not longer, a reading is one tick old.
const PERIOD_S: f64 = 0.01;

/// The sensor's errors.
#[derive(Clone)]
pub(crate) struct Wrist {
    noise: SensorNoise,
    tick_s: f64,
}

/// State that changes from tick to tick.
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct WristState {
    zero: [f64; 6],
    /// Measurement of the tick before: it is read one period later.
    measured: Option<[f64; 6]>,
}

impl Sensor for Wrist {
    const CHANNEL: Channel = Channel {
        name: "wrist",
        key: "wrist",
        columns: &[Column::named("force", 3, "N", "N"), Column::named("torque", 3, "N·m", "N·m")],
        record: Some(Record {
            name: "Wrench",
            doc: "Force and torque in the world frame, torque about the base origin.",
            row_name: None,
        }),
        doc: "Force and torque between arm and hand in the world frame, torque about the base's origin",
        hands: "every hand. The sensor bears the hand's own weight: SoftHand 7.3 N",
        ..Channel::NUMBERS
    };
    type State = WristState;

    /// The servo's wrench, and the hand's own weight where the simulation carries it (Rocchi and Hauser 2016, eq. 6).
    fn law(now: &Moment<'_>, _: Option<&Self::State>, row: &mut [f64]) {
        let (mut force, mut torque) = now.servo;
        if now.hand.gravity_compensation {
            for (link, pose) in now.hand.links.iter().zip(now.links()) {
                let carried = now.gravity * -link.inertia.mass;
                force += carried;
                torque += (pose.transform_point(link.inertia.com) - now.base.translation).cross(carried);
            }
        }
        row[..3].copy_from_slice(&force.to_array());
        row[3..].copy_from_slice(&torque.to_array());
    }

    fn new(_: &Hand, noise: Option<&Noise>, tick_s: f64) -> Option<(Self, Self::State)> {
        let noise = noise?;
        let mut drawn = noise.sensor("wrist zero").sample(0);
        let zero = std::array::from_fn(|axis| ZERO_N * lever(axis) * drawn.normal());
        Some((Wrist { noise: noise.sensor("wrist"), tick_s }, WristState { zero, measured: None }))
    }

    fn tick(&self, now: &Moment<'_>, tick: u64, state: &mut Self::State, row: &mut [f64]) {
        Self::law(now, None, row);
        let mut drawn = self.noise.sample(tick);
        let wander = DRIFT_N * (self.tick_s / 60.0).sqrt();
        let WristState { zero, measured: before } = state;
        let measured = std::array::from_fn(|axis| {
            let (most, step) = if axis < 3 { (RANGE.0, STEP.0) } else { (RANGE.1, STEP.1) };
            zero[axis] += wander * lever(axis) * drawn.normal();
            let noisy = row[axis] + zero[axis] + deviation(axis) * drawn.normal();
            quantised(noisy, step).clamp(-most, most)
        });
        let late = self.tick_s <= PERIOD_S;
        row.copy_from_slice(&if late { before.unwrap_or(measured) } else { measured });
        *before = Some(measured);
    }
}

/// Standard deviation of the noise of each of six axes, N and N·m.
fn deviation(axis: usize) -> f64 {
    if axis < 3 { FORCE_NOISE } else { TORQUE_NOISE[axis - 3] }
}

/// The part of a force's value that applies to a torque, m.
fn lever(axis: usize) -> f64 {
    if axis < 3 { 1.0 } else { 0.1 }
}
