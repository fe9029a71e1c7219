//! Likeness of the movements of two runs, to find runs that repeat another team's run in the same scene.
//!
//! It compares where the hand was, not its commands: the path of its base and its closing, smoothed over 0.3 s and cut into steps of
//! equal length. So noise, another rate of actions, pauses, another pace and another kind of action make little difference. Two
//! controllers that find their own way in a scene are centimetres apart. `client-py/benchmarks/likeness.py` measures both.

mod alignment;
mod path;
#[cfg(test)]
mod tests;

use crate::reader::Replay;
use crate::verify::{Verified, verify_watched};
use crate::verify_error::VerifyError;
pub use alignment::{Likeness, compare};
use palmares_tasks::{Run, Task};
pub use path::Path;
use path::Recorder;
use std::sync::Arc;

/// Verifies a replay, and returns the path of its hand as well. `own`: tasks that are not built in.
pub fn verified_path(replay: &Replay, own: &[Arc<Task>]) -> Result<(Verified, Path), VerifyError> {
    let mut recorder = Recorder::new(replay.header.tick_s);
    let verified = verify_watched(replay, own, Some(&mut |run: &mut Run| recorder.see(run)))?;
    Ok((verified, recorder.finish()))
}

/// How alike two replays are; None if they have no stretch in common, or one of them hardly moves.
///
/// # Errors
/// One cannot be verified here.
pub fn likeness(one: &Replay, other: &Replay, own: &[Arc<Task>]) -> Result<Option<Likeness>, VerifyError> {
    let (one, other) = (verified_path(one, own)?.1, verified_path(other, own)?.1);
    let comparable = one.is_comparable() && other.is_comparable();
    Ok(if comparable { compare(&one, &other) } else { None })
}
