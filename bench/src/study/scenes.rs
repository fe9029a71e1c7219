//! Scenes that readers know, and the row of each.

use super::watched::{Seen, WatchedFactory};
use crate::cases::{Setup, ends_of_steps, ramp, run};
use anyhow::{Context, Result, ensure};
use palmares_models::hand::Hand;
use palmares_sim::{Command, Law, Laws};
use palmares_tasks::{Run, Seed, Task};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Step of the rows, s; that of the tasks is the same.
const STEP_S: f64 = 1e-3;

/// Plays with all laws, and as many without those that never act: of the times of each the shortest counts.
const TURNS: usize = 3;

/// Duration of a task's scene, in which the hand closes where it starts, s.
const TASK_S: f64 = 2.0;

/// A scene.
#[derive(Clone, Copy, Debug)]
pub(super) enum KnownScene {
    /// A case of this crate.
    Case(&'static str),
    /// The SoftHand in a built-in task.
    Task(&'static str),
}

/// The scenes, from one body to many.
pub(super) const KNOWN: &[KnownScene] = &[
    KnownScene::Case("free_flight"),
    KnownScene::Case("coin_rim"),
    KnownScene::Case("mass_ratio"),
    KnownScene::Case("newton_cradle"),
    KnownScene::Case("sphere_stack"),
    KnownScene::Case("kapla"),
    KnownScene::Case("capstan"),
    KnownScene::Case("softhand_free"),
    KnownScene::Case("softhand_cylinder"),
    KnownScene::Case("softhand_box"),
    KnownScene::Case("softhand_balls"),
    KnownScene::Case("reflex_ball"),
    KnownScene::Case("hard_pressed_fingers"),
    KnownScene::Case("hard_pressed_base"),
    KnownScene::Case("dense_heap_and_hand"),
    KnownScene::Case("thirty_objects_and_hand"),
    KnownScene::Task("pan"),
    KnownScene::Task("peg"),
];

/// What a scene consists of and what its steps do.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct SceneRow {
    pub commit: String,
    /// Its name.
    pub scene: String,
    /// Length of the generalized velocity.
    pub coordinates: usize,
    /// Joint coordinates of the hand.
    pub joints: usize,
    /// Tendons, springs across joints, pins and dry friction, as rows of the solver.
    pub rows: usize,
    /// Motors.
    pub motors: usize,
    /// Links and objects.
    pub bodies: usize,
    /// Shapes.
    pub shapes: usize,
    /// Near pairs, pairs and points in the solver, and iterations, per step.
    pub near_pairs: f64,
    pub pairs: f64,
    pub points: f64,
    pub iterations: f64,
    /// CPU time of a step, µs.
    pub step_us: f64,
    /// Parts of it for dynamics, collision and solver.
    pub parts: [f64; 3],
    /// Laws, and the part of the steps in which each acts.
    pub laws: Vec<(String, f64)>,
    /// CPU time of a step without the laws that never act, as a part of that with them.
    pub without_idle: f64,
}

impl KnownScene {
    /// Its name.
    pub(super) fn name(self) -> String {
        match self {
            KnownScene::Case(name) => name.to_owned(),
            KnownScene::Task(name) => format!("task {name}"),
        }
    }

    /// Plays it without some laws.
    fn play(self, without: Laws) -> Result<Seen> {
        let factory = WatchedFactory::new(without);
        let setup = Setup::new(factory, STEP_S);
        match self {
            KnownScene::Case(name) => drop(run(name, &setup)?),
            KnownScene::Task(name) => play_task(name, &setup)?,
        }
        Ok(factory.seen())
    }

