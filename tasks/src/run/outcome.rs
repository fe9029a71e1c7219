//! The end of a run.

use crate::observation::Event;
use palmares_sim::Fault;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Reason of the end of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// The team stopped it.
    Stopped,
    /// Nothing more can be gained by the rules of the task.
    Complete,
    /// The session's time was up.
    SessionOver,
    /// The client disconnected and did not come back.
    Disconnected,
    /// The run's own time limit.
    TimeLimit,
    /// A fault of the simulation.
    WorldFault,
    /// An organizer voided it.
    Voided,
}

impl Reason {
    /// Name on the wire.
    pub fn as_str(self) -> &'static str {
        match self {
            Reason::Stopped => "stopped",
            Reason::Complete => "complete",
            Reason::SessionOver => "session_over",
            Reason::Disconnected => "disconnected",
            Reason::TimeLimit => "time_limit",
            Reason::WorldFault => "world_fault",
            Reason::Voided => "voided",
        }
    }
}

/// Outcome of a finished run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Outcome {
    /// Points.
    pub score: f64,
    /// Objects in the goal; under rules `arrange`, reached goals.
    pub in_goal: u32,
    /// Objects outside goal and start.
    pub outside: u32,
    /// Reason of the end.
    pub reason: Reason,
    /// Fault of the world; absent if it did not fail.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fault: Option<Fault>,
    /// Ticks played, without the settling.
    pub ticks: u64,
    /// s of simulated time played, without the settling.
    pub sim_time_s: f64,
    /// All events of the referee.
    pub events: Vec<Event>,
    /// Hash of the final state, 16 hexadecimal digits.
    pub state_hash: String,
}
