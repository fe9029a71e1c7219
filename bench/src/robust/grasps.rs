//! Random grasps, randomly disturbed: nothing may break, explode, pass the floor or gain energy.
//!
//! The hand closes on a random object, palm down on its pedestal or palm up with the object on it; then the base goes
//! from target to target within its limits, σ jumps, links are pushed.

use super::all_hold;
use crate::cases::grasp::{Grasp, Placement, scene};
use crate::cases::random_heap::rotation;
use crate::monitor::Monitor;
use crate::rigs::softhand;
use anyhow::{Result, ensure};
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::BaseCommand;
use palmares_sim::Push;
use palmares_sim::{Command, Config, World};
use proptest::prelude::*;
use std::sync::Arc;

/// Steps of the runs, s.
const STEPS_S: [f64; 4] = [1e-3, 2e-3, 4e-3, 8e-3];
/// Duration of a command or a push, s.
const PIECE_S: f64 = 0.2;
/// Number of pieces in which the hand closes undisturbed, and of those that follow.
const CLOSING: usize = 4;
const DISTURBED: usize = 11;
/// Distance of the floor from the pedestal's top or, palm up, from the hand, m.
const FLOOR_M: f64 = 0.4;

/// Changes at the start of a piece of a run. Without a value the command stays as it was, and a push ends.
#[derive(Clone, Debug)]
struct Piece {
    /// Displacement of the base from its start, m, and its turn, rad.
    base: Option<([f64; 3], [f64; 3])>,
    /// Rarely: most grasps end with it.
    sigma: Option<f64>,
    /// Link, modulo the number of links; point in its frame, m; force, N.
    push: Option<(usize, [f64; 3], [f64; 3])>,
}

/// A grasp and its disturbances.
#[derive(Clone, Debug)]
pub struct Disturbed {
    dt_s: f64,
    grasp: Grasp,
    placement: Placement,
    palm_up: bool,
    pieces: Vec<Piece>,
}

/// The worst of a run.
pub struct Outcome {
    /// Energy, speeds, steps that failed.
    pub monitor: Monitor,
    /// Farthest centre of the object or base of the hand beyond the floor, m; negative when above it.
    pub escaped_m: f64,
    /// Whether the object was in the hand when the disturbance began, and at the end. Neither is required.
    pub kept: [bool; 2],
}

/// The worst of many grasps.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    /// Objects that were in the hand when the disturbance began.
    pub grasped: usize,
    /// Objects that were in the hand at the end.
    pub kept: usize,
    /// Largest energy from nowhere, as a part of the energy given and 0.1 J.
    pub excess: f64,
    /// Fastest object, m/s.
    pub object_speed: f64,
    /// Fastest joint, rad/s.
    pub joint_rate: f64,
    /// Deepest overlap, m.
    pub depth_m: f64,
}

/// A box, cylinder, sphere or capsule of 2 to 11 cm and 20 g to 1 kg in any orientation.
fn grasp() -> impl Strategy<Value = Grasp> {
    let half = || 0.01..0.05f64;
    let shape = prop_oneof![
        (0.015..0.055f64).prop_map(|radius| Shape::Sphere { radius }),
        [half(), half(), half()].prop_map(|half_extents| Shape::Box { half_extents, rounding: 0.0 }),
        (half(), half()).prop_map(|(radius, half_length)| Shape::Cylinder { radius, half_length }),
        (0.01..0.04f64, half()).prop_map(|(radius, half_length)| Shape::Capsule { radius, half_length }),
    ];
    (shape, 0.02f64.ln()..0f64, rotation()).prop_map(|(shape, log_mass, hand_from_object)| Grasp {
        shape,
        mass: log_mass.exp(),
        hand_from_object,
    })
}

/// Targets up to 0.2 m and 0.6 rad off along every axis, pushes of up to 12 N along every axis.
fn piece() -> impl Strategy<Value = Piece> {
    let cube = |half: f64| prop::array::uniform3(-half..half);
    let often = 0.5;
    (
        prop::option::weighted(often, (cube(0.2), cube(0.6))),
        prop::option::weighted(1.0 / 16.0, 0.0..1.0f64),
        prop::option::weighted(often, (0..64usize, cube(0.01), cube(12.0))),
    )
        .prop_map(|(base, sigma, push)| Piece { base, sigma, push })
}

/// Random grasps.
fn disturbed() -> impl Strategy<Value = Disturbed> {
    let placement = (0.13..0.19f64, -0.04..0.02f64, 0.5..1.0f64)
        .prop_map(|(along_m, across_m, sigma)| Placement { along_m, across_m, sigma });
    let steps = prop::sample::select(&STEPS_S[..]);
    (steps, grasp(), placement, any::<bool>(), prop::collection::vec(piece(), DISTURBED)).prop_map(
        |(dt_s, grasp, placement, palm_up, pieces)| Disturbed { dt_s, grasp, placement, palm_up, pieces },
    )
}