    /// Plays it, with all laws and without those that never act: its course must be the same.
    ///
    /// # Errors
    /// It cannot be played, or a law acts although no step shows it.
    pub(super) fn row(self, commit: &str) -> Result<SceneRow> {
        let seen = self.play(Laws::default())?;
        let tally = &seen.tally;
        ensure!(tally.steps > 0, "{} has no steps", self.name());
        let mut idle = Laws::default();
        Law::ALL.iter().for_each(|law| idle.insert_if(*law, tally.acted(*law) == 0));
        let mut least_us = [seen.us_per_step(), f64::INFINITY];
        for turn in 0..2 * TURNS - 1 {
            let bare = turn % 2 == 0;
            let mut again = self.play(if bare { idle } else { Laws::default() })?;
            // Without self-contact, pairs of links are never near.
            again.tally.near_pairs = tally.near_pairs;
            ensure!(again.tally == *tally, "{}: a law acts although no step shows it", self.name());
            let least = &mut least_us[usize::from(bare)];
            *least = least.min(again.us_per_step());
        }
        let spent: f64 = seen.phases_s.iter().sum();
        let laws = Law::ALL.iter().filter(|law| tally.acted(**law) > 0);
        Ok(SceneRow {
            commit: commit.to_owned(),
            scene: self.name(),
            coordinates: seen.parts.coordinates,
            joints: seen.parts.joints,
            rows: seen.parts.rows,
            motors: seen.parts.motors,
            bodies: seen.parts.bodies,
            shapes: seen.parts.shapes,
            near_pairs: tally.per_step(tally.near_pairs),
            pairs: tally.per_step(tally.pairs),
            points: tally.per_step(tally.points),
            iterations: tally.per_step(tally.iterations),
            step_us: least_us[0],
            parts: seen.phases_s.map(|part| part / spent),
            laws: laws.map(|law| (law.name().to_owned(), tally.per_step(tally.acted(*law)))).collect(),
            without_idle: least_us[1] / least_us[0],
        })
    }
}

/// The SoftHand closes where it starts in a built-in task.
fn play_task(name: &str, setup: &Setup) -> Result<()> {
    let task = Task::builtin().into_iter().find(|task| task.name == name).context("the task is built in")?;
    ensure!(task.step_s == setup.dt_s, "the steps of {name} have another length");
    let hand = Hand::builtin("softhand").context("the hand is built in")?;
    let run = Run::new(task, hand, Seed::from_u64(1))?;
    let (model, state) = (Arc::clone(run.world().model()), run.world().state().clone());
    let mut command = Command::stay(&model, state.reference.pose);
    let mut engine = setup.start(model, state)?;
    for t in ends_of_steps(TASK_S, setup.dt_s) {
        command.sigma.fill(ramp(t).0);
        engine.step(&command)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_row_of_a_scene_counts_its_parts_and_its_laws() {
        let row = KnownScene::Case("hard_pressed_base").row("abc").expect("it is played");
        // A hand alone: six coordinates of the base, and its joints.
        assert_eq!(row.coordinates, row.joints + 6);
        assert!(row.joints > 15 && row.motors == 1 && row.rows == 1 && row.bodies > 15, "{row:?}");
        assert!(row.near_pairs > row.pairs && row.points >= row.pairs && row.iterations > 1.0, "{row:?}");
        assert!((row.parts.iter().sum::<f64>() - 1.0).abs() < 1e-9 && row.step_us > 0.0);
        let part =
            |law: Law| row.laws.iter().find(|(name, _)| name == law.name()).map_or(0.0, |(_, part)| *part);
        assert!(
            part(Law::Anchors) > 0.1 && part(Law::Anchors) <= 1.0 && part(Law::HandOrder) > 0.0,
            "{row:?}"
        );
        assert_eq!([Law::Sleep, Law::BlowEnergy, Law::SupportTransfer].map(part), [0.0; 3]);
        // The links of the ReFlex do not touch each other here: leaving that law out changes no step.
        let alone = KnownScene::Case("reflex_ball").row("abc").expect("it is played");
        assert!(alone.laws.iter().all(|(name, _)| name != Law::SelfContact.name()), "{alone:?}");
        assert!(KnownScene::Case("no_such").row("abc").is_err());
    }

    #[test]
    fn every_known_scene_exists() {
        for scene in KNOWN {
            match scene {
                KnownScene::Case(name) => {
                    assert!(crate::cases::all().any(|case| case.name == *name), "{name}")
                }
                KnownScene::Task(name) => {
                    assert!(Task::builtin().iter().any(|task| task.name == *name), "{name}")
                }
            }
        }
    }
}
