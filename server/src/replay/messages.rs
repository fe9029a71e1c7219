//! What is written on the channels that decide a score. JSON; a number is written with as many digits as bring
//! back its bits.

use palmares_tasks::Action;
use palmares_tasks::observation::Wrench;
use serde::{Deserialize, Serialize};

/// The action that led from `tick` to `tick + 1`, as applied.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ActionMessage {
    /// The tick the world was at.
    pub(super) tick: u64,
    /// Clipped, with everything filled in.
    pub(super) action: Action,
    /// Wrenches from outside that began here.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) pushes: Vec<PushMessage>,
}

/// A wrench on a link from outside.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PushMessage {
    /// Name of the link.
    pub(crate) link: String,
    /// In the world frame.
    pub(crate) wrench: Wrench,
    /// For how long, s.
    pub(crate) duration_s: f64,
}

/// The state at a tick.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct HashMessage {
    /// Ticks since reset.
    pub(super) tick: u64,
    /// Digest of every bit of the state, 16 hexadecimal digits.
    pub(super) state: String,
    /// The chain before this message, 64 hexadecimal digits.
    pub(super) chain: String,
}
