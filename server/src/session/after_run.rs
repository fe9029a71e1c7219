//! The stored ticks of a run after its end.

/// The treatment of the stored ticks of a run that this session no longer plays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AfterRun {
    /// They stay for another host.
    Leave,
    /// The missing ones are stored as well: the replay can be written again from them until it is in safety.
    Complete,
    /// They are deleted: there is no replay.
    Delete,
}

impl AfterRun {
    /// After a result with or without a replay.
    pub(super) fn of(replay: bool) -> Self {
        if replay { AfterRun::Complete } else { AfterRun::Delete }
    }
}
