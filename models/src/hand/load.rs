//! Forces that tendons and motors share.

use super::Hand;

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

    /// Number of tendons with a clutch.
    pub fn clutches(&self) -> usize {
        self.tendons.iter().filter(|tendon| tendon.breakaway).count()
    }
}
