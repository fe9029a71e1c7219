//! A run that has ended, and what becomes of it.

use super::machine::Playing;
use crate::clock::Spent;
use crate::world::live::RealtimeStats;
use palmares_replay::ReplayFile;
use palmares_tasks::run::Failure;
use palmares_tasks::{Fault, Outcome, Reason};

/// A run that has ended.
#[derive(Debug)]
pub(super) struct Finished {
    pub(super) run: Playing,
    pub(super) outcome: Outcome,
    pub(super) decision: Decision,
    pub(super) stats: RealtimeStats,
    pub(super) replay: Option<ReplayFile>,
    /// How the session's clock stood then: what passes until the result is stored is the server's fault.
    pub(super) ended: Spent,
}

/// What a result counts for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, strum::IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub(super) enum RunStatus {
    /// It is listed as practice.
    Practice,
    /// It counts, until its replay has been played again.
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

/// What a run's end is judged by.
#[derive(Clone, Copy, Debug)]
pub(super) struct End {
    /// Why it ended.
    pub(super) reason: Reason,
    /// In an official session.
    pub(super) official: bool,
    /// Ticks that were counted, or how the world failed.
    pub(super) ticks: Result<u64, Failure>,
    /// Whether there is no replay where there should be one.
    pub(super) replay_lost: bool,
    /// Whether the hand is the team's own.
    pub(super) own_hand: bool,
}

/// What a run counts for, and why, for people.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Decision {
    pub(super) status: RunStatus,
    pub(super) note: Option<String>,
}

impl Decision {
    /// Decides on a run's end. `note`: what whoever ended it says.
    pub(super) fn on(end: End, note: Option<&str>) -> Self {
        let noted = |note: &str| Some(note.to_owned());
        let said = note.and_then(noted);
        let (status, note) = match (end.ticks, end.reason, end.official) {
            (Err(failure), ..) => {
                let (refunded, why) = blame(&failure, end.own_hand);
                (RunStatus::Voided { refunded }, Some(why))
            }
            (_, Reason::Voided, _) => (RunStatus::Voided { refunded: true }, said),
            (_, _, false) => (RunStatus::Practice, said),
            // A score is listed only when it replays. That it does not is the server's fault.
            (_, _, true) if end.replay_lost => {
                (RunStatus::Voided { refunded: true }, noted("the replay could not be written"))
            }
            (Ok(0), _, true) => {
                (RunStatus::Aborted, said.or_else(|| noted("it ended before its first tick")))
            }
            (Ok(_), _, true) => (RunStatus::Provisional, said),
        };
        Decision { status, note }
    }

    /// Whether the run's time is given back.
    pub(super) fn refunds(&self) -> bool {
        self.status == RunStatus::Voided { refunded: true }
    }
}

/// Whether the time of a run is given back whose world failed so, and what is noted. A team could make itself time with a
/// hand that breaks the physics, or with actions that no tick has time for.
fn blame(failure: &Failure, own_hand: bool) -> (bool, String) {
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
    fn a_team_wins_no_time_by_breaking_its_own_world() {
        for &fault in Fault::ALL {
            for own_hand in [false, true] {
                let (given_back, why) = blame(&failed(fault), own_hand);
                let refunded = !own_hand && fault != Fault::WorkExhausted;
                assert_eq!(given_back, refunded, "{fault:?}, {own_hand}");
                assert_eq!(why.contains("not given back"), !refunded, "{why}");
                assert!(why.contains(fault.code()) && why.contains("step 62"), "{why}");
            }
        }
    }

    #[test]
    fn what_a_run_counts_for_follows_from_its_end() {
        let counted = |reason, official, ticks| End {
            reason,
            official,
            ticks: Ok(ticks),
            replay_lost: false,
            own_hand: false,
        };
        let lost = |end| End { replay_lost: true, ..end };
        let failure = failed(Fault::Unsolvable);
        let why = failure.to_string();
        let broken = |end, own_hand| End { ticks: Err(failure), own_hand, ..end };
        let (stopped, voided) = (counted(Reason::Stopped, true, 7), counted(Reason::Voided, true, 7));
        let none = counted(Reason::Stopped, true, 0);
        let practice = counted(Reason::Stopped, false, 7);
        let (refunded, kept) = (RunStatus::Voided { refunded: true }, RunStatus::Voided { refunded: false });
        let unwritten = Some("the replay could not be written");
        for (end, status, note) in [
            (stopped, RunStatus::Provisional, Some("said")),
            (none, RunStatus::Aborted, Some("said")),
            (practice, RunStatus::Practice, Some("said")),
            (counted(Reason::Stopped, false, 0), RunStatus::Practice, Some("said")),
            (voided, refunded, Some("said")),
            (counted(Reason::Voided, false, 7), refunded, Some("said")),
            (lost(stopped), refunded, unwritten),
            (lost(none), refunded, unwritten),
            (lost(voided), refunded, Some("said")),
            (lost(practice), RunStatus::Practice, Some("said")),
            (broken(stopped, false), refunded, Some(why.as_str())),
            (broken(lost(practice), false), refunded, Some(why.as_str())),
            (broken(stopped, true), kept, None),
        ] {
            let decision = Decision::on(end, Some("said"));
            assert_eq!((decision.status, decision.refunds()), (status, status == refunded), "{end:?}");
            assert!(note.is_none_or(|note| decision.note.as_deref() == Some(note)), "{end:?}: {decision:?}");
        }
        assert_eq!(Decision::on(stopped, None).note, None);
        let note = Decision::on(none, None).note;
        assert_eq!(note.as_deref(), Some("it ended before its first tick"));
    }
}
