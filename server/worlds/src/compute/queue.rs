//! The queue of sessions that were refused a world and wait for one.
//!
//! Official sessions come before practice, each in the order of their first request. A session that does not ask again in time leaves
//! the queue. Times are those of a [clock](super::pausable_clock) that stands while the competition is paused: nobody can ask then.

use super::open_worlds::{OpenWorlds, WorldRequest};
use palmares_protocol::Mode;
use std::time::Duration;

/// A refused session that does not ask again within this time wants no world any more.
pub const WAIT: Duration = Duration::from_secs(10);

/// A session that waits.
#[derive(Debug)]
struct Waiting {
    session_id: String,
    mode: Mode,
    official: bool,
    /// When it leaves the queue unless it asks again, ms.
    until: u64,
}

/// The sessions that wait, in the order of their first request.
#[derive(Debug, Default)]
pub(super) struct Queue(Vec<Waiting>);

impl Queue {
    /// Removes the sessions that have not asked again in time.
    pub(super) fn expire(&mut self, now: u64) {
        self.0.retain(|waiting| waiting.until > now);
    }

    /// The sessions that wait, in the order of their first request.
    pub(super) fn sessions(&self, now: u64) -> impl Iterator<Item = &str> {
        self.0.iter().filter(move |waiting| waiting.until > now).map(|waiting| waiting.session_id.as_str())
    }

    /// Number of sessions that get a world before the one that asks. Their worlds are added to those that are open.
    pub(super) fn ahead_of(&self, request: WorldRequest<'_>, open: &mut OpenWorlds) -> usize {
        let place = self.0.iter().position(|waiting| waiting.session_id == request.session_id);
        let mut ahead = 0;
        for (k, other) in self.0.iter().enumerate() {
            let earlier = place.is_none_or(|place| k < place);
            let before = if other.official == request.official { earlier } else { other.official };
            if before && Some(k) != place {
                ahead += 1;
                open.add(other.mode, other.official);
            }
        }
        ahead
    }

    /// A session was refused: it gets a place, or keeps its own.
    pub(super) fn enter(&mut self, request: WorldRequest<'_>, now: u64) {
        let WorldRequest { session_id, mode, official } = request;
        let until = now + WAIT.as_millis() as u64;
        match self.0.iter_mut().find(|waiting| waiting.session_id == session_id) {
            Some(waiting) => waiting.until = until,
            None => self.0.push(Waiting { session_id: session_id.to_owned(), mode, official, until }),
        }
    }

    /// A session has a world: it waits no more.
    pub(super) fn leave(&mut self, session_id: &str) {
        self.0.retain(|waiting| waiting.session_id != session_id);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(session_id: &str, official: bool) -> WorldRequest<'_> {
        WorldRequest { session_id, mode: Mode::Lockstep, official }
    }

    #[test]
    fn a_session_keeps_its_place_as_long_as_it_asks_again_in_time() {
        let (mut queue, wait) = (Queue::default(), WAIT.as_millis() as u64);
        for (name, at) in [("a", 0), ("b", 1), ("a", wait - 1)] {
            queue.expire(at);
            queue.enter(request(name, true), at);
        }
        assert_eq!(queue.sessions(wait).collect::<Vec<_>>(), ["a", "b"]);
        assert_eq!(queue.sessions(wait + 1).collect::<Vec<_>>(), ["a"]);
        queue.leave("a");
        assert_eq!(queue.sessions(0).collect::<Vec<_>>(), ["b"]);
    }

    #[test]
    fn the_worlds_of_those_ahead_count_as_open() {
        let mut queue = Queue::default();
        for (name, official) in [("p", false), ("a", true), ("b", true)] {
            queue.enter(request(name, official), 0);
        }
        for (name, official, ahead) in [("p", false, 2), ("a", true, 0), ("b", true, 1), ("c", true, 2)] {
            let mut open = OpenWorlds::default();
            assert_eq!(queue.ahead_of(request(name, official), &mut open), ahead, "{name}");
            assert_eq!((open.lockstep, open.official), (ahead, ahead), "{name}");
        }
    }
}
