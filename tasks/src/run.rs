//! A run: one world, one task, one hand, from tick 0 to its score.

use crate::action::{Action, ActionError};
use crate::observation::{Event, HandObservation, Observation, Sensing, Wrench, BodyState};
use crate::scene::Scene;
use crate::seed::Seed;
use palmares_models::hand::Hand;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A task as read from its `task.toml`.
#[derive(Clone, Debug)]
pub struct Task {
    /// Identifier: `balls`.
    pub name: String,
    /// One sentence for people.
    pub description: String,
    /// Length of a tick, s.
    pub tick_s: f64,
    /// Length of a physics step, s; a whole number of them makes a tick.
    pub step_s: f64,
    /// The longest run, s of simulated time.
    pub time_limit_s: f64,
}

impl Task {
    /// The tasks that come with the program.
    pub fn builtin() -> Vec<Arc<Task>> {
        vec![Arc::new(Task { name: "balls".into(), description: String::new(), tick_s: 0.01, step_s: 0.001, time_limit_s: 600.0 })]
    }
}

/// Why a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// The team stopped it.
    Stopped,
    /// The session's time was up.
    SessionOver,
    /// The client went away and did not come back.
    Disconnected,
    /// The run's own time limit.
    TimeLimit,
    /// A fault of the simulation.
    WorldFault,
    /// An organizer voided it.
    Voided,
}

/// What a finished run is worth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Outcome {
    /// Points.
    pub score: f64,
    /// Objects in the goal box.
    pub in_goal: u32,
    /// Objects outside both boxes.
    pub outside: u32,
    /// Why the run ended.
    pub reason: Reason,
    /// Ticks played, without the settling.
    pub ticks: u64,
    /// s of simulated time played, without the settling.
    pub sim_time_s: f64,
    /// Everything the referee noted.
    pub events: Vec<Event>,
    /// Hash of the final state, 16 hexadecimal digits.
    pub state_hash: String,
}

/// One world, one task, one hand.
pub struct Run {
    task: Arc<Task>,
    hand: Arc<Hand>,
    scene: Scene,
    tick: u64,
    applied: Action,
}

/// Why a scene could not be built.
#[derive(Debug, thiserror::Error)]
#[error("task `{task}`: {message}")]
pub struct SceneError {
    /// Name of the task.
    pub task: String,
    /// What went wrong.
    pub message: String,
}

impl Run {
    /// Builds the scene and puts the world at tick 0. Takes up to a second of computing.
    pub fn new(task: Arc<Task>, hand: Arc<Hand>, _seed: Seed) -> Result<Self, SceneError> {
        Ok(Run { task, hand, scene: Scene { bodies: vec![], regions: vec![], gravity: [0.0, 0.0, -9.81] }, tick: 0, applied: Action::default() })
    }
    /// What stands in the world at tick 0.
    pub fn scene(&self) -> &Scene { &self.scene }
    /// The task.
    pub fn task(&self) -> &Arc<Task> { &self.task }
    /// The hand.
    pub fn hand(&self) -> &Arc<Hand> { &self.hand }
    /// Ticks since reset.
    pub fn tick(&self) -> u64 { self.tick }
    /// s since reset.
    pub fn sim_time_s(&self) -> f64 { self.tick as f64 * self.task.tick_s }
    /// Whether [`Run::step`] would take this action.
    pub fn check(&self, action: &Action) -> Result<(), ActionError> {
        if let Some(h) = &action.hand && h.len() != self.hand.motors.len() {
            return Err(ActionError::WrongLength { hand: self.hand.name.clone(), got: h.len(), expected: self.hand.motors.len() });
        }
        Ok(())
    }
    /// Advances the world by one tick under `action`.
    pub fn step(&mut self, action: &Action) -> Result<(), ActionError> {
        self.check(action)?;
        self.applied = action.clone();
        self.tick += 1;
        Ok(())
    }
    /// What a controller sees now. `events` are those since the last call of [`Run::step`].
    pub fn observe(&self, _sensing: Sensing) -> Observation {
        Observation { tick: self.tick, sim_time_s: self.sim_time_s(), applied_action: self.applied.clone(),
            hand: HandObservation { base: BodyState { position: [0.0; 3], quat_xyzw: [0.0, 0.0, 0.0, 1.0], linear: [0.0; 3], angular: [0.0; 3] }, actuators: vec![], wrist: Wrench { force: [0.0; 3], torque: [0.0; 3] } },
            truth: None, events: vec![], score: 0.0, terminated: false, truncated: false, reason: None }
    }
    /// Hash of the present state, 16 hexadecimal digits.
    pub fn state_hash(&self) -> String { "0".repeat(16) }
    /// Whether the world is still sound: finite, converged. A run that is not must be voided.
    pub fn healthy(&self) -> bool { true }
    /// Ends the run: freezes the hand, lets the objects settle for at most 3 s, counts.
    pub fn finish(&mut self, reason: Reason) -> Outcome {
        Outcome { score: 0.0, in_goal: 0, outside: 0, reason, ticks: self.tick, sim_time_s: self.sim_time_s(), events: vec![], state_hash: self.state_hash() }
    }
}
