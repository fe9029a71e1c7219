//! Who may watch what: the one place where it is decided.

use palmares_tasks::Sensing;

/// Who wants to watch.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Watcher {
    /// Somebody without a token.
    Anybody,
    /// A team.
    Team(String),
    /// Somebody to whom the organizers have given a token for watching.
    Spectator,
    /// An organizer.
    Organizer,
}

/// What decides whether a run may be watched.
#[derive(Clone, Debug)]
pub(crate) struct Watched<'a> {
    /// Whose run it is.
    pub(crate) team: &'a str,
    /// Whether it counts in a competition.
    pub(crate) official: bool,
    /// How much its controller may see.
    pub(crate) sensing: Sensing,
}

impl Watcher {
    /// Practice is open to all. In a competition a team sees its own runs only, since the others' scenes are still to
    /// come for it, and of those not the ones played on sensors, since watching shows what sensors do not.
    pub(crate) fn may_watch(&self, run: &Watched<'_>) -> bool {
        match self {
            Watcher::Organizer | Watcher::Spectator => true,
            Watcher::Anybody => !run.official,
            Watcher::Team(team) => !run.official || (team == run.team && run.sensing == Sensing::Truth),
        }
    }
}

impl Watcher {
    /// What is told of a hand in full: one that a team sent in is for that team and the organizers.
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
    fn official_runs_are_hidden_from_other_teams_and_from_controllers_on_sensors() {
        let own = Watcher::Team("own".into());
        let run = |official, team, sensing| Watched { team, official, sensing };
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
    fn a_hand_that_a_team_sent_in_is_told_to_that_team_and_to_organizers() {
        let own = Watcher::Team("own".into());
        for watcher in [own.clone(), Watcher::Anybody, Watcher::Spectator, Watcher::Organizer] {
            assert!(watcher.may_know_hand("other", false));
            assert_eq!(watcher.may_know_hand("other", true), watcher == Watcher::Organizer, "{watcher:?}");
        }
        assert!(own.may_know_hand("own", true));
    }
}
