//! The connection by which a host shows runs of another host: what it carries, and who may open it.
//!
//! Both ends are of one version: hosts with another engine or configuration do not share a database.

use super::binary::WirePose;
use super::messages::WatchRun;
use hmac::{Hmac, KeyInit, Mac};
use palmares_tasks::Sensing;
use palmares_tasks::referee::ObjectStatus;
use palmares_tasks::run::{Contact, Telemetry};
use palmares_worlds::clock::SessionClock;
use serde::{Deserialize, Serialize};
use sha2::Sha256;
use std::fmt::{self, Debug, Formatter};
use std::time::Duration;

/// Address of a run for other hosts, without its id.
pub(super) const PATH: &str = "/v1/internal/watch/";
/// Header with the proof that the client is a host of this competition.
pub(super) const PROOF: &str = "palmares-host-proof";
/// Time between two messages [`ToViewerHost::Clock`], which also show that the connection is alive.
pub(super) const CLOCK_PERIOD: Duration = Duration::from_secs(1);

/// Prefix of every proof, so that nothing else that is made with the key is one.
const CONTEXT: &[u8] = b"palmares host watch 1\0";

/// A message from the host that has the run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) enum ToViewerHost {
    /// First.
    Opened(Opened),
    /// The newest frame, at most 30 times a second.
    Frame(LinkFrame),
    /// A message that must not be skipped, as every viewer gets it.
    Message(String),
    /// The last message of the run, as every viewer gets it.
    Ended(String),
    /// The session's clock, once a second; None when it is not known.
    Clock(Option<LinkClock>),
}

/// The constants of a run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Opened {
    pub(super) info: WatchRun,
    pub(super) sensing: Sensing,
    /// Whether the team uploaded the hand.
    pub(super) own_hand: bool,
    /// The message `scene`: with the hand's full description, and without.
    pub(super) scenes: [String; 2],
}

/// A frame, with the overlays that the viewers of the other host have.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct LinkFrame {
    pub(super) tick: u64,
    pub(super) sim_time_s: f64,
    pub(super) score: f64,
    pub(super) late_s: Option<f64>,
    pub(super) poses: Vec<WirePose>,
    pub(super) telemetry: Option<Telemetry>,
    pub(super) contacts: Option<Vec<Contact>>,
    pub(super) verdicts: Option<Vec<ObjectStatus>>,
}

/// The clock of a session, for spectators.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct LinkClock {
    /// s; None without a limit.
    pub(super) left_s: Option<f64>,
    pub(super) elapsed_s: f64,
    pub(super) paused: bool,
}

impl LinkClock {
    /// The clock at this time.
    pub(super) fn of(clock: &SessionClock, now: Duration) -> Self {
        LinkClock { left_s: clock.left_s(now), elapsed_s: clock.elapsed_s(now), paused: clock.is_paused() }
    }
}

/// A message in postcard.
pub(super) fn encoded<T: Serialize>(message: &T) -> Vec<u8> {
    // Every list has a length, and memory has room: encoding cannot fail.
    postcard::to_stdvec(message).unwrap_or_default()
}

/// The key that all hosts of a competition share.
#[derive(Clone)]
pub(crate) struct FleetKey(Vec<u8>);

impl Debug for FleetKey {
    /// Without the key.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str("FleetKey")
    }
}

impl FleetKey {
    /// The key from the content of the file with the signing key.
    pub(crate) fn new(signing_key: &str) -> Self {
        FleetKey(signing_key.trim().as_bytes().to_vec())
    }

    fn mac(&self, run_id: &str) -> Option<Hmac<Sha256>> {
        // HMAC takes keys of any length.
        let mut mac = Hmac::<Sha256>::new_from_slice(&self.0).ok()?;
        mac.update(CONTEXT);
        mac.update(run_id.as_bytes());
        Some(mac)
    }

    /// The proof that a host sends to watch a run.
    pub(super) fn proof(&self, run_id: &str) -> String {
        self.mac(run_id).map(|mac| hex::encode(mac.finalize().into_bytes())).unwrap_or_default()
    }

    /// Whether a proof is right, in a time that does not depend on it.
    pub(super) fn accepts(&self, run_id: &str, proof: &[u8]) -> bool {
        let Ok(proof) = hex::decode(proof) else { return false };
        self.mac(run_id).is_some_and(|mac| mac.verify_slice(&proof).is_ok())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_proof_is_for_one_run_and_needs_the_key() {
        let (key, other) = (FleetKey::new("00ff\n"), FleetKey::new("00fe"));
        let proof = key.proof("r1");
        assert!(FleetKey::new("00ff").accepts("r1", proof.as_bytes()));
        assert!(!key.accepts("r2", proof.as_bytes()) && !other.accepts("r1", proof.as_bytes()));
        for wrong in ["", "00", "no hexadecimal digits", &proof[1..], &proof[2..], &format!("{proof}00")] {
            assert!(!key.accepts("r1", wrong.as_bytes()), "{wrong}");
        }
    }
}
