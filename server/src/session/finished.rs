//! A run that has ended, and the decision on its status.

use super::machine::Playing;
use palmares_replay::ReplayFile;
use palmares_tasks::run::Failure;
use palmares_tasks::{Fault, Outcome, Reason};
use palmares_worlds::world::realtime::RealtimeStats;

/// A run that has ended.
#[derive(Debug)]
pub(super) struct FinishedRun {
    pub(super) run: Playing,
    pub(super) outcome: Outcome,
    pub(super) decision: Decision,
    pub(super) stats: RealtimeStats,
    pub(super) replay: Option<ReplayFile>,
}

/// The status of a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, strum::IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub(super) enum RunStatus {
    /// A practice run.
    Practice,
    /// It counts; its replay is not verified yet.
    Provisional,
    /// It ended before its first tick.
    Aborted,
    /// It counts for nothing.
    Voided {
        /// Whether its time is given back.
        refunded: bool,
    },
}

impl RunStatus {
    /// As stored.
    pub(super) fn word(self) -> &'static str {
        self.into()
    }
}

/// The facts about a run's end that decide its status.
#[derive(Clone, Copy, Debug)]
pub(super) struct RunEnd {
    /// Reason why it ended.
    pub(super) reason: Reason,
    /// Whether the session is official.
    pub(super) official: bool,
    /// Number of ticks, or the failure of the world.
    pub(super) ticks: Result<u64, Failure>,
    /// Whether the replay is missing.
    pub(super) replay_lost: bool,
    /// Whether the hand is the team's own.
    pub(super) own_hand: bool,
}

/// A run's status, and a note for people.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Decision {
    pub(super) status: RunStatus,
    pub(super) note: Option<String>,
}

impl Decision {
    /// Decides on a run's end. `note` is the reason given with its end.
    pub(super) fn on(end: RunEnd, note: Option<&str>) -> Self {
        let noted = |note: &str| Some(note.to_owned());
        let given = note.and_then(noted);
        let (status, note) = match (end.ticks, end.reason, end.official) {
            (Err(failure), ..) => {
                let (refunded, why) = refund_decision(&failure, end.own_hand);
                (RunStatus::Voided { refunded }, Some(why))
            }
            (_, Reason::Voided, _) => (RunStatus::Voided { refunded: true }, given),
            (_, _, false) => (RunStatus::Practice, given),
            // Only runs with a replay count. A missing one is the server's fault.
            (_, _, true) if end.replay_lost => {
                (RunStatus::Voided { refunded: true }, noted("the replay could not be written"))
            }
            (Ok(0), _, true) => {
                (RunStatus::Aborted, given.or_else(|| noted("it ended before its first tick")))
            }
            (Ok(_), _, true) => (RunStatus::Provisional, given),
        };
        Decision { status, note }
    }

    /// Whether the run's time is given back.
    pub(super) fn refunds(&self) -> bool {
        self.status == RunStatus::Voided { refunded: true }
    }
}

/// Decides whether the time of a failed run is given back, with the note. It is not for a team's own hand or for actions beyond the
/// work limit, with which a team could gain time at will.
fn refund_decision(failure: &Failure, own_hand: bool) -> (bool, String) {
    let kept = match (failure.fault, own_hand) {
        (_, true) => Some("the hand is the team's own"),
        (Fault::WorkExhausted, false) => Some("no tick has time for such actions"),
        (Fault::NotFinite | Fault::OutOfBounds | Fault::Unsolvable | Fault::Crashed, false) => None,
    };
    let time = kept.map_or(String::new(), |why| format!(". Its time is not given back: {why}"));
    (kept.is_none(), format!("{failure}{time}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn failed(fault: Fault) -> Failure {
        Failure { fault, tick: 7, step: Some(62) }
    }

    #[test]
    fn a_team_gains_no_time_by_breaking_its_own_world() {
        for &fault in Fault::ALL {
            for own_hand in [false, true] {
                let (given_back, why) = refund_decision(&failed(fault), own_hand);
                let refunded = !own_hand && fault != Fault::WorkExhausted;
                assert_eq!(given_back, refunded, "{fault:?}, {own_hand}");
                assert_eq!(why.contains("not given back"), !refunded, "{why}");
                assert!(why.contains(fault.code()) && why.contains("step 62"), "{why}");
            }
        }
    }

    #[test]
    fn the_status_of_a_run_follows_from_its_end() {
        let counted = |reason, official, ticks| RunEnd {
            reason,
            official,
            ticks: Ok(ticks),
            replay_lost: false,
            own_hand: false,
        };
        let lost = |end| RunEnd { replay_lost: true, ..end };
        let failure = failed(Fault::Unsolvable);
        let why = failure.to_string();
        let broken = |end, own_hand| RunEnd { ticks: Err(failure), own_hand, ..end };
        let (stopped, voided) = (counted(Reason::Stopped, true, 7), counted(Reason::Voided, true, 7));
        let none = counted(Reason::Stopped, true, 0);
        let practice = counted(Reason::Stopped, false, 7);
        let (refunded, kept) = (RunStatus::Voided { refunded: true }, RunStatus::Voided { refunded: false });
        let unwritten = Some("the replay could not be written");
        for (end, status, note) in [
            (stopped, RunStatus::Provisional, Some("given")),
            (none, RunStatus::Aborted, Some("given")),
            (practice, RunStatus::Practice, Some("given")),
            (counted(Reason::Stopped, false, 0), RunStatus::Practice, Some("given")),
            (voided, refunded, Some("given")),
            (counted(Reason::Voided, false, 7), refunded, Some("given")),
            (lost(stopped), refunded, unwritten),
            (lost(none), refunded, unwritten),
            (lost(voided), refunded, Some("given")),
            (lost(practice), RunStatus::Practice, Some("given")),
            (broken(stopped, false), refunded, Some(why.as_str())),
            (broken(lost(practice), false), refunded, Some(why.as_str())),
            (broken(stopped, true), kept, None),
        ] {
            let decision = Decision::on(end, Some("given"));
            assert_eq!((decision.status, decision.refunds()), (status, status == refunded), "{end:?}");
            assert!(note.is_none_or(|note| decision.note.as_deref() == Some(note)), "{end:?}: {decision:?}");
        }
        assert_eq!(Decision::on(stopped, None).note, None);
        let note = Decision::on(none, None).note;
        assert_eq!(note.as_deref(), Some("it ended before its first tick"));
    }
}
