//! The observation of a controller after a tick.

use crate::action::Action;
use crate::hand_observation::HandObservation;
use crate::image::CameraImage;
use crate::sensing::Sensing;
use crate::table::{Numbers, Table};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// State after a tick. The server adds `id`, `run_id` and the session's clock around it.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Observation {
    /// Ticks since reset.
    pub tick: u64,
    /// s since reset.
    pub sim_time_s: f64,
    /// The action as applied: clipped to the spec, with omitted fields filled in.
    pub applied_action: Action,
    /// The hand.
    pub hand: HandObservation,
    /// The arm that carries the hand, where the task has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arm: Option<ArmReading>,
    /// Images of the requested cameras.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<CameraImage>,
    /// The full state, when the run's sensing is `truth`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truth: Option<Truth>,
    /// Events of this tick.
    pub events: Vec<Event>,
    /// Score if the run ended now, without the settling rule.
    pub score: f64,
    /// The task is complete: nothing more can be gained.
    pub terminated: bool,
    /// The run was cut short by a limit.
    pub truncated: bool,
    /// The reason, when `terminated` or `truncated`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

/// Readings of the joints of an arm, in its order. Their encoders have no error.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct ArmReading {
    /// rad, or m of a joint that slides.
    pub position: Vec<f64>,
    /// rad/s or m/s, mean of the last tick.
    pub velocity: Vec<f64>,
}

/// Pose and velocity of a body in the world frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BodyState {
    /// Origin of the body frame, m.
    pub position: [f64; 3],
    /// Orientation, x, y, z, w.
    pub quat_xyzw: [f64; 4],
    /// Velocity of the origin, m/s.
    pub linear: [f64; 3],
    /// rad/s
    pub angular: [f64; 3],
}

/// Force and torque in the world frame, torque about the base origin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Wrench {
    /// N
    pub force: [f64; 3],
    /// N·m
    pub torque: [f64; 3],
}

/// The full state.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Truth {
    /// Every free object, in scene order.
    pub objects: Objects,
    /// Joint coordinates, in the hand's coordinate order.
    pub joints: Joints,
    /// Every touching contact.
    pub contacts: Contacts,
    /// Equilibrium of the free hand at the present motor position, rad; empty if it is not defined.
    pub predicted_equilibrium: Numbers,
}

/// Pose and velocity of the free objects in the world frame: in every table one row for each.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Objects {
    /// Origin of the body frame, m.
    pub position: Table<3>,
    /// Orientation, x, y, z, w.
    pub quat_xyzw: Table<4>,
    /// Velocity of the origin, m/s.
    pub linear: Table<3>,
    /// rad/s
    pub angular: Table<3>,
}

/// Joint coordinates.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Joints {
    /// rad
    pub position: Numbers,
    /// rad/s
    pub velocity: Numbers,
}

/// Touching contacts, in every list one entry for each: force on body `b` by body `a`, world frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Contacts {
    /// Name of the first body.
    pub a: Vec<String>,
    /// Name of the second body.
    pub b: Vec<String>,
    /// m
    pub position: Table<3>,
    /// N
    pub force: Table<3>,
}

/// An event of the referee.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Event {
    /// Time of the event, ticks.
    pub tick: u64,
    /// Kind of the event: section 4 of docs/tasks.md lists them.
    pub kind: String,
    /// Index of the object: with sensing `truth`, and in a run's result.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<usize>,
}

impl Event {
    /// The event as a controller gets it: with `sensors` without the object, which would identify the held one.
    pub fn redacted_for(&self, sensing: Sensing) -> Event {
        Event { object: self.object.filter(|_| sensing == Sensing::Truth), ..self.clone() }
    }
}
