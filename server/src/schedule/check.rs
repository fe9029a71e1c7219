//! Compares a schedule with the teams, the length of sessions and the places: what an organizer should look at.

use palmares_protocol::utc;
use palmares_store::Slot;
use std::collections::{BTreeMap, BTreeSet};

/// Most names in a warning.
const NAMED: usize = 10;

/// A stretch of time in which more teams play than there are places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Crowd {
    from: i64,
    to: i64,
    /// Largest number of slots at once.
    teams: usize,
}

/// The largest number of slots at once, and the stretches with more than `places` of them.
fn crowds(slots: &[Slot], places: usize) -> (usize, Vec<Crowd>) {
    let mut changes = BTreeMap::<i64, isize>::new();
    for slot in slots {
        *changes.entry(slot.begins_unix_ms).or_default() += 1;
        *changes.entry(slot.ends_unix_ms).or_default() -= 1;
    }
    let (mut now, mut most, mut found) = (0, 0, Vec::<Crowd>::new());
    let mut crowd: Option<Crowd> = None;
    for (at, change) in changes {
        now += change;
        // Every slot ends after it begins.
        let teams = usize::try_from(now).unwrap_or_default();
        most = most.max(teams);
        if teams > places {
            let open = crowd.get_or_insert(Crowd { from: at, to: at, teams });
            open.teams = open.teams.max(teams);
        } else if let Some(over) = crowd.take() {
            found.push(Crowd { to: at, ..over });
        }
    }
    (most, found)
}

/// What an organizer should look at in a schedule, given the competition's teams, places, and the rules of sessions.
pub(crate) fn warnings(
    slots: &[Slot],
    teams: &BTreeSet<String>,
    places: usize,
    session_s: Option<f64>,
    sessions_per_team: u32,
    now: i64,
) -> Vec<String> {
    if slots.is_empty() {
        return vec![];
    }
    let mut warnings = Vec::new();
    let (most, crowds) = crowds(slots, places);
    if let Some(first) = crowds.first() {
        let more = match crowds.len() {
            1 => String::new(),
            number => format!(", and {} more times", number - 1),
        };
        warnings.push(format!(
            "up to {most} teams play at once, and there are {places} places: {} teams from {} to {}{more}; teams without a \
             place wait in the queue, where their clocks stop",
            first.teams,
            utc(first.from),
            utc(first.to)
        ));
    }
    let mut of_team = BTreeMap::<&str, u32>::new();
    for slot in slots {
        *of_team.entry(&slot.team).or_default() += 1;
    }
    let list = |text: &str, names: Vec<&str>| {
        let others = names.len().saturating_sub(NAMED);
        let more = if others > 0 { format!(", and {others} more") } else { String::new() };
        let first = names.iter().take(NAMED).copied().collect::<Vec<_>>().join(", ");
        (!names.is_empty()).then(|| format!("{text}: {first}{more}"))
    };
    let without = teams.iter().map(String::as_str).filter(|team| !of_team.contains_key(team)).collect();
    warnings.extend(list("teams without a slot cannot play", without));
    let many = of_team.iter().filter(|(_, slots)| **slots > sessions_per_team).map(|(team, _)| *team);
    warnings.extend(list(
        &format!("teams with more slots than their {sessions_per_team} session(s)"),
        many.collect(),
    ));
    if let Some(session_s) = session_s {
        let short = |slot: &&Slot| ((slot.ends_unix_ms - slot.begins_unix_ms) as f64) < session_s * 1000.0;
        let short = slots.iter().filter(short).map(|slot| slot.team.as_str()).collect::<BTreeSet<_>>();
        warnings.extend(list(
            &format!("slots shorter than a session of {session_s} s end it early"),
            short.into_iter().collect(),
        ));
    }
    let past = slots.iter().filter(|slot| slot.ends_unix_ms <= now).count();
    if past == slots.len() {
        warnings.push("all slots are over: no session can begin".to_owned());
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slot(team: &str, begins_s: i64, ends_s: i64) -> Slot {
        Slot { begins_unix_ms: begins_s * 1000, team: team.into(), ends_unix_ms: ends_s * 1000 }
    }

    fn warned(slots: &[Slot], places: usize) -> String {
        let teams = ["a", "b", "c"].map(str::to_owned).into();
        warnings(slots, &teams, places, Some(10.0), 1, 0).join("\n")
    }

    #[test]
    fn more_teams_at_once_than_places_are_named_with_their_times() {
        let slots = [slot("a", 0, 10), slot("b", 5, 15), slot("c", 5, 20)];
        assert_eq!(crowds(&slots, 2), (3, vec![Crowd { from: 5000, to: 10_000, teams: 3 }]));
        assert_eq!(
            crowds(&slots, 1),
            (3, vec![Crowd { from: 5000, to: 15_000, teams: 3 }]),
            "one stretch with its largest number"
        );
        // A slot that begins as another ends is not at once with it.
        assert_eq!(crowds(&[slot("a", 0, 10), slot("b", 10, 20)], 1), (1, vec![]));
        let text = warned(&slots, 2);
        assert!(text.contains("up to 3 teams play at once, and there are 2 places"), "{text}");
        assert_eq!(warned(&slots, 3), "");
    }

    #[test]
    fn teams_without_a_slot_with_too_many_and_short_slots_are_named() {
        let text = warned(&[slot("a", 0, 10), slot("a", 20, 30), slot("b", 0, 5)], 9);
        for part in
            ["without a slot cannot play: c", "more slots than their 1 session(s): a", "10 s end it early: b"]
        {
            assert!(text.contains(part), "{part}: {text}");
        }
        let over = warnings(&[slot("a", 0, 10)], &BTreeSet::new(), 1, None, 1, 10_000);
        assert_eq!(over, ["all slots are over: no session can begin"]);
    }
}
