//! Commands of organizers to sessions.

use palmares_protocol::Refusal;
use tokio::sync::oneshot;

/// A command of an organizer.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Command {
    /// Stops clock and world.
    Pause,
    /// Continues clock and world.
    Resume,
    /// Stops clock and world while the competition is paused, or continues them.
    PauseCompetition(bool),
    /// Makes the session longer, or shorter again.
    Grant {
        /// Additional time, s; negative if granted time is taken back.
        seconds: f64,
    },
    /// Voids a run of the session: it ends if it is open, and its time is given back.
    VoidRun {
        /// The run.
        run_id: String,
        /// The reason, for people.
        note: String,
    },
    /// Makes a void run of the session count again, and takes its time again.
    UnvoidRun {
        /// The run.
        run_id: String,
        /// Id of the organizer's token.
        actor: String,
        /// The reason, for the audit.
        reason: String,
    },
    /// Gives the session to another host, where its client is.
    Release {
        /// Also if a connection holds it: that client has shown the resume token.
        firmly: bool,
    },
    /// Does what the session's row says: an organizer's command may have found no owner.
    Follow,
    /// Ends the session; its open run counts or is void.
    End {
        /// Whether the open run is void.
        void: bool,
        /// The reason, for people.
        note: String,
    },
}

/// A command and the way back for its result.
#[derive(Debug)]
pub(crate) struct PendingCommand {
    /// The command.
    pub(crate) command: Command,
    /// Gets the result.
    pub(crate) done: oneshot::Sender<Result<(), Refusal>>,
}
