//! The random numbers of a variation.

use super::options::Quantity;
use crate::seed::Seed;
use palmares_senses::noise::{Noise, Sample};

/// Random numbers by seed, attempt, quantity and object, each whatever else was drawn: what one quantity is does not hang
/// on whether another is drawn, too.
#[derive(Clone, Debug)]
pub(super) struct Draws {
    numbers: Noise,
    attempt: u64,
}

impl Draws {
    /// Those of a run's seed; they tell nothing of its scene, nor of the noise of its sensors.
    pub(super) fn new(seed: Seed, attempt: u64) -> Self {
        Draws { numbers: Noise::keyed("palmares training", &seed.0), attempt }
    }

    /// The numbers of the `k`-th object, or of what there is one of.
    pub(super) fn of(&self, quantity: Quantity, k: usize) -> Sample {
        self.numbers.sensor(quantity.name()).sample((self.attempt << 32) + k as u64)
    }

    /// A factor, drawn evenly in its logarithm.
    pub(super) fn factor(&self, quantity: Quantity, k: usize, [low, high]: [f64; 2]) -> f64 {
        low * libm::pow(high / low, self.of(quantity, k).unit())
    }
}
