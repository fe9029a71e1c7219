//! The message `obs`, which comes thousands of times a second. It is written field by field: a derived writer gathers
//! the fields of a struct within it in another buffer first.

use crate::request::Mode;
use palmares_tasks::{Noise, Observation, Scene, Sensing};
use schemars::JsonSchema;
use serde::Serialize;
use serde::ser::{SerializeStruct, Serializer};

/// Inputs of the run.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Opened {
    /// Name of the task.
    pub task: String,
    /// Name of the hand.
    pub hand: String,
    /// Pace of the run.
    pub mode: Mode,
    /// `sensors` or `truth`.
    pub sensing: Sensing,
    /// `none` or `real`.
    pub noise: Noise,
    /// In practice: what `reset` takes to build this scene again.
    pub seed: Option<u64>,
    /// Length of a tick, s.
    pub tick_s: f64,
    /// Longest run, s of simulated time.
    pub time_limit_s: f64,
}

/// `obs`: the state after `reset` or `step`, or after a tick of a realtime run.
#[derive(Clone, Debug, JsonSchema)]
pub struct Obs {
    /// Id of the request; absent if the observation was streamed.
    #[schemars(skip_serializing_if = "Option::is_none")]
    pub id: Option<u64>,
    /// Identifies the run.
    pub run_id: String,
    /// s; null for a session without a limit.
    pub session_left_s: Option<f64>,
    /// The state.
    #[schemars(flatten)]
    pub observation: Observation,
    /// In a realtime run: how long after the tick was due this was sent, s.
    #[schemars(skip_serializing_if = "Option::is_none")]
    pub late_s: Option<f64>,
    /// The run has gone back: another host continues it, and this is the first observation.
    #[schemars(skip_serializing_if = "std::ops::Not::not")]
    pub resumed: bool,
    /// Inputs of the run; only in the reply to `reset`.
    #[schemars(skip_serializing_if = "Option::is_none")]
    pub run: Option<Opened>,
    /// Contents of the world; only in the reply to `reset`.
    #[schemars(skip_serializing_if = "Option::is_none")]
    pub scene: Option<Scene>,
}

/// Writes what is there.
fn written<S: SerializeStruct>(
    fields: &mut S,
    name: &'static str,
    value: Option<&impl Serialize>,
) -> Result<(), S::Error> {
    match value {
        Some(value) => fields.serialize_field(name, value),
        None => fields.skip_field(name),
    }
}

impl Serialize for Obs {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Obs { id, run_id, session_left_s, observation, late_s, resumed, run, scene } = self;
        // Destructured, so that none of its fields is forgotten.
        let Observation {
            tick,
            sim_time_s,
            applied_action,
            hand,
            arm,
            cameras,
            truth,
            events,
            score,
            terminated,
            truncated,
            reason,
        } = observation;
        let there = [
            id.is_some(),
            arm.is_some(),
            !cameras.is_empty(),
            truth.is_some(),
            reason.is_some(),
            late_s.is_some(),
            *resumed,
            run.is_some(),
            scene.is_some(),
        ];
        let always = 10;
        let count = always + there.into_iter().filter(|there| *there).count();
        let mut fields = serializer.serialize_struct("Obs", count)?;
        written(&mut fields, "id", id.as_ref())?;
        fields.serialize_field("run_id", run_id)?;
        fields.serialize_field("session_left_s", session_left_s)?;
        fields.serialize_field("tick", tick)?;
        fields.serialize_field("sim_time_s", sim_time_s)?;
        fields.serialize_field("applied_action", applied_action)?;
        fields.serialize_field("hand", hand)?;
        written(&mut fields, "arm", arm.as_ref())?;
        written(&mut fields, "cameras", (!cameras.is_empty()).then_some(cameras))?;
        written(&mut fields, "truth", truth.as_ref())?;
        fields.serialize_field("events", events)?;
        fields.serialize_field("score", score)?;
        fields.serialize_field("terminated", terminated)?;
        fields.serialize_field("truncated", truncated)?;
        written(&mut fields, "reason", reason.as_ref())?;
        written(&mut fields, "late_s", late_s.as_ref())?;
        written(&mut fields, "resumed", resumed.then_some(resumed))?;
        written(&mut fields, "run", run.as_ref())?;
        written(&mut fields, "scene", scene.as_ref())?;
        fields.end()
    }
}
