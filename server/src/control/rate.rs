//! Limits the requests of a connection: a token bucket. Time is an argument.

use std::time::Duration;

/// Allows `rate` requests per second on average and `burst` at once.
#[derive(Clone, Debug)]
pub(crate) struct RateLimit {
    rate: f64,
    burst: f64,
    tokens: f64,
    last: Duration,
}

impl RateLimit {
    /// A full bucket.
    pub(crate) fn new(rate: f64, burst: f64, now: Duration) -> Self {
        RateLimit { rate, burst, tokens: burst, last: now }
    }

    /// Takes one request.
    ///
    /// # Errors
    /// Seconds until the next request is allowed.
    pub(crate) fn take(&mut self, now: Duration) -> Result<(), f64> {
        let passed_s = now.saturating_sub(self.last).as_secs_f64();
        self.tokens = (self.tokens + passed_s * self.rate).min(self.burst);
        self.last = now;
        if self.tokens < 1.0 {
            return Err((1.0 - self.tokens) / self.rate);
        }
        self.tokens -= 1.0;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_burst_passes_then_the_rate_holds() {
        let at = Duration::from_secs_f64;
        let mut limit = RateLimit::new(10.0, 3.0, at(1.0));
        for _ in 0..3 {
            assert_eq!(limit.take(at(1.0)), Ok(()));
        }
        let wait_s = limit.take(at(1.0)).expect_err("empty");
        assert!((wait_s - 0.1).abs() < 1e-9);
        assert!(limit.take(at(1.05)).is_err());
        assert_eq!(limit.take(at(1.11)), Ok(()));
        for _ in 0..3 {
            assert_eq!(limit.take(at(100.0)), Ok(()));
        }
        assert!(limit.take(at(100.0)).is_err());
    }
}
