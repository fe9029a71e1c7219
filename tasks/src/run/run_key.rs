//! Identifies the run of a snapshot.

use crate::seed::Seed;
use crate::sensing::Noise;
use crate::task::Task;
use palmares_models::hand::Hand;
use serde::{Deserialize, Serialize};

/// Key of a run: a run with the same key (scene, hand and sensors) can continue from a snapshot.
#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct RunKey {
    task: String,
    task_hash: String,
    hand: String,
    hand_hash: String,
    seed: [u8; 32],
    real_noise: bool,
    /// Hash of the task with its own steps, if these are longer: snapshots of its runs fit, too.
    finer_task_hash: Option<String>,
}

impl RunKey {
    pub(super) fn new(task: &Task, hand: &Hand, seed: Seed, noise: Noise) -> Self {
        RunKey {
            task: task.name.clone(),
            task_hash: task.content_hash().to_owned(),
            hand: hand.name.clone(),
            hand_hash: hand.content_hash(),
            seed: seed.0,
            real_noise: noise == Noise::Real,
            finer_task_hash: task.finer().map(str::to_owned),
        }
    }

    pub(super) fn is_of(&self, seed: Seed) -> bool {
        self.seed == seed.0
    }

    /// The first difference for which a run of this key cannot continue from a snapshot of another.
    pub(super) fn differs(&self, other: &RunKey) -> Option<&'static str> {
        let RunKey { task, task_hash, hand, hand_hash, seed, real_noise, finer_task_hash } = self;
        let of_task = *task_hash == other.task_hash || finer_task_hash.as_ref() == Some(&other.task_hash);
        let differences = [
            ("task", *task != other.task || !of_task),
            ("hand", (hand, hand_hash) != (&other.hand, &other.hand_hash)),
            ("seed", *seed != other.seed),
            ("noise", *real_noise != other.real_noise),
        ];
        differences.into_iter().find(|(_, differs)| *differs).map(|(what, _)| what)
    }
}
