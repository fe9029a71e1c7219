//! Which watcher may watch which run: decided here only.

use palmares_tasks::Sensing;

/// A client of the watch socket.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Watcher {
    /// A client without a token.
    Anybody,
    /// A team.
    Team(String),
    /// A holder of a viewer's token.
    Spectator,
    /// An organizer.
    Organizer,
}

/// The properties of a run that decide who may watch it.
#[derive(Clone, Debug)]
pub(crate) struct RunAccess<'a> {
    /// Team that plays the run.
    pub(crate) team: &'a str,
    /// Whether it counts in a competition.
    pub(crate) official: bool,
    /// Observations of its controller: sensors only, or also the true state.
    pub(crate) sensing: Sensing,
}

impl Watcher {
    /// Practice is open to all. In a competition a team may watch only its own runs, since it will play the scenes of other
    /// teams later, and of its own only those with the true state, since watching shows more than sensors do.
    pub(crate) fn may_watch(&self, run: &RunAccess<'_>) -> bool {
        match self {
            Watcher::Organizer | Watcher::Spectator => true,
            Watcher::Anybody => !run.official,
            Watcher::Team(team) => !run.official || (team == run.team && run.sensing == Sensing::Truth),
        }
    }
}

impl Watcher {
    /// Whether the watcher may see a hand's full description. That of an uploaded hand is for its team and the organizers.
    pub(crate) fn may_know_hand(&self, team: &str, own_hand: bool) -> bool {
        match self {
            Watcher::Organizer => true,
            Watcher::Team(watcher) if watcher == team => true,
            _ => !own_hand,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn official_runs_are_hidden_from_other_teams_and_from_teams_on_sensors() {
        let own = Watcher::Team("own".into());
        let run = |official, team, sensing| RunAccess { team, official, sensing };
        for watcher in [own.clone(), Watcher::Anybody, Watcher::Spectator, Watcher::Organizer] {
            assert!(watcher.may_watch(&run(false, "other", Sensing::Sensors)), "{watcher:?}");
        }
        for watcher in [Watcher::Spectator, Watcher::Organizer] {
            assert!(watcher.may_watch(&run(true, "other", Sensing::Sensors)), "{watcher:?}");
        }
        assert!(!Watcher::Anybody.may_watch(&run(true, "own", Sensing::Truth)));
        assert!(own.may_watch(&run(true, "own", Sensing::Truth)));
        assert!(!own.may_watch(&run(true, "own", Sensing::Sensors)));
        assert!(!own.may_watch(&run(true, "other", Sensing::Truth)));
    }

    #[test]
    fn an_uploaded_hand_is_described_to_its_team_and_to_organizers() {
        let own = Watcher::Team("own".into());
        for watcher in [own.clone(), Watcher::Anybody, Watcher::Spectator, Watcher::Organizer] {
            assert!(watcher.may_know_hand("other", false));
            assert_eq!(watcher.may_know_hand("other", true), watcher == Watcher::Organizer, "{watcher:?}");
        }
        assert!(own.may_know_hand("own", true));
    }
}
