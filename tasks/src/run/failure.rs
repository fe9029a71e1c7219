//! The failure of a run's world.

use palmares_sim::Fault;

/// The failure of a run's world. Its text explains the fault and suggests a remedy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Failure {
    /// The fault.
    pub fault: Fault,
    /// The tick in which it failed, counted from 1.
    pub tick: u64,
    /// Physics steps since reset, including the failed one if it was solved; None if unknown.
    pub step: Option<u64>,
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Failure { fault, tick, step } = self;
        write!(f, "the world failed ({}) in tick {tick}", fault.code())?;
        if let Some(step) = step {
            write!(f, ", step {step}")?;
        }
        write!(f, ": {}", fault.in_words())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_says_when_what_and_what_to_try() {
        let text = Failure { fault: Fault::Unsolvable, tick: 44, step: Some(437) }.to_string();
        assert!(
            text.starts_with("the world failed (unsolvable) in tick 44, step 437: a step has no solution")
        );
        assert!(text.contains("; inertia and stiffness") && text.contains("try heavier links"), "{text}");
        let lost = Failure { fault: Fault::Crashed, tick: 3, step: None }.to_string();
        assert!(lost.starts_with("the world failed (crashed) in tick 3: the program"), "{lost}");
    }
}
