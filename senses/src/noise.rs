//! The noise of sensors: a function of the run's seed, the sensor and the sample. Other draws do not change it.
//!
//! ChaCha is a counter-based generator. Its key is a hash of the run's seed and the sensor's name, and its position is that
//! of the sample, so that no number needs those before it.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use sha2::{Digest, Sha256};
use std::f64::consts::{SQRT_2, TAU};
use std::sync::OnceLock;

/// 32-bit words of a sample: more than the pixels of the largest image need.
const WORDS_PER_SAMPLE: u128 = 1 << 24;

/// The noise of all sensors of a run.
#[derive(Clone, Debug)]
pub struct Noise {
    key: [u8; 32],
    /// Factor of normal numbers.
    factor: f64,
}

impl Noise {
    /// The noise of a run with this seed. Its key is SHA-256("palmares sensor noise" ‖ seed), which reveals nothing of the
    /// scene of the same seed.
    pub fn new(seed: &[u8; 32]) -> Self {
        Self::keyed("palmares sensor noise", seed)
    }

    /// Random numbers for another purpose with the same seed: their key is SHA-256(purpose ‖ seed).
    pub fn keyed(purpose: &str, seed: &[u8; 32]) -> Self {
        let mut hash = Sha256::new();
        hash.update(purpose.as_bytes());
        hash.update(seed);
        Noise { key: hash.finalize().into(), factor: 1.0 }
    }

    /// The same noise with all normal numbers, and with them the errors of sensors, multiplied by `factor`.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Noise { factor, ..self }
    }

    /// The noise of one sensor; its name is unique in the run.
    pub fn sensor(&self, name: &str) -> SensorNoise {
        let mut hash = Sha256::new();
        hash.update(self.key);
        hash.update(name.as_bytes());
        SensorNoise(ChaCha8Rng::from_seed(hash.finalize().into()), self.factor)
    }
}

/// The noise of one sensor.
#[derive(Clone, Debug)]
pub struct SensorNoise(ChaCha8Rng, f64);

impl SensorNoise {
    /// The random numbers of the `k`-th sample, always the same.
    pub fn sample(&self, k: u64) -> Sample {
        let mut rng = self.0.clone();
        rng.set_word_pos(u128::from(k) * WORDS_PER_SAMPLE);
        Sample(rng, self.1)
    }
}

/// The random numbers of one sample of a sensor, to be drawn in a fixed order.
#[derive(Clone, Debug)]
pub struct Sample(ChaCha8Rng, f64);

impl Sample {
    /// Uniform in (0, 1).
    pub fn unit(&mut self) -> f64 {
        (f64::from(self.0.next_u32()) + 0.5) / 4_294_967_296.0
    }

    /// Normal with mean 0 and standard deviation 1, times the factor of [`Noise::scaled`], by the transform of Box and Muller
    /// (1958).
    pub fn normal(&mut self) -> f64 {
        let (length, turn) = (self.unit(), self.unit());
        self.1 * ((-2.0 * libm::log(length)).sqrt() * libm::cos(TAU * turn))
    }

    /// Three independent normal numbers.
    pub fn normal3(&mut self) -> [f64; 3] {
        std::array::from_fn(|_| self.normal())
    }

    /// A uniform and a normal number for a pixel, from one word. 20 bits select one of 2²⁰ equally likely parts of (0, 1), 12
    /// bits one of 4096 equally likely quantiles with standard deviation 1, times the factor. The normal number is at most 3.7
    /// standard deviations.
    pub fn pixel(&mut self) -> (f64, f64) {
        let word = self.0.next_u32();
        let unit = (f64::from(word >> 12) + 0.5) / 1_048_576.0;
        (unit, self.1 * quantiles()[(word & 0xfff) as usize])
    }
}

