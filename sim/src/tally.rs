//! What a scene consists of, and what its steps do.

use crate::actuation::elastic;
use crate::law::{Law, Laws};
use crate::model::{Model, Owner};
use crate::world::World;
use palmares_models::Vec3;

/// The parts of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Parts {
    /// Length of the generalized velocity: 6 for a hand's base and for each object, and one for each joint coordinate.
    pub coordinates: usize,
    /// Joint coordinates of the hand.
    pub joints: usize,
    /// Tendons of the hand.
    pub tendons: usize,
    /// Motors of the hand.
    pub motors: usize,
    /// Rows of the solver for tendons, springs across joints, pins, and dry friction.
    pub rows: usize,
    /// Links and objects.
    pub bodies: usize,
    /// Collision shapes of links, objects and furniture.
    pub shapes: usize,
}

impl Parts {
    /// Those of a scene.
    pub fn of(model: &Model) -> Self {
        let hand = model.hand();
        Parts {
            coordinates: model.velocity_len(),
            joints: hand.map_or(0, |hand| hand.coordinates.len()),
            tendons: hand.map_or(0, |hand| hand.tendons.len()),
            motors: hand.map_or(0, |hand| hand.motors.len()),
            rows: hand.map_or(0, |hand| elastic::rows(hand)) + model.friction_rows(),
            bodies: hand.map_or(0, |hand| hand.links.len()) + model.objects().len(),
            shapes: model.colliders().len(),
        }
    }
}

/// Sums over the steps of a run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Steps.
    pub steps: u64,
    /// Pairs of shapes whose boxes are near each other.
    pub near_pairs: u64,
    /// Pairs of shapes in the solver.
    pub pairs: u64,
    /// Contact points in the solver.
    pub points: u64,
    /// Newton iterations of the island that needs the most.
    pub iterations: u64,
    /// Per law, in the order of [`Law::ALL`]: steps in which it acted.
    laws: [u64; Law::ALL.len()],
}

impl Tally {
    /// Adds the last step of a world.
    pub fn add(&mut self, world: &World) {
        let collision = &world.scratch.work.collision;
        self.steps += 1;
        self.near_pairs += collision.distances.count() as u64;
        self.pairs += collision.contacts.pairs.len() as u64;
        self.points += collision.contacts.points.len() as u64;
        self.iterations += world.outcome().iterations as u64;
        for law in world.acted().iter() {
            self.laws[law as usize] += 1;
        }
    }

    /// Steps in which a law acted.
    pub fn acted(&self, law: Law) -> u64 {
        self.laws[law as usize]
    }

    /// A sum over the steps, for each step.
    pub fn per_step(&self, sum: u64) -> f64 {
        sum as f64 / self.steps.max(1) as f64
    }
}

impl World {
    /// The laws that had a part in the last step. One that had none can be left out of it without another bit of its result.
    pub fn acted(&self) -> Laws {
        let contacts = &self.scratch.work.collision.contacts;
        let mut acted = self.scratch.work.acted;
        for pair in &contacts.pairs {
            let points = &contacts.points[pair.points.clone()];
            let of_hand = [pair.a, pair.b].iter().all(|body| matches!(body, Owner::Link(_)));
            let stretched = points.iter().any(|it| it.anchor.stretch != Vec3::ZERO);
            let spins =
                pair.spin.is_some_and(|spin| points.iter().any(|it| spin.arm(it.anchor.bearing) > 0.0));
            acted.insert_if(Law::SelfContact, of_hand);
            acted.insert_if(Law::Anchors, stretched || points.iter().any(|it| it.anchor.twist != 0.0));
            acted.insert_if(Law::Anchors, pair.beside != Vec3::ZERO);
            acted.insert_if(Law::SpinFriction, spins);
            acted.insert_if(Law::Patches, points.iter().any(|it| it.friction_r != it.r || it.arm > 0.0));
            acted.insert_if(Law::DeadBlows, points.iter().any(|it| it.anchor.struck_s > 0.0));
        }
        acted.insert_if(Law::Sleep, self.state().sleep.iter().any(|sleep| sleep.asleep));
        acted
    }
}
