//! What organizers ask of sessions.

use palmares_protocol::Refusal;
use tokio::sync::oneshot;

/// What is asked.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Command {
    /// Clock and worlds stand still.
    Pause,
    /// They go on.
    Resume,
    /// The session gets longer.
    Grant {
        /// By how much, s.
        seconds: f64,
    },
    /// A run of the session is void: an open one ends, and the time of either is given back.
    VoidRun {
        /// Which.
        run_id: String,
        /// Why, for people.
        note: String,
    },
    /// The session ends; its open run counts or is void.
    End {
        /// Whether the open run is void.
        void: bool,
        /// Why, for people.
        note: String,
    },
}

/// A command on its way.
#[derive(Debug)]
pub(crate) struct PendingCommand {
    /// What is asked.
    pub(crate) command: Command,
    /// Told when it is done.
    pub(crate) done: oneshot::Sender<Result<(), Refusal>>,
}
