//! The clocks of all open sessions, for spectators and organizers. Each session writes its own, without waiting for a reader.

use super::session_clock::{ClockState, SessionClock};
use parking_lot::Mutex;
use std::collections::HashMap;
use std::time::Duration;

/// The clock from which a later process continues.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Saving {
    /// None, or the session saves it itself.
    Own,
    /// The clock as it is.
    Present,
    /// The clock before the open run.
    BeforeRun(ClockState),
}

#[derive(Debug)]
struct Shown {
    /// The epoch of the session's owner.
    epoch: i64,
    clock: SessionClock,
    saving: Saving,
    /// As saved last by [`SessionClocks::unsaved`].
    saved: Option<(ClockState, bool)>,
}

/// A clock to be saved.
#[derive(Clone, Debug, PartialEq)]
pub struct Unsaved {
    pub session_id: String,
    pub epoch: i64,
    pub state: ClockState,
    /// Whether a run is open.
    pub in_run: bool,
    /// The clock within the open run, if another host can continue the run.
    pub present: Option<ClockState>,
}

/// Clocks by session id, as they were when something last happened; they run on by themselves.
#[derive(Debug, Default)]
pub struct SessionClocks(Mutex<HashMap<String, Shown>>);

impl SessionClocks {
    /// Shows a session's clock.
    pub fn show(&self, session_id: &str, epoch: i64, clock: &SessionClock, saving: Saving) {
        let mut clocks = self.0.lock();
        match clocks.get_mut(session_id) {
            // Of an owner that does not know yet that it is none.
            Some(shown) if shown.epoch > epoch => {}
            Some(shown) if shown.epoch == epoch => {
                shown.clock.clone_from(clock);
                shown.saving = saving;
            }
            _ => {
                let shown = Shown { epoch, clock: clock.clone(), saving, saved: None };
                clocks.insert(session_id.to_owned(), shown);
            }
        }
    }

    /// The clock of an open session.
    pub fn get(&self, session_id: &str) -> Option<SessionClock> {
        self.0.lock().get(session_id).map(|shown| shown.clock.clone())
    }

    /// The clocks that have changed since they were saved last; with `within_runs` also those within an open run.
    pub fn unsaved(&self, now: Duration, within_runs: bool) -> Vec<Unsaved> {
        let mut unsaved: Vec<Unsaved> = Vec::new();
        for (session_id, shown) in &*self.0.lock() {
            let (state, in_run) = match shown.saving {
                Saving::Own => continue,
                Saving::Present => (shown.clock.state(now), false),
                Saving::BeforeRun(state) => (state, true),
            };
            let present = (within_runs && in_run).then(|| shown.clock.state(now));
            if present.is_some() || shown.saved != Some((state, in_run)) {
                let (session_id, epoch) = (session_id.clone(), shown.epoch);
                unsaved.push(Unsaved { session_id, epoch, state, in_run, present });
            }
        }
        // Two servers that lock rows in the same order do not wait for each other in a circle.
        unsaved.sort_by(|a, b| a.session_id.cmp(&b.session_id));
        unsaved
    }

    /// These clocks are saved.
    pub fn saved(&self, clocks: &[Unsaved]) {
        let mut shown = self.0.lock();
        for Unsaved { session_id, state, in_run, .. } in clocks {
            if let Some(shown) = shown.get_mut(session_id) {
                shown.saved = Some((*state, *in_run));
            }
        }
    }

    /// The session has ended, or has another owner.
    pub fn remove(&self, session_id: &str, epoch: i64) {
        let mut clocks = self.0.lock();
        if clocks.get(session_id).is_some_and(|shown| shown.epoch == epoch) {
            clocks.remove(session_id);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_is_shown_from_the_first_time_until_its_session_ends() {
        let clocks = SessionClocks::default();
        assert!(clocks.get("ses").is_none());
        clocks.show("ses", 1, &SessionClock::new(Some(9.0)), Saving::Own);
        clocks.show("ses", 1, &SessionClock::new(Some(8.0)), Saving::Own);
        assert_eq!(clocks.get("ses").and_then(|clock| clock.limit_s()), Some(8.0));
        // Taken again, while the lost one still shows its clock.
        clocks.show("ses", 3, &SessionClock::new(Some(7.0)), Saving::Own);
        clocks.show("ses", 1, &SessionClock::new(Some(8.0)), Saving::Own);
        clocks.remove("ses", 1);
        assert_eq!(clocks.get("ses").and_then(|clock| clock.limit_s()), Some(7.0));
        clocks.remove("ses", 3);
        assert!(clocks.get("ses").is_none());
    }

    #[test]
    fn a_clock_is_saved_when_it_has_changed() {
        let clocks = SessionClocks::default();
        let at = Duration::from_secs;
        let mut clock = SessionClock::new(Some(99.0));
        clock.start(at(0));
        let before = clock.state(at(1));
        let states = |now: u64| {
            let unsaved = clocks.unsaved(at(now), false);
            clocks.saved(&unsaved);
            unsaved.into_iter().map(|clock| (clock.state, clock.in_run)).collect::<Vec<_>>()
        };
        clocks.show("ses", 1, &clock, Saving::Own);
        assert_eq!(states(2), []);
        clocks.show("ses", 1, &clock, Saving::Present);
        // It runs on while nothing happens.
        assert_eq!(states(3), [(clock.state(at(3)), false)]);
        assert_eq!(states(4), [(clock.state(at(4)), false)]);
        clocks.show("ses", 1, &clock, Saving::BeforeRun(before));
        assert_eq!(states(5), [(before, true)]);
        assert_eq!(states(6), [], "the clock before the run is the same");
        clock.pause(at(7));
        clocks.show("ses", 1, &clock, Saving::Present);
        assert_eq!(states(8).len(), 1);
        assert_eq!(states(9), [], "a clock that is stopped is saved once");
    }
}
