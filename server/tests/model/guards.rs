//! The rules of the code that keep results safe. The model breaks one of them at a time.

/// A rule of the code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, strum::EnumIter)]
pub(crate) enum Guard {
    /// `Store::fenced`: a write needs the epoch of its owner.
    EpochIsChecked,
    /// `Store::fenced`: the check locks the session's row until the write is done.
    CheckLocksTheRow,
    /// `ShippingConnection::store_ticks`: the same for ticks.
    TicksAreFenced,
    /// `Store::finish_run`: only an open run gets a result.
    OnlyOpenRunsFinish,
    /// `Session::finish`: a result is stored before it is sent.
    StoredBeforeSent,
    /// `Session::finish`: a result that could not be stored is kept for another attempt.
    ResultIsKept,
    /// `Session::finish`: the ticks are deleted after the result is stored.
    TicksOutliveTheRun,
    /// `Session::pass_gate`: the client sees a bounded number of ticks that are not stored.
    GateBoundsTicks,
    /// `Session::step`: also when the run is over and its result could not be stored.
    GateAtTheEnd,
    /// `Backlog::take`: ticks without an answer are sent again in the same rows.
    RowsAreSentAgain,
    /// `Rounds::send_snapshots` and `skip_to_snapshot`: a snapshot is of a tick that is stored.
    SnapshotAfterTicks,
    /// `Sessions::give_up_orphans`: a session that this process owns and does not have is given up.
    OrphansAreGivenUp,
    /// `Registry::insert`: a session that was lost and taken again replaces the lost one.
    LostIsReplaced,
    /// `Sessions::continued`: the last write is done before the session is in the registry.
    WholeBeforeRegistry,
    /// `Sessions::follow_owners`: a beat finds the orders that have not reached the session.
    OrdersAreFollowed,
    /// `Sessions::end_lost`: the runs of ended sessions end, even if their host is gone.
    EndedSessionsAreSwept,
}
