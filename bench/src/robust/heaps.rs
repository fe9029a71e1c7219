//! Random heaps in a box, shaken: nothing may escape, explode or gain energy.
//!
//! A heap is 3 to 12 spheres, boxes, cylinders and capsules of 10 g to 5 kg. It is dropped into a box and then kicked.

use super::all_hold;
use crate::audit::{Audit, mechanical};
use crate::cases::Setup;
use crate::cases::random_heap::{Heap, heap};
use crate::cases::scene::{set_velocity, velocity};
use anyhow::{Result, ensure};
use palmares_models::Vec3;

/// The worst of a run of a heap.
#[derive(Clone, Copy, Debug, Default)]
pub struct HeapResult {
    /// Farthest centre beyond a wall or the floor, m; negative when inside.
    pub escaped_m: f64,
    /// Largest rise of energy that no kick explains, J.
    pub gain_j: f64,
    /// The same as a part of the available energy; see [`Audit::gain`].
    pub gain: f64,
    /// Deepest overlap, m.
    pub overlap_m: f64,
    /// Fastest body after the first impact, m/s.
    pub speed: f64,
    /// Steps in which Newton failed or a number was not finite.
    pub failed: u64,
}

impl Heap {
    /// Lets it fall for `time_s` and kicks it meanwhile.
    pub fn run(&self, dt_s: f64, time_s: f64) -> Result<HeapResult> {
        let setup = Setup::own(dt_s);
        let (mut engine, command) = self.start(&setup)?;
        let count = (time_s / dt_s).round() as u64;
        let mut result = HeapResult { escaped_m: f64::NEG_INFINITY, ..HeapResult::default() };
        let mut audit = Audit::default();
        for step in 0..count {
            for kick in &self.kicks {
                if (kick.at * count as f64) as u64 == step {
                    let body = kick.body % self.bodies.len();
                    let (linear, angular) = velocity(&*engine, body);
                    let before = mechanical(&*engine);
                    let (v, w) = (Vec3::from_array(kick.linear), Vec3::from_array(kick.angular));
                    set_velocity(&mut *engine, body, linear + v, angular + w);
                    let work = mechanical(&*engine) - before;
                    audit.worked(work);
                }
            }
            audit.step(&mut *engine, |engine| engine.step(&command).map(drop))?;
            let outcome = engine.outcome();
            result.failed += u64::from(!outcome.converged || !engine.state().is_finite());
            result.overlap_m = result.overlap_m.max(outcome.penetration_m);
            result.escaped_m = result.escaped_m.max(self.escaped(engine.state()));
            for k in 0..self.bodies.len() {
                result.speed = result.speed.max(velocity(&*engine, k).0.length());
            }
        }
        (result.gain_j, result.gain) = (audit.gain_j(), audit.gain());
        Ok(result)
    }
}

/// The worst of `count` random heaps, each as long as `time_s`; an error describes the smallest heap found that fails.
pub fn check(seed: u64, count: u32, dt_s: f64, time_s: f64) -> Result<HeapResult> {
    let mut worst = HeapResult { escaped_m: f64::NEG_INFINITY, ..HeapResult::default() };
    all_hold(seed, count, &heap(3..=12), |heap| {
        let result = heap.run(dt_s, time_s)?;
        worst.escaped_m = worst.escaped_m.max(result.escaped_m);
        worst.gain_j = worst.gain_j.max(result.gain_j);
        worst.gain = worst.gain.max(result.gain);
        worst.overlap_m = worst.overlap_m.max(result.overlap_m);
        worst.speed = worst.speed.max(result.speed);
        worst.failed += result.failed;
        result.check(dt_s)
    })?;
    Ok(worst)
}

impl HeapResult {
    /// Checks the bounds of every heap.
    pub fn check(&self, dt_s: f64) -> Result<()> {
        ensure!(self.failed == 0, "{} steps failed", self.failed);
        ensure!(self.escaped_m < 0.0, "a body is {} m beyond a wall", self.escaped_m);
        // A body that turns in contact is moved by semi-implicit Euler: its energy is known to the first order of
        // h, three thousandths a millisecond.
        let known = 3.0 * dt_s;
        ensure!(
            self.gain <= known,
            "energy grew by {} J, {} of the available energy",
            self.gain_j,
            self.gain
        );
        Ok(())
    }
}
