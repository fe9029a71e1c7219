//! The noise of sensors: a function of the run's seed, the sensor and the sample, whatever else was drawn.
//!
//! ChaCha is a counter-based generator: its key is made of the run's seed, its stream is the sensor and its position the
//! sample, so that any number can be had without those before it.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use sha2::{Digest, Sha256};

/// 32-bit words that a sample may use: more than the pixels of a large picture need.
const WORDS_PER_SAMPLE: u128 = 1 << 26;

/// The noise of all sensors of a run.
#[derive(Clone, Debug)]
pub struct Noise {
    key: [u8; 32],
}

/// The random numbers of one sample of one sensor.
#[derive(Clone, Debug)]
pub struct Sample(ChaCha8Rng);

impl Noise {
    /// The noise that belongs to a run's seed: its key is SHA-256("palmares sensor noise" ‖ seed), which tells nothing of
    /// the scene that is made of the same seed.
    pub fn new(seed: &[u8; 32]) -> Self {
        let mut hash = Sha256::new();
        hash.update(b"palmares sensor noise");
        hash.update(seed);
        Noise { key: hash.finalize().into() }
    }

    /// The random numbers of the `sample`-th sample of a sensor, which its name tells from all others of the run.
    pub fn sample(&self, sensor: &str, sample: u64) -> Sample {
        let mut hash = Sha256::new();
        hash.update(self.key);
        hash.update(sensor.as_bytes());
        let mut rng = ChaCha8Rng::from_seed(hash.finalize().into());
        rng.set_word_pos(u128::from(sample) * WORDS_PER_SAMPLE);
        Sample(rng)
    }
}

impl Sample {
    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        f64::from(self.0.next_u32()) / 4_294_967_296.0
    }
}
