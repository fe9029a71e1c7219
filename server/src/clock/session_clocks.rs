//! The clocks of all open sessions, for spectators and organizers. Each session writes its own, without waiting for a reader.

use super::session_clock::SessionClock;
use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Clocks by session id, as they were when something last happened; they run on by themselves.
#[derive(Debug, Default)]
pub(crate) struct SessionClocks(Mutex<HashMap<String, SessionClock>>);

impl SessionClocks {
    fn lock(&self) -> MutexGuard<'_, HashMap<String, SessionClock>> {
        // Nothing panics while it holds the lock; if something did, the map would still be whole.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Shows a session's clock.
    pub(crate) fn show(&self, session_id: &str, clock: &SessionClock) {
        let mut clocks = self.lock();
        match clocks.get_mut(session_id) {
            Some(shown) => shown.clone_from(clock),
            None => drop(clocks.insert(session_id.to_owned(), clock.clone())),
        }
    }

    /// The clock of an open session.
    pub(crate) fn get(&self, session_id: &str) -> Option<SessionClock> {
        self.lock().get(session_id).cloned()
    }

    /// The session has ended.
    pub(crate) fn remove(&self, session_id: &str) {
        self.lock().remove(session_id);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_is_shown_from_the_first_time_until_its_session_ends() {
        let clocks = SessionClocks::default();
        assert!(clocks.get("ses").is_none());
        clocks.show("ses", &SessionClock::new(Some(9.0)));
        clocks.show("ses", &SessionClock::new(Some(8.0)));
        assert_eq!(clocks.get("ses").and_then(|clock| clock.limit_s()), Some(8.0));
        clocks.remove("ses");
        assert!(clocks.get("ses").is_none());
    }
}
