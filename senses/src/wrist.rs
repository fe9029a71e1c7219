//! The force/torque sensor between arm and hand: a Robotiq FT 300-S.
//!
//! Robotiq's instruction manual gives the noise as the standard deviation over one second, 0.1 N in force, 0.005 N·m about
//! the axes across and 0.003 N·m about the flange's, a range of 300 N and 30 N·m, steps of 0.01 N and 0.001 N·m, and 100
//! readings a second. Nobody publishes its drift; [`DRIFT_N`] and the zero at the beginning are chosen here: ten weighings
//! of 3 kg by a user of the FT 300 scattered by 0.6 N.

use crate::encoders::quantised;
use crate::noise::{Noise, SensorNoise};
use serde::{Deserialize, Serialize};

/// Standard deviation of a force, N.
const FORCE_NOISE: f64 = 0.1;
/// Standard deviations of the torques, N·m.
const TORQUE_NOISE: [f64; 3] = [0.005, 0.005, 0.003];
/// Least steps of a force and of a torque, N and N·m.
const STEP: (f64, f64) = (0.01, 0.001);
/// Largest force and torque along and about each axis, N and N·m.
const RANGE: (f64, f64) = (300.0, 30.0);
/// How far the zero of a force wanders in a minute (standard deviation), N; of a torque a tenth of it in N·m.
pub const DRIFT_N: f64 = 0.1;
/// Standard deviation of the zero when a run begins, N; of a torque a tenth of it in N·m. The sensor was set to zero with
/// the hand on it.
const ZERO_N: f64 = 0.05;
/// A reading is so many ticks of 10 ms old.
const PERIOD_S: f64 = 0.01;

/// The sensor's state.
#[derive(Clone, Debug)]
pub(crate) struct Wrist {
    noise: SensorNoise,
    tick_s: f64,
    pub(crate) state: WristState,
}

/// What changes of it from tick to tick.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct WristState {
    zero: [f64; 6],
    /// What it measured in the tick before: it is read one period later.
    measured: Option<[f64; 6]>,
    read: [f64; 6],
}

/// Of six axes the noise, N and N·m.
fn deviation(axis: usize) -> f64 {
    if axis < 3 { FORCE_NOISE } else { TORQUE_NOISE[axis - 3] }
}

/// A torque's part of what is stated for a force, m.
fn lever(axis: usize) -> f64 {
    if axis < 3 { 1.0 } else { 0.1 }
}

impl Wrist {
    pub(crate) fn new(noise: &Noise, tick_s: f64) -> Self {
        let mut drawn = noise.sensor("wrist zero").sample(0);
        let zero = std::array::from_fn(|axis| ZERO_N * lever(axis) * drawn.normal());
        let state = WristState { zero, measured: None, read: [0.0; 6] };
        Wrist { noise: noise.sensor("wrist"), tick_s, state }
    }

    /// A tick has passed, after which the sensor feels `true_wrench`.
    pub(crate) fn tick(&mut self, tick: u64, true_wrench: [f64; 6]) {
        let mut drawn = self.noise.sample(tick);
        let wander = DRIFT_N * (self.tick_s / 60.0).sqrt();
        let WristState { zero, measured: before, read } = &mut self.state;
        let measured = std::array::from_fn(|axis| {
            let (most, step) = if axis < 3 { (RANGE.0, STEP.0) } else { (RANGE.1, STEP.1) };
            zero[axis] += wander * lever(axis) * drawn.normal();
            let noisy = true_wrench[axis] + zero[axis] + deviation(axis) * drawn.normal();
            quantised(noisy, step).clamp(-most, most)
        });
        let late = self.tick_s <= PERIOD_S;
        *read = if late { before.unwrap_or(measured) } else { measured };
        *before = Some(measured);
    }

    /// Force and torque as they are read now.
    pub(crate) fn read(&self) -> ([f64; 3], [f64; 3]) {
        let [fx, fy, fz, tx, ty, tz] = self.state.read;
        ([fx, fy, fz], [tx, ty, tz])
    }
}