impl Disturbed {
    /// Plays it.
    fn play(&self) -> Result<Outcome> {
        let hand = softhand()?;
        // Palm up is palm down with gravity reversed.
        let down = if self.palm_up { 1.0 } else { -1.0 };
        let config = Config { gravity: Vec3::new(0.0, 0.0, 9.81 * down), ..Config::with_step(self.dt_s) };
        let (mut model, state, start) = scene(&hand, config, &self.grasp, self.placement)?;
        let floor = Shape::Box { half_extents: [30.0, 30.0, 0.1], rounding: 0.0 };
        model.add_static("floor", &floor, Pose::translation(0.0, 0.0, (FLOOR_M + 0.1) * down), 0.6)?;
        let mut world = World::new(Arc::new(model), state);
        let mut command = Command::stay(world.model(), start);
        let mut outcome =
            Outcome { monitor: Monitor::new(&world), escaped_m: f64::NEG_INFINITY, kept: [false; 2] };
        command.sigma[0] = self.placement.sigma;
        let mut pieces = self.pieces.iter();
        for piece in 0..CLOSING + DISTURBED {
            if piece == CLOSING {
                outcome.kept[0] = self.in_hand(&world);
            }
            if piece >= CLOSING {
                pieces.next().into_iter().for_each(|it| it.command(start, hand.links.len(), &mut command));
            }
            for _ in 0..(PIECE_S / self.dt_s).round() as u64 {
                world.step(&command);
                outcome.monitor.step(&world, &command);
                let state = world.state();
                for at in [state.base.translation, state.objects[0].translation] {
                    outcome.escaped_m = outcome.escaped_m.max(down * at.z - FLOOR_M);
                }
            }
        }
        outcome.kept[1] = self.in_hand(&world);
        Ok(outcome)
    }

    /// Whether the object is before the palm, no farther than fingers reach.
    fn in_hand(&self, world: &World) -> bool {
        let state = world.state();
        let at = state.base.inverse_transform_point(state.objects[0].translation);
        let placed = Vec3::new(0.05, self.placement.across_m, self.placement.along_m);
        at.x > 0.0 && (at - placed).length() < 0.08
    }
}

impl Piece {
    fn command(&self, start: Pose, links: usize, command: &mut Command) {
        if let Some((shift, turn)) = self.base {
            let turn = Rotation::from_scaled_axis(Vec3::from_array(turn));
            let at = start.translation + Vec3::from_array(shift);
            command.base = BaseCommand::stay(Pose::from_parts(at, turn * start.rotation));
        }
        if let Some(sigma) = self.sigma {
            command.sigma[0] = sigma;
        }
        command.pushes.clear();
        command.pushes.extend(self.push.map(|(link, point, force)| Push {
            link: link % links,
            point: Vec3::from_array(point),
            force: Vec3::from_array(force),
        }));
    }
}

impl Outcome {
    /// Checks the bounds of every grasp. Energy from nowhere is at most a hundredth of the input of motors,
    /// servo and pushes, plus 1 mJ; objects stay below 10 m/s, the base below 5 m/s, joints below 1000 rad/s.
    /// The base may hook onto the pedestal and come free under the servo's full force.
    fn judge(&self) -> Result<()> {
        let w = &self.monitor;
        ensure!(w.broken == 0, "{} steps not finite", w.broken);
        ensure!(w.unconverged == 0, "{} steps not converged", w.unconverged);
        let known = 0.01 * w.given_j + 1e-3;
        ensure!(w.excess_j <= known, "{:.2e} J from nowhere, {:.2} J given", w.excess_j, w.given_j);
        ensure!(self.escaped_m < 0.0, "object or hand are {} m beyond the floor", self.escaped_m);
        ensure!(w.object_speed <= 10.0, "object at {:.1} m/s", w.object_speed);
        ensure!(w.base_speed <= 5.0, "base at {:.1} m/s", w.base_speed);
        ensure!(w.joint_rate <= 1000.0, "joint at {:.0} rad/s", w.joint_rate);
        Ok(())
    }
}

/// The worst of `count` random grasps; an error describes the smallest grasp found that fails.
pub fn check(seed: u64, count: u32) -> Result<Tally> {
    let mut tally = Tally::default();
    all_hold(seed, count, &disturbed(), |grasp| {
        let outcome = grasp.play()?;
        let w = &outcome.monitor;
        tally.grasped += usize::from(outcome.kept[0]);
        tally.kept += usize::from(outcome.kept == [true; 2]);
        tally.excess = tally.excess.max(w.excess_j / (w.given_j + 0.1));
        tally.depth_m = tally.depth_m.max(w.depth_m);
        tally.object_speed = tally.object_speed.max(w.object_speed);
        tally.joint_rate = tally.joint_rate.max(w.joint_rate);
        outcome.judge()
    })?;
    Ok(tally)
}