/// Quantiles of the normal distribution in the middle of 4096 equally likely parts, scaled to a standard deviation of 1.
fn quantiles() -> &'static [f64; 4096] {
    static TABLE: OnceLock<Box<[f64; 4096]>> = OnceLock::new();
    TABLE.get_or_init(|| {
        let mut table = Box::new([0.0; 4096]);
        for k in 0..2048 {
            let below = (k as f64 + 0.5) / 4096.0;
            let (mut low, mut high) = (-8.0, 0.0);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if 0.5 * libm::erfc(-middle / SQRT_2) < below {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            (table[k], table[4095 - k]) = (low, -low);
        }
        let deviation = (table.iter().map(|x| x * x).sum::<f64>() / 4096.0).sqrt();
        table.iter_mut().for_each(|x| *x /= deviation);
        table
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moments(numbers: impl Iterator<Item = f64>) -> [f64; 4] {
        let all: Vec<f64> = numbers.collect();
        let n = all.len() as f64;
        let mean = all.iter().sum::<f64>() / n;
        let central = |p: i32| all.iter().map(|x| (x - mean).powi(p)).sum::<f64>() / n;
        let deviation = central(2).sqrt();
        [mean, deviation, central(3) / deviation.powi(3), central(4) / deviation.powi(4)]
    }

    /// Mean 0, deviation 1, skewness 0, kurtosis 3 within five standard errors of 200,000 draws.
    fn looks_normal([mean, deviation, skewness, kurtosis]: [f64; 4]) {
        assert!(mean.abs() < 5.0 * 0.0023, "{mean}");
        assert!((deviation - 1.0).abs() < 5.0 * 0.0016, "{deviation}");
        assert!(skewness.abs() < 5.0 * 0.0055, "{skewness}");
        // The table of quantiles ends at 3.7: it misses 0.02 of the kurtosis.
        assert!((kurtosis - 3.0).abs() < 0.02 + 5.0 * 0.011, "{kurtosis}");
    }

    #[test]
    fn the_numbers_are_normal_within_a_sample_and_from_sample_to_sample() {
        let sensor = Noise::new(&[7; 32]).sensor("wrist");
        let mut one = sensor.sample(3);
        looks_normal(moments((0..200_000).map(|_| one.normal())));
        looks_normal(moments((0..200_000).map(|k| sensor.sample(k).normal())));
        let mut pixels = sensor.sample(4);
        looks_normal(moments((0..200_000).map(|_| pixels.pixel().1)));
        let [mean, deviation, ..] = moments((0..200_000).map(|_| pixels.pixel().0));
        assert!((mean - 0.5).abs() < 0.0033 && (deviation - (1.0f64 / 12.0).sqrt()).abs() < 0.002);
    }

    #[test]
    fn a_sample_does_not_depend_on_earlier_draws() {
        let noise = Noise::new(&[1; 32]);
        let alone = noise.sensor("a").sample(5).normal3();
        let sensor = noise.sensor("a");
        for k in [9, 0, 5, 7, 5] {
            let mut sample = sensor.sample(k);
            let drawn = sample.normal3();
            assert_eq!(k == 5, drawn == alone);
            sample.normal();
        }
        assert_ne!(noise.sensor("b").sample(5).normal3(), alone);
        assert_ne!(Noise::new(&[2; 32]).sensor("a").sample(5).normal3(), alone);
    }

    #[test]
    fn scaled_noise_has_the_same_numbers_times_the_factor() {
        let (noise, scaled) = (Noise::new(&[1; 32]), Noise::new(&[1; 32]).scaled(2.0));
        let (mut a, mut b) = (noise.sensor("a").sample(5), scaled.sensor("a").sample(5));
        for _ in 0..100 {
            assert_eq!((2.0 * a.normal(), a.unit()), (b.normal(), b.unit()));
            let ((unit, normal), twice) = (a.pixel(), b.pixel());
            assert_eq!((unit, 2.0 * normal), twice);
        }
        let other = Noise::keyed("something else", &[1; 32]).sensor("a").sample(5).normal3();
        assert_ne!(noise.sensor("a").sample(5).normal3(), other);
    }

    #[test]
    fn samples_of_a_sensor_do_not_overlap() {
        let sensor = Noise::new(&[3; 32]).sensor("a");
        let (mut first, second) = (sensor.sample(0), sensor.sample(1).pixel());
        for _ in 0..1280 * 720 {
            assert!(first.pixel() != second || first.pixel() != second);
        }
    }
}
