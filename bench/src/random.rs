//! Random numbers for random scenes: the same for every build and machine.

use palmares_models::{Rotation, Vec3};
use palmares_tasks::Seed;
use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// A seeded source of random numbers.
pub struct Random(ChaCha12Rng);

impl Random {
    /// The source of a number.
    pub fn new(seed: u64) -> Self {
        Random(ChaCha12Rng::from_seed(Seed::from_u64(seed).0))
    }

    /// Uniform in [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in its logarithm, in [low, high); both positive.
    pub fn magnitude(&mut self, low: f64, high: f64) -> f64 {
        libm::exp(self.between(libm::log(low), libm::log(high)))
    }

    /// One of 0, 1 … n − 1.
    pub fn below(&mut self, n: usize) -> usize {
        (self.between(0.0, n as f64) as usize).min(n - 1)
    }

    /// A vector with components in [-1, 1).
    pub fn cube(&mut self) -> Vec3 {
        Vec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0))
    }

    /// A direction, uniform over the sphere.
    pub fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.cube();
            let length = v.length();
            if (0.1..=1.0).contains(&length) {
                return v / length;
            }
        }
    }

    /// An orientation, uniform over all of them (Shoemake 1992, by rejection).
    pub fn rotation(&mut self) -> Rotation {
        loop {
            let (v, w) = (self.cube(), self.between(-1.0, 1.0));
            let square = v.length_squared() + w * w;
            if (0.01..=1.0).contains(&square) {
                return Rotation::from_xyzw(v.x, v.y, v.z, w).normalize();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_repeat_and_stay_in_range() {
        let (mut a, mut b, mut c) = (Random::new(1), Random::new(1), Random::new(2));
        let mut differ = false;
        for _ in 0..1000 {
            let x = a.between(2.0, 3.0);
            assert!((2.0..3.0).contains(&x));
            assert_eq!(x, b.between(2.0, 3.0));
            differ |= x != c.between(2.0, 3.0);
        }
        assert!(differ);
        assert!((0..100).all(|_| a.below(3) < 3));
        assert!((0..100).all(|_| (a.direction().length() - 1.0).abs() < 1e-12));
        assert!((0..100).all(|_| (0.05..1.0).contains(&a.magnitude(0.05, 1.0))));
    }
}
