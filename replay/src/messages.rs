//! Messages of the channels that decide a score, in JSON. A number has as many digits as restore its bits.

use crate::lower_hex::from_hex;
use palmares_tasks::observation::Wrench;
use palmares_tasks::{Action, Run};
use schemars::JsonSchema;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The action of the step from `tick` to `tick + 1`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ActionMessage {
    /// The tick before the step.
    pub(crate) tick: u64,
    /// As applied: clipped and complete.
    pub(crate) action: Action,
    /// Digest of every bit of the state at `tick + 1`, 16 hexadecimal digits. Early files have it only every hundred
    /// ticks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) state: Option<StateHash>,
    /// External wrenches that begin with this step.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) pushes: Vec<PushMessage>,
}

/// A digest of every bit of a state, written as 16 hexadecimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, JsonSchema)]
#[schemars(transparent, inline)]
pub struct StateHash(#[schemars(with = "String")] pub u64);

impl StateHash {
    /// The digest of a run's present state.
    pub fn of(run: &Run) -> Self {
        StateHash(run.digest())
    }
}

impl std::fmt::Display for StateHash {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

impl Serialize for StateHash {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for StateHash {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        // Each digest has one spelling: reading and writing it gives the same bytes.
        let digest = from_hex(&text).map(|bytes| StateHash(u64::from_be_bytes(bytes)));
        digest.ok_or_else(|| D::Error::custom("expected 16 hexadecimal digits"))
    }
}

/// An external wrench on a link.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PushMessage {
    /// Name of the link.
    pub link: String,
    /// World frame.
    pub wrench: Wrench,
    /// Duration, s.
    pub duration_s: f64,
}

/// The state at a tick.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct HashMessage {
    /// Ticks since reset.
    pub(crate) tick: u64,
    /// Digest of every bit of the state, 16 hexadecimal digits.
    pub(crate) state: StateHash,
    /// Hash chain before this message, 64 hexadecimal digits.
    pub(crate) chain: String,
}
