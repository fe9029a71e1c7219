//! What is written into a replay, one after the other.

use crate::messages::{ActionMessage, StateHash};
use crate::poses::Picture;
use palmares_tasks::{Event, Outcome};

/// Something to be written.
#[derive(Debug)]
pub(crate) enum Item {
    /// What led from a tick to the next.
    Action(ActionMessage),
    /// The referee's note.
    Event(Event),
    /// Digest of the state at a tick.
    Hash(u64, StateHash),
    /// Where everything is.
    Picture(Picture),
    /// How the run ended.
    Outcome(Box<Outcome>),
}
