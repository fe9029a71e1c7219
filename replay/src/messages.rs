//! What is written on the channels that decide a score. JSON; a number is written with as many digits as bring
//! back its bits.

use crate::lower_hex::from_hex;
use palmares_tasks::observation::Wrench;
use palmares_tasks::{Action, Run};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The action that led from `tick` to `tick + 1`, as applied.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ActionMessage {
    /// The tick the world was at.
    pub(crate) tick: u64,
    /// Clipped, with everything filled in.
    pub(crate) action: Action,
    /// Where it led: digest of every bit of the state at `tick + 1`. Early files have it every hundred ticks only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) state: Option<StateHash>,
    /// Wrenches from outside that began here.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) pushes: Vec<PushMessage>,
}

/// A digest of every bit of a state, written as 16 hexadecimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StateHash(pub u64);

impl StateHash {
    /// Of the state that a run is in.
    pub(crate) fn of(run: &Run) -> Self {
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
        // One spelling each: what was read writes the same bytes again.
        let digest = from_hex(&text).map(|bytes| StateHash(u64::from_be_bytes(bytes)));
        digest.ok_or_else(|| D::Error::custom("expected 16 hexadecimal digits"))
    }
}

/// A wrench on a link from outside.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PushMessage {
    /// Name of the link.
    pub link: String,
    /// In the world frame.
    pub wrench: Wrench,
    /// For how long, s.
    pub duration_s: f64,
}

/// The state at a tick.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct HashMessage {
    /// Ticks since reset.
    pub(crate) tick: u64,
    /// Digest of every bit of the state.
    pub(crate) state: StateHash,
    /// The chain before this message, 64 hexadecimal digits.
    pub(crate) chain: String,
}
