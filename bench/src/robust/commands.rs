//! Random commands for hands: over a table with an object, base and motors go to random targets; no world may fail.

use anyhow::{Context, Result, ensure};
use palmares_models::hand::Hand;
use palmares_models::{Rotation, Vec3};
use palmares_tasks::run::Failure;
use palmares_tasks::{Action, BaseTarget, Run, Seed, Task};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// The task: a table, and one object of eleven.
const TASK: &str = "grasp";
/// Shortest and longest time between two commands, s.
const PIECE_S: [f64; 2] = [0.02, 0.6];
/// The base stays in a box of this half width around a point at this height over the table, m.
const REACH_M: Vec3 = Vec3::new(0.25, 0.25, 0.2);
const MIDDLE_M: Vec3 = Vec3::new(0.0, 0.0, 0.3);
/// Largest turn of the base from its start, rad: the hand reaches the table with fingers and with its side.
const TURN_RAD: f64 = 1.6;

/// The worst of the runs of a hand.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    /// Runs that were played.
    pub runs: u64,
    /// Largest excess of a joint over a limit, rad or m.
    pub limit_excess: f64,
    /// Fastest joint, rad/s or m/s.
    pub joint_rate: f64,
    /// Fastest object, m/s.
    pub object_speed: f64,
}

impl Tally {
    fn join(self, other: Self) -> Self {
        Self {
            runs: self.runs + other.runs,
            limit_excess: self.limit_excess.max(other.limit_excess),
            joint_rate: self.joint_rate.max(other.joint_rate),
            object_speed: self.object_speed.max(other.object_speed),
        }
    }

    fn of(run: &Run) -> Self {
        let (state, hand) = (run.world().state(), run.hand());
        let beyond = state.q.iter().zip(&hand.coordinates).map(|(q, c)| (q - c.upper).max(c.lower - q));
        Self {
            runs: 0,
            limit_excess: beyond.fold(0.0, f64::max),
            joint_rate: state.v[6..6 + hand.coordinates.len()]
                .iter()
                .map(|rate: &f64| rate.abs())
                .fold(0.0, f64::max),
            object_speed: (0..state.objects.len())
                .map(|k| state.object_velocity(run.world().model(), k).0.length())
                .fold(0.0, f64::max),
        }
    }
}

/// A number from 0 to 1.
fn uniform(random: &mut ChaCha8Rng) -> f64 {
    f64::from(random.next_u32()) / f64::from(u32::MAX)
}

/// A number from −1 to 1.
fn signed(random: &mut ChaCha8Rng) -> f64 {
    2.0 * uniform(random) - 1.0
}

/// A target of the base and σ of every motor: each motor often stays where it was, or goes to an end.
fn command(random: &mut ChaCha8Rng, start: Rotation, sigma: &mut [f64]) -> Action {
    let mut triple = || Vec3::new(signed(random), signed(random), signed(random));
    let at = MIDDLE_M + REACH_M * triple();
    let turn = Rotation::from_scaled_axis(TURN_RAD / 3f64.sqrt() * triple()) * start;
    for sigma in sigma.iter_mut() {
        match random.next_u32() % 4 {
            0 => *sigma = uniform(random),
            1 => *sigma = f64::from(random.next_u32() % 2),
            _ => {}
        }
    }
    Action {
        base: Some(BaseTarget::Pose { position: at.to_array(), quat_xyzw: turn.to_array() }),
        hand: Some(sigma.to_vec()),
        effort: None,
    }
}

/// Plays random commands for `seconds`; a run that ends is followed by another one.
fn play(task: &Arc<Task>, hand: &Arc<Hand>, seed: u64, seconds: f64) -> Result<Tally> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (mut tally, mut left) = (Tally::default(), (seconds / task.tick_s).round() as u64);
    while left > 0 {
        let mut run =
            Run::new(Arc::clone(task), Arc::clone(hand), Seed::from_u64(seed + 1_000_000 * tally.runs))
                .with_context(|| format!("{}, seed {seed}", hand.name))?;
        let start = run.world().state().base.rotation;
        let (mut sigma, mut action, mut until) = (vec![0.0; hand.motors.len()], Action::default(), 0);
        tally.runs += 1;
        while left > 0 && run.over().is_none() {
            if run.tick() >= until {
                action = command(&mut random, start, &mut sigma);
                let piece_s = PIECE_S[0] + (PIECE_S[1] - PIECE_S[0]) * uniform(&mut random).powi(2);
                until = run.tick() + (piece_s / task.tick_s).ceil() as u64;
            }
            run.step(&action).with_context(|| format!("{}, seed {seed}", hand.name))?;
            let why = run.failure().as_ref().map(Failure::to_string).unwrap_or_default();
            ensure!(run.healthy(), "{}, seed {seed}, tick {}: {why}", hand.name, run.tick());
            tally = tally.join(Tally::of(&run));
            left -= 1;
        }
    }
    Ok(tally)
}

/// Plays `count` seeds from `seed` on, on all cores. An error names hand, seed, tick and fault.
pub fn check(hand: &Arc<Hand>, seed: u64, count: u64, seconds: f64) -> Result<Tally> {
    let task = Task::builtin().into_iter().find(|task| task.name == TASK).context("the task is built in")?;
    let next = AtomicU64::new(0);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let worker = || -> Result<Tally> {
        let mut tally = Tally::default();
        loop {
            let k = next.fetch_add(1, Ordering::Relaxed);
            if k >= count {
                return Ok(tally);
            }
            tally = tally.join(play(&task, hand, seed + k, seconds)?);
        }
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..cores).map(|_| scope.spawn(worker)).collect();
        workers.into_iter().try_fold(Tally::default(), |tally, worker| {
            let found = worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
            Ok(tally.join(found))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use palmares_models::builtin::builtin_hands;

    /// `palmares-bench robust --hands 100` plays 100 seeds of 30 s each.
    #[test]
    fn no_built_in_hand_fails_under_random_commands() {
        for hand in builtin_hands() {
            let tally = check(hand, 1, 2, 1.0).expect("no fault");
            assert!(tally.limit_excess < 0.2, "{}: {tally:?}", hand.name);
        }
    }

    #[test]
    fn equal_seeds_give_equal_runs() {
        let hand = Hand::builtin("pinch").expect("built in");
        let played = || format!("{:?}", check(&hand, 7, 2, 0.5).expect("no fault"));
        assert_eq!(played(), played());
    }
}
