//! Forces that tendons and motors share.

use super::{Hand, Motor, Tendon};

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

    /// The motor of a tendon that a load slows, with its weight. [`Hand::validate`] makes sure that the two belong only to each other.
    pub fn slowed_by(&self, tendon: usize) -> Option<(usize, f64)> {
        match self.tendons[tendon].motors[..] {
            [(motor, weight)] if self.motors[motor].slows() => Some((motor, weight)),
            _ => None,
        }
    }

    /// Number of tendons with a clutch.
    pub fn clutches(&self) -> usize {
        self.tendons.iter().filter(|tendon| tendon.breakaway).count()
    }
}

/// The problem with a motor that a load slows without a tendon of its own, and what is valid.
pub(crate) const NO_OWN_TENDON: (&str, &str) = (
    "has stall_force or power_limit, and no tendon of its own",
    "these fields with one tendon that only this motor winds, without breakaway",
);

/// The first motor that a load slows without a tendon of its own, which no other motor winds and which has no clutch.
pub(crate) fn slowed_without_own_tendon<'a>(motors: &'a [Motor], tendons: &[Tendon]) -> Option<&'a Motor> {
    let has_own = |motor: usize| {
        let mut wound = tendons.iter().filter(|tendon| tendon.weight(motor) != 0.0);
        let own = wound.next().is_some_and(|tendon| tendon.motors.len() == 1 && !tendon.breakaway);
        own && wound.next().is_none()
    };
    motors.iter().enumerate().find(|(k, motor)| motor.slows() && !has_own(*k)).map(|(_, motor)| motor)
}
