//! Forces that tendons and motors share.

use super::{Hand, Tendon};

impl Hand {
    /// Force that a motor carries at these tensions, one a tendon: the sum over its tendons, each by its weight.
    pub fn motor_load(&self, motor: usize, tension: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (tendon, f) in self.tendons.iter().zip(tension) {
            if let Some((_, weight)) = tendon.motors.iter().find(|entry| entry.0 == motor) {
                sum += weight * f;
            }
        }
        sum
    }

    /// The motor of a tendon that a load slows, with its weight, if the two belong only to each other.
    pub fn slowed_by(&self, tendon: usize) -> Option<(usize, f64)> {
        let &[(motor, weight)] = &self.tendons[tendon].motors[..] else { return None };
        let alone = |(k, other): (usize, &Tendon)| k == tendon || other.weight(motor) == 0.0;
        let is_pair = self.motors[motor].slows() && !self.tendons[tendon].breakaway;
        (is_pair && self.tendons.iter().enumerate().all(alone)).then_some((motor, weight))
    }

    /// Number of tendons with a clutch.
    pub fn clutches(&self) -> usize {
        self.tendons.iter().filter(|tendon| tendon.breakaway).count()
    }
}
