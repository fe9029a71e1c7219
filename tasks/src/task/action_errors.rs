//! How actions reach the hand.

/// Most ticks by which an action may be late.
pub const MAX_DELAY: u32 = 100;

/// Actions that arrive late and with errors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ActionErrors {
    /// Least and most ticks between an action and its arrival; one number is drawn for each run, evenly.
    pub delay: [u32; 2],
    /// Standard deviation of the normal errors of each tick, as a part of each number's limit: of the base's largest speeds, and of 1 for
    /// σ. Pose targets have none.
    pub noise: f64,
}

impl ActionErrors {
    /// Checks the bounds.
    ///
    /// # Errors
    /// A number is out of bounds.
    pub fn check(&self) -> Result<(), String> {
        let ActionErrors { delay: [low, high], noise } = self;
        if low > high || *high > MAX_DELAY {
            return Err(format!("action_delay: found [{low}, {high}]; wanted 0 to {MAX_DELAY}, ascending"));
        }
        if !(0.0..=1.0).contains(noise) {
            return Err(format!("action_noise: found {noise}; wanted 0 to 1"));
        }
        Ok(())
    }
}
