//! How a run ends.

use crate::observation::Event;
use palmares_sim::Fault;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Why a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// The team stopped it.
    Stopped,
    /// Nothing more can be gained: all objects are in the goal.
    Complete,
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

impl Reason {
    /// As on the wire.
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

/// What a finished run is worth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Outcome {
    /// Points.
    pub score: f64,
    /// Objects in the goal box; where objects are arranged, goals reached.
    pub in_goal: u32,
    /// Objects outside both boxes.
    pub outside: u32,
    /// Why the run ended.
    pub reason: Reason,
    /// What the world failed of; absent when it did not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fault: Option<Fault>,
    /// Ticks played, without the settling.
    pub ticks: u64,
    /// s of simulated time played, without the settling.
    pub sim_time_s: f64,
    /// Everything the referee noted.
    pub events: Vec<Event>,
    /// Hash of the final state, 16 hexadecimal digits.
    pub state_hash: String,
}
