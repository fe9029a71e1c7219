//! Places for viewers. Clients without a token cannot take those of teams and screens, and organizers always get in.

use super::access::Watcher;
use palmares_net::transport::{Quota, Quotas};
use palmares_protocol::{Code, Refusal};

/// Places for viewers without a token.
const ANONYMOUS: usize = 256;
/// Places for teams.
const TEAMS: usize = 64;
/// Places for holders of viewers' tokens.
const SPECTATORS: usize = 64;

/// Kinds of viewers, each with places of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Kind {
    Anonymous,
    Team,
    Spectator,
    Organizer,
}

/// Counts the connected viewers.
#[derive(Debug, Default)]
pub(super) struct Places {
    by_kind: Quotas<Kind>,
    by_team: Quotas<String>,
}

/// A place, taken until it is dropped.
#[derive(Debug)]
pub(super) struct Place {
    _of_kind: Quota<Kind>,
    _of_team: Option<Quota<String>>,
}

impl Places {
    /// Takes a place; a team has at most `per_team`.
    ///
    /// # Errors
    /// The places of this kind of viewer are taken.
    pub(super) fn take(&self, watcher: &Watcher, per_team: usize) -> Result<Place, Refusal> {
        let full = |message: &str| Refusal::new(Code::Capacity, message).retry_after(5.0);
        let (kind, max, message) = match watcher {
            Watcher::Anybody => {
                (Kind::Anonymous, ANONYMOUS, "all places for viewers without a token are taken")
            }
            Watcher::Team(_) => (Kind::Team, TEAMS, "all places for teams are taken"),
            Watcher::Spectator => {
                (Kind::Spectator, SPECTATORS, "all places for viewers with a token are taken")
            }
            Watcher::Organizer => (Kind::Organizer, usize::MAX, ""),
        };
        let mut of_team = match watcher {
            Watcher::Team(team) => Some(self.by_team.of(team.clone())),
            _ => None,
        };
        if of_team.as_mut().is_some_and(|quota| !quota.grow(1, per_team)) {
            return Err(full("all places of this team are taken"));
        }
        let mut of_kind = self.by_kind.of(kind);
        if !of_kind.grow(1, max) {
            return Err(full(message));
        }
        Ok(Place { _of_kind: of_kind, _of_team: of_team })
    }

    /// Number of connected viewers.
    pub(super) fn taken(&self) -> usize {
        self.by_kind.total()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_of_viewer_has_places_of_its_own_and_organizers_always_get_in() {
        let places = Places::default();
        let team = |k: usize| Watcher::Team(format!("team {}", k / 4));
        let mut held = Vec::new();
        for k in 0..ANONYMOUS {
            held.push(places.take(&Watcher::Anybody, 4).unwrap_or_else(|why| panic!("{k}: {why:?}")));
        }
        let refused = places.take(&Watcher::Anybody, 4).expect_err("full");
        assert!(refused.code == Code::Capacity && refused.retry_after_s.is_some(), "{refused:?}");
        for k in 0..TEAMS {
            held.push(places.take(&team(k), 4).expect("a place"));
            held.push(places.take(&Watcher::Spectator, 4).expect("a place"));
        }
        assert!(places.take(&Watcher::Spectator, 4).is_err() && places.take(&team(9999), 4).is_err());
        for _ in 0..1000 {
            held.push(places.take(&Watcher::Organizer, 4).expect("always"));
        }
        assert_eq!(places.taken(), held.len());
        held.clear();
        assert_eq!(places.taken(), 0);
        let of_one: Vec<_> = (0..4).map(|_| places.take(&team(0), 4)).collect();
        assert!(of_one.iter().all(Result::is_ok) && places.take(&team(0), 4).is_err());
        assert!(places.take(&team(5), 4).is_ok());
    }
}
