//! Items that the recorder sends to the writer of a replay.

use crate::messages::{ActionMessage, StateHash};
use crate::poses::PoseFrame;
use palmares_tasks::{Event, Outcome};

/// An item of a replay.
#[derive(Debug)]
pub(crate) enum Item {
    /// A tick's action.
    Action(ActionMessage),
    /// An event of the referee.
    Event(Event),
    /// Digest of the state at a tick.
    Hash(u64, StateHash),
    /// The poses of all bodies, with a sample of the hand.
    Poses(Box<PoseFrame>),
    /// The outcome of the run, and the time of its end, ms since 1970 UTC.
    Outcome(Box<Outcome>, u64),
}
