//! The order in which the joints of a free hand close.

use palmares_models::Pose;
use palmares_models::hand::Hand;
use palmares_sim::Config;
use palmares_sim::statics::prediction::solve_loaded;
use palmares_sim::statics::rest::NoPrediction;

/// Equilibria of a free hand while its motors wind.
#[derive(Clone, Debug, PartialEq)]
pub struct Closing {
    /// σ of every motor, for each sample.
    pub sigma: Vec<Vec<f64>>,
    /// Coordinates, for each sample.
    pub q: Vec<Vec<f64>>,
    /// Tensions, for each sample.
    pub tension: Vec<Vec<f64>>,
}

/// When a coordinate closes.
#[derive(Clone, Debug, PartialEq)]
pub struct ClosingOrder {
    /// Index of the coordinate.
    pub coordinate: usize,
    /// Its motion from the first sample to the last, rad or m.
    pub travel: f64,
    /// For each wanted fraction, the first progress, 0 to 1, at which the coordinate has moved by this fraction of its travel;
    /// between samples by a straight line. None for a coordinate that stays.
    pub reached: Vec<Option<f64>>,
}

/// Motions smaller than this are none, rad or m.
const STILL: f64 = 1e-6;

/// Closes a hand from σ = `from` to σ = `to` in equal steps.
///
/// # Errors
/// A sample without an equilibrium.
pub fn close(
    config: &Config,
    hand: &Hand,
    base: Pose,
    from: &[f64],
    to: &[f64],
    steps: usize,
) -> Result<Closing, NoPrediction> {
    let mut closing = Closing { sigma: Vec::new(), q: Vec::new(), tension: Vec::new() };
    for step in 0..=steps {
        let part = step as f64 / steps.max(1) as f64;
        let sigma: Vec<f64> = from.iter().zip(to).map(|(a, b)| a + part * (b - a)).collect();
        let rest = solve_loaded(config, hand, base, &sigma, &[])?;
        closing.q.push(rest.q);
        closing.tension.push(rest.tension);
        closing.sigma.push(sigma);
    }
    Ok(closing)
}

impl Closing {
    /// Progress at which each coordinate reaches these fractions of its travel; the one that reaches the first fraction first comes
    /// first, those that stay come last.
    pub fn order(&self, fractions: &[f64]) -> Vec<ClosingOrder> {
        let (Some(first), Some(last)) = (self.q.first(), self.q.last()) else { return Vec::new() };
        let steps = (self.q.len() - 1).max(1) as f64;
        let of = |coordinate: usize| {
            let travel = last[coordinate] - first[coordinate];
            let done = |k: usize| (self.q[k][coordinate] - first[coordinate]) / travel;
            let when = |&fraction: &f64| {
                if travel.abs() < STILL {
                    return None;
                }
                let k = (0..self.q.len()).find(|&k| done(k) >= fraction)?;
                let Some(before) = k.checked_sub(1) else { return Some(0.0) };
                let (a, b) = (done(before), done(k));
                Some((before as f64 + (fraction - a) / (b - a)) / steps)
            };
            ClosingOrder { coordinate, travel, reached: fractions.iter().map(when).collect() }
        };
        let mut order: Vec<ClosingOrder> = (0..first.len()).map(of).collect();
        let key = |order: &ClosingOrder| order.reached.first().copied().flatten().unwrap_or(f64::INFINITY);
        order.sort_by(|a, b| key(a).total_cmp(&key(b)));
        order
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_hand_closes_evenly_and_a_limit_ends_a_joint_early() {
        let hand = Hand::builtin("softhand").expect("it is built in");
        let config = Config::default();
        let even = close(&config, &hand, Pose::IDENTITY, &[0.1], &[0.4], 6).expect("equilibria");
        for joint in even.order(&[0.5]).iter().filter(|joint| joint.travel.abs() > 1e-3) {
            assert!((joint.reached[0].expect("it moves") - 0.5).abs() < 1e-9, "{joint:?}");
        }
        // Above σ = 0.6 inner joints are at their limits, and the outer ones go on.
        let far = close(&config, &hand, Pose::IDENTITY, &[0.0], &[1.0], 50).expect("equilibria");
        let order = far.order(&[0.9]);
        let place = |name: &str| {
            let coordinate = hand.coordinate(name).expect("a joint");
            order.iter().position(|joint| joint.coordinate == coordinate).expect("all are there")
        };
        assert!(place("index_inner") < place("index_outer"));
    }
}
