//! Worlds that are open or wanted, as counts.

use palmares_protocol::Mode;

/// Number of open worlds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OpenWorlds {
    /// Realtime worlds.
    pub realtime: usize,
    /// Lockstep worlds that are not idle.
    pub lockstep: usize,
    /// Those of official sessions, of both kinds.
    pub official: usize,
    /// Idle worlds.
    pub idle: usize,
}

impl OpenWorlds {
    /// All worlds that are not idle.
    pub fn all(self) -> usize {
        self.realtime + self.lockstep
    }

    /// All worlds.
    pub fn with_idle(self) -> usize {
        self.all() + self.idle
    }

    /// Adds a world that is not idle.
    pub(super) fn add(&mut self, mode: Mode, official: bool) {
        match mode {
            Mode::Realtime => self.realtime += 1,
            Mode::Lockstep => self.lockstep += 1,
        }
        self.official += usize::from(official);
    }
}

/// A request for a world.
#[derive(Clone, Copy, Debug)]
pub struct WorldRequest<'a> {
    /// The session.
    pub session_id: &'a str,
    /// The pacing of the world.
    pub mode: Mode,
    /// Whether the session is official.
    pub official: bool,
}
