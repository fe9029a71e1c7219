//! The state of a run, in memory or as bytes.

use super::cameras::PoseHistory;
use super::carrying::ArmState;
use super::run_key::RunKey;
use super::targets::{BaseMotion, Pushing};
use crate::action::{Action, BaseTarget};
use crate::observation::Event;
use crate::seed::Seed;
use crate::task::RefereeState;
use flate2::Compression;
use flate2::read::DeflateDecoder;
use flate2::write::DeflateEncoder;
use palmares_models::Pose;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::io::{Read, Write};
use std::sync::Arc;

/// Begin of its bytes. Only the version of the program that wrote them reads them.
const MAGIC: &str = concat!("palmares snapshot ", env!("CARGO_PKG_VERSION"), "\n");
/// Bytes of the SHA-256 after it.
const DIGEST: usize = 32;
/// Maximum size of an unpacked snapshot.
const MAX_BYTES: u64 = 64 << 20;

/// A run after a tick, without its constants, the scene and the hand.
#[derive(Clone, Serialize, Deserialize)]
pub struct Snapshot {
    /// Whether a run of this process took it. Bytes can be anything.
    #[serde(skip)]
    pub(super) taken_here: bool,
    pub(super) key: Arc<RunKey>,
    pub(super) world: palmares_sim::Snapshot,
    pub(super) sensors: palmares_senses::SensorState,
    pub(super) referee: RefereeState,
    pub(super) pose_history: PoseHistory,
    pub(super) tick: u64,
    pub(super) target: BaseMotion,
    pub(super) arm: Option<ArmState>,
    pub(super) shaken_at: Option<Pose>,
    pub(super) applied: Applied,
    pub(super) pushing: Vec<Pushing>,
    pub(super) news: Vec<Noted>,
    pub(super) history: Vec<Noted>,
    pub(super) motor_work_j: Vec<f64>,
    pub(super) altered: bool,
    pub(super) under_way: Vec<Applied>,
}

/// Error of a snapshot from which a run cannot continue.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SnapshotError {
    /// The bytes are of something else, or incomplete.
    #[error("these {bytes} bytes are no snapshot of this version ({})", env!("CARGO_PKG_VERSION"))]
    Unreadable {
        /// Their number.
        bytes: usize,
    },
    /// The snapshot is of another run.
    #[error("the snapshot has another {what} than this run")]
    Other {
        /// `task`, `hand`, `seed`, `noise` or `scene`.
        what: &'static str,
    },
    /// The snapshot names this run, but its bytes and their digest were changed.
    #[error("the snapshot's {what} cannot be this run's: its bytes have been changed")]
    Unfit {
        /// The changed part.
        what: &'static str,
    },
}

/// An [`Action`] without names and with all fields, for postcard.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct Applied {
    base: Option<AppliedBase>,
    pub(super) hand: Option<Vec<f64>>,
    pub(super) effort: Option<Vec<f64>>,
}

/// A [`BaseTarget`] for postcard.
#[derive(Clone, Serialize, Deserialize)]
pub(super) enum AppliedBase {
    Pose([f64; 3], [f64; 4]),
    Twist([f64; 3], [f64; 3]),
    Joints(Vec<f64>),
}

/// An [`Event`] for postcard.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct Noted {
    tick: u64,
    kind: String,
    pub(super) object: Option<usize>,
}

impl Applied {
    /// Whether its lists fit a hand of so many motors on an arm of so many joints.
    pub(super) fn fits(&self, motors: usize, arm: Option<usize>) -> bool {
        let joints = match &self.base {
            Some(AppliedBase::Joints(joints)) => Some(joints.len()),
            _ => arm,
        };
        joints == arm && [&self.hand, &self.effort].into_iter().flatten().all(|all| all.len() == motors)
    }
}

impl From<&Action> for Applied {
    fn from(action: &Action) -> Self {
        let base = action.base.as_ref().map(|base| match base {
            BaseTarget::Pose { position, quat_xyzw } => AppliedBase::Pose(*position, *quat_xyzw),
            BaseTarget::Twist { linear, angular } => AppliedBase::Twist(*linear, *angular),
            BaseTarget::Joints { joints } => AppliedBase::Joints(joints.clone()),
        });
        Applied { base, hand: action.hand.clone(), effort: action.effort.clone() }
    }
}

impl From<&Applied> for Action {
    fn from(applied: &Applied) -> Self {
        let base = applied.base.as_ref().map(|base| match base {
            AppliedBase::Pose(position, quat_xyzw) => {
                BaseTarget::Pose { position: *position, quat_xyzw: *quat_xyzw }
            }
            AppliedBase::Twist(linear, angular) => BaseTarget::Twist { linear: *linear, angular: *angular },
            AppliedBase::Joints(joints) => BaseTarget::Joints { joints: joints.clone() },
        });
        Action { base, hand: applied.hand.clone(), effort: applied.effort.clone() }
    }
}

/// Converts events for postcard.
pub(super) fn noted(events: &[Event]) -> Vec<Noted> {
    let note =
        |Event { tick, kind, object }: &Event| Noted { tick: *tick, kind: kind.clone(), object: *object };
    events.iter().map(note).collect()
}

/// Converts them back.
pub(super) fn events(noted: &[Noted]) -> Vec<Event> {
    let event =
        |Noted { tick, kind, object }: &Noted| Event { tick: *tick, kind: kind.clone(), object: *object };
    noted.iter().map(event).collect()
}

impl Snapshot {
    /// The tick after which it was taken.
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// Whether it is of a run of this seed.
    pub fn is_of(&self, seed: Seed) -> bool {
        self.key.is_of(seed)
    }

    /// Encodes the snapshot, for this version of the program on any machine: [`Snapshot::from_bytes`] reads them.
    pub fn to_bytes(&self) -> Vec<u8> {
        let head = MAGIC.len() + DIGEST;
        let mut bytes = MAGIC.as_bytes().to_vec();
        bytes.resize(head, 0);
        let whole = postcard::to_stdvec(self).expect("a snapshot holds nothing without a length");
        let mut packer = DeflateEncoder::new(bytes, Compression::fast());
        packer.write_all(&whole).expect("memory takes it");
        let mut bytes = packer.finish().expect("memory takes it");
        let digest = Sha256::digest(&bytes[head..]);
        bytes[MAGIC.len()..head].copy_from_slice(&digest);
        bytes
    }

    /// Reads what [`Snapshot::to_bytes`] wrote.
    ///
    /// # Errors
    /// They are other bytes, or of another version.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, SnapshotError> {
        let unreadable = || SnapshotError::Unreadable { bytes: bytes.len() };
        let rest = bytes.strip_prefix(MAGIC.as_bytes()).ok_or_else(unreadable)?;
        let (digest, body) = rest.split_at_checked(DIGEST).ok_or_else(unreadable)?;
        if Sha256::digest(body).as_slice() != digest {
            return Err(unreadable());
        }
        let mut whole = Vec::new();
        DeflateDecoder::new(body).take(MAX_BYTES).read_to_end(&mut whole).map_err(|_| unreadable())?;
        postcard::from_bytes(&whole).map_err(|_| unreadable())
    }
}
