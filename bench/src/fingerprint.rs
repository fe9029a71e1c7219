//! A number that every build on every machine must print: the state after five scripted seconds of balls.

use anyhow::{Context, Result};
use palmares_models::Rotation;
use palmares_models::hand::Hand;
use palmares_tasks::{Action, BaseTarget, Run, Seed, Task};

/// State hash of the balls task with the SoftHand and seed 1 after 5 s of reaching into the box and closing. `prepared`:
/// every tick is [prepared](Run::prepare), as the server does while a controller thinks.
pub fn balls(prepared: bool) -> Result<String> {
    let task = Task::builtin().into_iter().find(|task| task.name == "balls").context("balls is built in")?;
    let hand = Hand::builtin("softhand").context("the SoftHand is built in")?;
    let tick_s = task.tick_s;
    let mut run = Run::new(task, hand, Seed::from_u64(1))?;
    for k in 0..(5.0 / tick_s) as u64 {
        if prepared {
            run.prepare();
        }
        run.step(&action(k as f64 * tick_s))?;
    }
    Ok(run.state_hash())
}

fn action(t: f64) -> Action {
    let down = Rotation::from_rotation_y(std::f64::consts::PI).to_array();
    let (position, sigma) = match t {
        t if t < 0.1 => ([0.0, 0.0, 0.7], 0.0),
        t if t < 2.0 => ([0.05, 0.02, 0.28], 0.0),
        t if t < 3.0 => ([0.05, 0.02, 0.28], 1.0),
        _ => ([0.05, 0.02, 0.6], 1.0),
    };
    Action { base: Some(BaseTarget::Pose { position, quat_xyzw: down }), hand: Some(vec![sigma]) }
}

#[cfg(test)]
mod tests {
    /// The file holds what a release build printed; this test runs in a debug build.
    #[test]
    fn every_build_reaches_the_same_state() {
        let golden = include_str!("../golden/balls_5s.txt").trim();
        assert_eq!(super::balls(false).expect("the run plays"), golden);
        assert_eq!(super::balls(true).expect("the run plays"), golden, "and again, every tick prepared");
    }
}
