//! The random numbers of a scene.

use crate::seed::Seed;
use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// The randomness of a scene. Each draw continues where the last one ended.
pub struct SceneRng(ChaCha12Rng);

impl SceneRng {
    /// Random numbers of a seed.
    pub fn new(seed: Seed) -> Self {
        SceneRng(ChaCha12Rng::from_seed(seed.0))
    }

    /// In [0, 1).
    pub(super) fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// In [-1, 1).
    pub(super) fn both_ways(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    /// In [0, n).
    pub(super) fn below(&mut self, n: usize) -> usize {
        ((self.unit() * n as f64) as usize).min(n.saturating_sub(1))
    }
}
