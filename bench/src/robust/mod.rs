//! Random scenes, and one scene in many placements: the number in which a grasp or a heap holds.
//!
//! proptest draws the random scenes, the same ones for a seed on every machine, and makes a failing one small.

pub mod commands;
pub mod grasps;
pub mod heaps;
pub mod placements;

use anyhow::{Result, bail};
use palmares_tasks::Seed;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestError, TestRng, TestRunner};
use std::cell::RefCell;

/// Seed of the random scenes of the tests.
pub const SEED: u64 = 1;
/// Number of smaller scenes that are tried when one fails.
const SHRINKS: u32 = 200;

/// Checks `count` values of `strategy`. The error names the seed, the fault and the smallest value with this
/// fault that was found.
pub fn all_hold<S: Strategy>(
    seed: u64,
    count: u32,
    strategy: &S,
    holds: impl FnMut(&S::Value) -> Result<()>,
) -> Result<()> {
    let config =
        Config { cases: count, failure_persistence: None, max_shrink_iters: SHRINKS, ..Config::default() };
    let random = TestRng::from_seed(RngAlgorithm::ChaCha, &Seed::from_u64(seed).0);
    let holds = RefCell::new(holds);
    let outcome = TestRunner::new_with_rng(config, random).run(strategy, |value| {
        let check = &mut *holds.borrow_mut();
        check(&value).map_err(|error| TestCaseError::fail(format!("{error:#}")))
    });
    match outcome {
        Ok(()) => Ok(()),
        Err(TestError::Fail(reason, value)) => bail!("seed {seed}: {reason}; smallest found: {value:#?}"),
        Err(TestError::Abort(reason)) => bail!("seed {seed}: {reason}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_makes_the_same_scenes_and_a_failure_is_small_and_names_it() {
        let numbers = |seed| {
            let mut drawn = Vec::new();
            all_hold(seed, 20, &(0..1_000_000u32), |n| {
                drawn.push(*n);
                Ok(())
            })
            .expect("all hold");
            drawn
        };
        assert_eq!(numbers(1), numbers(1));
        assert_ne!(numbers(1), numbers(2));
        let error = all_hold(1, 20, &(0..1_000_000u32), |n| {
            anyhow::ensure!(*n < 1000, "too large");
            Ok(())
        });
        assert_eq!(error.expect_err("some are large").to_string(), "seed 1: too large; smallest found: 1000");
    }
}
