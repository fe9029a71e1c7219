//! Identifies the run of a snapshot.

use crate::scene::Scene;
use crate::seed::Seed;
use crate::sensing::Noise;
use crate::task::{Task, Variation};
use palmares_models::content::ContentHash;
use palmares_models::hand::Hand;
use serde::{Deserialize, Serialize};

/// Key of a run: a run of the same task, hand, seed and sensors can continue from a snapshot, one with longer steps also from
/// that of the same scene with the task's own.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct RunKey {
    task: String,
    task_hash: String,
    hand: String,
    hand_hash: String,
    seed: [u8; 32],
    real_noise: bool,
    /// Hash of the task with its own steps, if these are longer.
    finer_task_hash: Option<String>,
    /// Hash of the scene: objects settle with the task's steps, and a scene that does not settle is drawn again.
    scene_hash: String,
}

impl RunKey {
    pub(super) fn new(task: &Task, hand: &Hand, seed: Seed, noise: Noise, scene: &Scene) -> Self {
        RunKey {
            task: task.name.clone(),
            task_hash: task.content_hash().to_owned(),
            hand: hand.name.clone(),
            hand_hash: hand.content_hash(),
            seed: seed.0,
            real_noise: noise == Noise::Real,
            finer_task_hash: task.finer().map(|finer| finer.content_hash.clone()),
            scene_hash: hash_of(task, scene),
        }
    }

    /// Whether it is of the same task, with the same steps.
    pub(super) fn is_of_task(&self, other: &RunKey) -> bool {
        self.task_hash == other.task_hash
    }

    pub(super) fn is_of(&self, seed: Seed) -> bool {
        self.seed == seed.0
    }

    /// The first difference for which a run of this key cannot continue from a snapshot of another.
    pub(super) fn differs(&self, other: &RunKey) -> Option<&'static str> {
        let finer = self.finer_task_hash.as_ref() == Some(&other.task_hash);
        let differences = [
            ("task", self.task != other.task || !(self.is_of_task(other) || finer)),
            ("hand", (&self.hand, &self.hand_hash) != (&other.hand, &other.hand_hash)),
            ("seed", self.seed != other.seed),
            ("noise", self.real_noise != other.real_noise),
            ("scene", finer && self.scene_hash != other.scene_hash),
        ];
        differences.into_iter().find(|(_, differs)| *differs).map(|(what, _)| what)
    }
}

/// Hash of what is drawn for a scene, but for the places.
fn hash_of(task: &Task, scene: &Scene) -> String {
    let mut hash = ContentHash::of("palmares scene 1");
    for body in scene.bodies.iter().filter(|body| body.free) {
        hash.text(&body.name);
        hash.float(body.mass);
        hash.floats(&body.com);
        hash.float(body.friction);
    }
    hash.float(task.variation().map_or(1.0, Variation::sensor_noise));
    hash.floats(&task.hand.position);
    hash.floats(&task.hand.quat_xyzw);
    hash.to_hex()
}
