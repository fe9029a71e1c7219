//! Random grasps, randomly disturbed.

use crate::cases::grasp::{Grasp, Placement, scene};
use crate::cases::synergy::softhand;
use crate::random::Random;
use crate::watch::Watch;
use anyhow::Result;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::actuation::base::BaseCommand;
use palmares_sim::world::Push;
use palmares_sim::{Command, Config, World};
use std::sync::Arc;

/// Steps of the runs, s, by turns.
const STEPS_S: [f64; 4] = [1e-3, 2e-3, 4e-3, 8e-3];
/// Length of a run, s.
const LASTS_S: f64 = 3.0;
/// How long a command or a push lasts, s.
const PIECE_S: f64 = 0.2;
/// How many pieces the hand has for closing in peace.
const CLOSING: u64 = 4;
/// Largest push, N.
const PUSH_N: f64 = 20.0;

/// What became of a random grasp.
pub struct Outcome {
    /// Its number.
    pub seed: u64,
    /// Its step, s.
    pub dt_s: f64,
    /// What was seen.
    pub watch: Watch,
    /// Whether the object was in the hand when the disturbance began, and at the end; it need not be.
    pub kept: [bool; 2],
}

impl Outcome {
    /// What is wrong with it; nothing in a sound run. Bounds: energy from nowhere at most a hundredth of what motors,
    /// servo and pushes gave, plus 1 mJ; objects below 10 m/s, the base below 5 m/s, joints below 1000 rad/s. The base may
    /// hook onto the pedestal and be let go under the servo's full force.
    pub fn faults(&self) -> Vec<String> {
        let w = &self.watch;
        let checks = [
            (w.broken > 0, format!("{} steps not finite", w.broken)),
            (w.unconverged > 0, format!("{} steps not converged", w.unconverged)),
            (
                w.excess_j > 0.01 * w.given_j + 1e-3,
                format!("{:.2e} J from nowhere, {:.2} J given", w.excess_j, w.given_j),
            ),
            (w.object_speed > 10.0, format!("object at {:.1} m/s", w.object_speed)),
            (w.base_speed > 5.0, format!("base at {:.1} m/s", w.base_speed)),
            (w.joint_rate > 1000.0, format!("joint at {:.0} rad/s", w.joint_rate)),
        ];
        checks.into_iter().filter(|(bad, _)| *bad).map(|(_, what)| what).collect()
    }
}

/// A box, cylinder, sphere or capsule of 2 to 11 cm and 20 g to 1 kg in any orientation.
fn object(random: &mut Random) -> Grasp {
    let half = |random: &mut Random| random.between(0.01, 0.05);
    let shape = match random.below(4) {
        0 => Shape::Box { half_extents: [half(random), half(random), half(random)], rounding: 0.0 },
        1 => Shape::Cylinder { radius: half(random), half_length: half(random) },
        2 => Shape::Sphere { radius: random.between(0.015, 0.055) },
        _ => Shape::Capsule { radius: random.between(0.01, 0.04), half_length: half(random) },
    };
    Grasp { shape, mass: random.magnitude(0.02, 1.0), hand_from_object: random.rotation() }
}

/// Plays the random grasp of a number: the hand closes on a random object, palm down on its pedestal or palm up with
/// the object on it; then the base goes from target to target within its limits, σ jumps, links are pushed.
pub fn play(seed: u64) -> Result<Outcome> {
    let mut random = Random::new(seed);
    let dt_s = STEPS_S[(seed % 4) as usize];
    let grasp = object(&mut random);
    let placement = Placement {
        along_m: random.between(0.13, 0.19),
        across_m: random.between(-0.04, 0.02),
        sigma: random.between(0.5, 1.0),
    };
    let hand = softhand()?;
    let up = if random.below(2) == 0 { -1.0 } else { 1.0 };
    let config = Config { gravity: Vec3::new(0.0, 0.0, 9.81 * up), ..Config::with_step(dt_s) };
    let (mut model, state, start) = scene(&hand, config, &grasp, placement)?;
    let floor = Shape::Box { half_extents: [30.0, 30.0, 0.1], rounding: 0.0 };
    model.add_static("floor", &floor, Pose::translation(0.0, 0.0, 0.5 * up), 0.6)?;
    let mut world = World::new(Arc::new(model), state);
    let mut command = Command::stay(world.model(), start);
    let mut watch = Watch::new(&world);
    let steps = (LASTS_S / dt_s).round() as u64;
    let piece = (PIECE_S / dt_s).round() as u64;
    let mut kept = [false; 2];
    command.sigma[0] = placement.sigma;
    for k in 0..steps {
        if k == CLOSING * piece {
            kept[0] = in_hand(&world, placement);
        }
        if k % piece == 0 && k / piece >= CLOSING {
            disturb(&mut random, start, hand.links.len(), &mut command);
        }
        world.step(&command);
        watch.step(&world, &command);
    }
    kept[1] = in_hand(&world, placement);
    Ok(Outcome { seed, dt_s, watch, kept })
}

/// Whether the object is before the palm, no farther than fingers reach.
fn in_hand(world: &World, placement: Placement) -> bool {
    let state = world.state();
    let at = state.base.inverse_transform_point(state.objects[0].translation);
    at.x > 0.0 && (at - Vec3::new(0.05, placement.across_m, placement.along_m)).length() < 0.08
}

/// A new piece of the disturbance: a target for the base, a push, a jump of σ, or none of them.
fn disturb(random: &mut Random, start: Pose, links: usize, command: &mut Command) {
    if random.below(2) == 0 {
        let turn = Rotation::from_scaled_axis(random.direction() * random.between(0.0, 1.0));
        let target = Pose::from_parts(start.translation + random.cube() * 0.2, turn * start.rotation);
        command.base = BaseCommand::stay(target);
    }
    // Rarely: most grasps end with it.
    if random.below(16) == 0 {
        command.sigma[0] = random.between(0.0, 1.0);
    }
    command.pushes.clear();
    if random.below(2) == 0 {
        command.pushes.push(Push {
            link: random.below(links),
            point: random.cube() * 0.01,
            force: random.direction() * random.between(0.0, PUSH_N),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hundred_random_grasps_are_sound() {
        for seed in 0..100 {
            let outcome = play(seed).expect("the scene is sound");
            assert!(outcome.faults().is_empty(), "seed {seed}: {:?}", outcome.faults());
        }
    }
}
