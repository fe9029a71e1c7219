//! How near two shapes must be to touch within a step.
//!
//! Two surfaces that approach at speed u, m/s, may use up a gap of `2 h u + w` in a step of length h: twice the present approach,
//! and the way w that a step may add from rest ([`Config::from_rest`]). This reach is wide: of the points within it, few are
//! touched. So the search has a short one, `h u + w` with a small w ([`SHORT_M`]), and the solution is compared with what lies
//! between both ([`super::left_out`]).

use crate::config::Config;

/// Way from rest of the short reach, m: what an acceleration of 60 m/s² adds in 4 ms. What is farther off and is touched all the
/// same costs a second solve, what is nearer is solved for nothing. A step whose whole way from rest is shorter has no short reach.
pub(crate) const SHORT_M: f64 = 1e-3;

/// Gaps of two shapes that matter in a step, m.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    /// Largest approach at the present speeds.
    pub approach: f64,
    /// Largest approach from rest, w.
    pub from_rest: f64,
    /// Gap up to which contact points are found.
    pub margin: f64,
    /// Gap that this step can use up, at most the margin.
    pub reachable: f64,
    /// Part of the present approach that a step may use up.
    ahead: f64,
}

impl Reach {
    /// The reach of two shapes whose points have together at most these `speeds`, m/s; `within_hand` if both are links.
    #[inline]
    pub(super) fn new(config: &Config, within_hand: bool, speeds: f64) -> Self {
        let approach = config.step_s * speeds;
        let from_rest = config.from_rest(within_hand);
        let margin = config.margin(within_hand) + approach;
        Reach { approach, from_rest, margin, reachable: (from_rest + 2.0 * approach).min(margin), ahead: 2.0 }
    }

    /// The short reach at the same speed. Its margin is the same: of a pair within it all points are known.
    #[inline]
    pub(super) fn shortened(self) -> Self {
        let from_rest = self.from_rest.min(SHORT_M);
        Reach { from_rest, reachable: (from_rest + self.approach).min(self.margin), ahead: 1.0, ..self }
    }

    /// Gap that two points with a relative speed of at most `fastest`, m/s, cannot use up.
    #[inline]
    pub(super) fn beyond(&self, config: &Config, fastest: f64) -> f64 {
        1.001 * (self.from_rest + self.ahead * config.step_s * fastest)
    }

    /// Whether two points at a gap, m, cannot touch in this step; their normal velocity is `approach`, m/s.
    #[inline]
    pub(super) fn is_beyond(&self, config: &Config, gap: f64, approach: f64) -> bool {
        gap > self.from_rest + self.ahead * approach.abs() * config.step_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_counts_up_to_twice_the_approach_and_the_way_from_rest() {
        let config = Config::with_step(1e-3);
        let still = Reach::new(&config, false, 0.0);
        assert_eq!((still.approach, still.reachable), (0.0, still.from_rest));
        assert!(still.margin > still.reachable, "points are found before they can touch");
        let way = still.from_rest;
        assert!(!still.is_beyond(&config, way, 0.0) && still.is_beyond(&config, 1.01 * way, 0.0));
        // At 2 m/s and 1 m/s towards each other, 3 mm in a step.
        let fast = Reach::new(&config, false, 3.0);
        assert_eq!(fast.approach, 3e-3);
        let beyond = [0.99, 1.01].map(|part| fast.is_beyond(&config, part * (way + 6e-3), -3.0));
        assert_eq!(beyond, [false, true]);
        // No point that may touch is beyond the bound of its pair.
        assert!(fast.beyond(&config, 3.0) > way + 6e-3);
    }

    /// A long step has a short reach with the same margin; a short step has none of its own.
    #[test]
    fn the_short_reach_is_a_millimetre_and_the_approach() {
        let coarse = Config::with_step(4e-3);
        let full = Reach::new(&coarse, false, 0.25);
        let short = full.shortened();
        assert_eq!((full.reachable, short.reachable), (4e-3 + 2e-3, SHORT_M + 1e-3));
        assert_eq!(short.margin, full.margin);
        assert!(short.is_beyond(&coarse, 2.1e-3, -0.25) && !full.is_beyond(&coarse, 2.1e-3, -0.25));
        let fine = Reach::new(&Config::with_step(5e-4), false, 0.0);
        assert_eq!(fine.shortened().reachable, fine.reachable);
    }
}
