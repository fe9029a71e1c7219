//! Motion of the hand's base by which the server shakes it.

use palmares_models::Vec3;
use serde::Deserialize;
use std::f64::consts::TAU;

/// A shake along x, then y, then z of the world: `a sin(2π f t) (1 − cos(2π t / T)) / 2` each.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shake {
    /// Amplitude a, m.
    pub amplitude_m: f64,
    /// Frequency f, 1/s.
    pub frequency_hz: f64,
    /// Length T of the shake along one axis, s.
    pub axis_s: f64,
}

impl Shake {
    /// Offset and velocity at a time since its start; zero at both ends of each axis' part and after the last.
    pub(crate) fn motion(&self, t: f64) -> (Vec3, Vec3) {
        let axis = (t / self.axis_s).floor();
        let t = t - axis * self.axis_s;
        let (w, envelope) = (TAU * self.frequency_hz, TAU / self.axis_s);
        let (sin, cos) = libm::sincos(w * t);
        let (envelope_sin, envelope_cos) = libm::sincos(envelope * t);
        let window = 0.5 * (1.0 - envelope_cos);
        let offset = self.amplitude_m * sin * window;
        let speed = self.amplitude_m * (w * cos * window + sin * 0.5 * envelope * envelope_sin);
        let direction = [Vec3::X, Vec3::Y, Vec3::Z].get(axis as usize).copied().unwrap_or(Vec3::ZERO);
        (direction * offset, direction * speed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_velocity_of_a_shake_is_the_derivative_of_its_path() {
        let it = Shake { amplitude_m: 0.02, frequency_hz: 2.5, axis_s: 1.0 };
        for k in 0..3300 {
            let (t, h) = (f64::from(k) * 1e-3 + 5e-4, 1e-6);
            let numeric = (it.motion(t + h).0 - it.motion(t - h).0) / (2.0 * h);
            assert!((numeric - it.motion(t).1).length() < 1e-6, "{t}");
        }
        for end in [0.0, 1.0, 2.0, 3.0, 4.0] {
            assert_eq!(it.motion(end).0, Vec3::ZERO);
        }
    }
}
