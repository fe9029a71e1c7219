//! The schedule: the time slots of teams.

use super::request::{AdminRequest, entry, no_verb};
use crate::http::extract::Path;
use crate::http::places;
use crate::http::state::AppState;
use crate::schedule::{changed, from_csv, moment, warnings};
use axum::Json;
use axum::extract::State;
use palmares_net::transport::problem::Problem;
use palmares_protocol::{Code, utc};
use palmares_store::{Slot, unix_ms};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// A change of the schedule. Times are texts with their offset from UTC, such as `2027-05-04T09:00:00+02:00`.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::http) struct ScheduleActionRequest {
    /// For `import`: a CSV file with the columns `team`, `begins_at` and `ends_at`. It replaces the schedule.
    #[serde(default)]
    csv: Option<String>,
    /// The team; `clear`, and `move` with `by_s`, concern all teams without it.
    #[serde(default)]
    team: Option<String>,
    /// For `move`: the begin of the slot that moves; needed if the team has several.
    #[serde(default)]
    from: Option<String>,
    /// For `add` and `move`: the begin.
    #[serde(default)]
    begins_at: Option<String>,
    /// For `add`, and for `move` if the length changes: the end.
    #[serde(default)]
    ends_at: Option<String>,
    /// For `move`: moves all slots that have not begun by this time, s.
    #[serde(default)]
    by_s: Option<i32>,
    /// The reason, for the audit.
    #[serde(default)]
    reason: Option<String>,
}

/// A time slot of a team.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Slot")]
struct SlotNow {
    team: String,
    /// Its begin, ms since 1970 UTC.
    begins_unix_ms: i64,
    /// Its end, ms since 1970 UTC.
    ends_unix_ms: i64,
    /// `later`, `now` or `over`.
    state: &'static str,
}

/// The schedule.
#[derive(Serialize, JsonSchema)]
pub(in crate::http) struct Schedule {
    /// All slots, by begin and team.
    slots: Vec<SlotNow>,
    /// Number of worlds that can be open at once.
    places: usize,
    /// Problems of the schedule, such as more teams at once than places.
    warnings: Vec<String>,
}

/// The schedule, with its problems.
pub(super) async fn show(State(app): State<AppState>) -> Result<Json<Schedule>, Problem> {
    let (slots, now) = (app.store.schedule().await?, unix_ms());
    let (rules, places) = (&app.competition.rules, places::all_worlds(&app).total);
    let teams = app.store.team_names().await?;
    let warnings = warnings(&slots, &teams, places, rules.session_s, rules.sessions_per_team, now);
    let slots = slots.into_iter().map(|slot| SlotNow {
        state: match () {
            () if slot.begins_unix_ms > now => "later",
            () if slot.ends_unix_ms > now => "now",
            () => "over",
        },
        team: slot.team,
        begins_unix_ms: slot.begins_unix_ms,
        ends_unix_ms: slot.ends_unix_ms,
    });
    Ok(Json(Schedule { slots: slots.collect(), places, warnings }))
}

fn bad(message: impl Into<String>) -> Problem {
    Problem::new(Code::BadRequest, message)
}

/// A change of the schedule, checked as far as it can be without the schedule.
enum Change {
    Import(Vec<Slot>),
    Add(Slot),
    /// Removes the slots of one team, or of all.
    Clear(Option<String>),
    Move {
        team: String,
        from: Option<i64>,
        begins: i64,
        ends: Option<i64>,
    },
    /// Moves the slots of one team or of all that have not begun.
    Shift {
        team: Option<String>,
        by_ms: i64,
    },
}

impl Change {
    fn read(verb: &str, request: &ScheduleActionRequest, known: &BTreeSet<String>) -> Result<Self, Problem> {
        let ScheduleActionRequest { csv, team, from, begins_at, ends_at, by_s, reason: _ } = request;
        let time = |name: &str, text: &Option<String>| {
            let time = text.as_deref().map(moment).transpose();
            time.map_err(|error| bad(format!("{name}: {error}")))
        };
        let (from, begins, ends) =
            (time("from", from)?, time("begins_at", begins_at)?, time("ends_at", ends_at)?);
        match (verb, csv, team.clone(), begins, ends, by_s) {
            ("import", Some(csv), None, None, None, None) => {
                let slots = from_csv(csv, known);
                Ok(Change::Import(slots.map_err(|(code, error)| Problem::new(code, error))?))
            }
            ("import", ..) => Err(bad("import needs `csv`, and no other field")),
            ("add", None, Some(team), Some(begins_unix_ms), Some(ends_unix_ms), None) => {
                Ok(Change::Add(Slot { begins_unix_ms, team, ends_unix_ms }))
            }
            ("add", ..) => Err(bad("add needs `team`, `begins_at` and `ends_at`, and no other field")),
            ("clear", None, team, None, None, None) => Ok(Change::Clear(team)),
            ("clear", ..) => Err(bad("clear takes `team`, and no other field")),
            ("move", None, team, None, None, Some(by_s)) => {
                Ok(Change::Shift { team, by_ms: 1000 * i64::from(*by_s) })
            }
            ("move", None, Some(team), Some(begins), ends, None) => {
                Ok(Change::Move { team, from, begins, ends })
            }
            ("move", ..) => Err(bad("move needs `team` and `begins_at`, or `by_s`")),
            _ => Err(no_verb(verb, "import, add, move, clear")),
        }
    }

    /// The teams that it names.
    fn teams(&self) -> BTreeSet<&str> {
        match self {
            Change::Import(slots) => slots.iter().map(|slot| slot.team.as_str()).collect(),
            Change::Add(slot) => [slot.team.as_str()].into(),
            Change::Move { team, .. } => [team.as_str()].into(),
            Change::Clear(team) | Change::Shift { team, .. } => team.iter().map(String::as_str).collect(),
        }
    }

    /// The new schedule.
    fn applied(self, mut slots: Vec<Slot>, now: i64) -> Result<Vec<Slot>, String> {
        match self {
            Change::Import(new) => slots = new,
            Change::Add(slot) => slots.push(slot),
            Change::Clear(None) => slots.clear(),
            Change::Clear(Some(team)) => {
                let before = slots.len();
                slots.retain(|slot| slot.team != team);
                if slots.len() == before {
                    return Err(format!("{team} has no slot"));
                }
            }
            Change::Move { team, from, begins, ends } => {
                let named = |slot: &&mut Slot| {
                    slot.team == team && from.is_none_or(|from| from == slot.begins_unix_ms)
                };
                let mut own: Vec<&mut Slot> = slots.iter_mut().filter(named).collect();
                let slot = match own.as_mut_slice() {
                    [] => return Err(format!("{team} has no such slot")),
                    [slot] => slot,
                    _ => return Err(format!("{team} has several slots; say with `from` which one moves")),
                };
                let length = slot.ends_unix_ms - slot.begins_unix_ms;
                (slot.begins_unix_ms, slot.ends_unix_ms) = (begins, ends.unwrap_or(begins + length));
            }
            Change::Shift { team, by_ms } => {
                for slot in &mut slots {
                    if slot.begins_unix_ms > now && team.as_ref().is_none_or(|team| *team == slot.team) {
                        slot.begins_unix_ms += by_ms;
                        slot.ends_unix_ms += by_ms;
                    }
                }
            }
        }
        if let Some(slot) = slots.iter().find(|slot| slot.ends_unix_ms <= slot.begins_unix_ms) {
            return Err(format!(
                "the slot of {} ends before it begins, {}",
                slot.team,
                utc(slot.begins_unix_ms)
            ));
        }
        changed(slots)
    }
}

/// `import`, `add`, `move`, `clear`.
pub(super) async fn act(
    State(app): State<AppState>,
    Path(verb): Path,
    request: AdminRequest<ScheduleActionRequest>,
) -> Result<Json<Schedule>, Problem> {
    if !app.competition.rules.official() {
        return Err(Problem::new(Code::WrongState, "this is a practice server: it has no schedule"));
    }
    let known = app.store.team_names().await?;
    let change = Change::read(&verb, &request.body, &known)?;
    let named = change.teams();
    let unknown: Vec<&str> = named.iter().copied().filter(|team| !known.contains(*team)).collect();
    if !unknown.is_empty() {
        let message = format!("no team {}; `team list` shows the teams", unknown.join(", "));
        return Err(Problem::new(Code::NotFound, message));
    }
    let one = match named.len() {
        1 => named.first().map(|team| (*team).to_owned()),
        _ => None,
    };
    let subject = one.unwrap_or_else(|| app.competition.rules.name.clone());
    let action = format!("schedule.{verb}");
    let entry = entry(&request.identity, &action, &subject, &request.body.reason);
    let now = unix_ms();
    let done = app.store.change_schedule(&entry, |slots| change.applied(slots, now).map_err(bad)).await?;
    done?;
    show(State(app)).await
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slot(team: &str, begins_unix_ms: i64, ends_unix_ms: i64) -> Slot {
        Slot { begins_unix_ms, team: team.into(), ends_unix_ms }
    }

    fn request(json: &str) -> ScheduleActionRequest {
        serde_json::from_str(json).expect("a request")
    }

    fn after(verb: &str, json: &str) -> Result<Vec<Slot>, String> {
        let change = Change::read(verb, &request(json), &BTreeSet::new());
        let change = change.map_err(|problem| problem.0.message)?;
        change
            .applied(vec![slot("a", 0, 10_000), slot("b", 20_000, 30_000), slot("b", 40_000, 50_000)], 5_000)
    }

    #[test]
    fn slots_are_added_moved_and_removed() {
        let a = || slot("a", 0, 10_000);
        let add = r#"{"team": "a", "begins_at": "1970-01-01T00:00:15Z", "ends_at": "1970-01-01T00:00:16Z"}"#;
        assert_eq!(after("add", add).map(|slots| slots.len()), Ok(4));
        assert_eq!(after("clear", "{}"), Ok(vec![]));
        assert_eq!(after("clear", r#"{"team": "b"}"#), Ok(vec![a()]));
        let by = after("move", r#"{"by_s": 60}"#);
        assert_eq!(by, Ok(vec![a(), slot("b", 80_000, 90_000), slot("b", 100_000, 110_000)]), "a has begun");
        let a_later = after("move", r#"{"team": "a", "begins_at": "1970-01-01T01:00+01:00"}"#);
        assert_eq!(a_later.map(|slots| slots[0].clone()), Ok(a()));
        let one = r#"{"team": "b", "from": "1970-01-01T00:00:40Z", "begins_at": "1970-01-01T00:01Z"}"#;
        assert_eq!(after("move", one).map(|slots| slots[2].clone()), Ok(slot("b", 60_000, 70_000)));
    }

    #[test]
    fn a_change_that_does_not_fit_is_refused_with_the_reason() {
        let early = r#"{"team": "a", "begins_at": "1970-01-01T00:00:09Z", "ends_at": "1970-01-01T00:01Z"}"#;
        let reversed = r#"{"team": "a", "begins_at": "1970-01-01T00:02Z", "ends_at": "1970-01-01T00:01Z"}"#;
        for (verb, json, part) in [
            ("add", early, "two slots of a overlap"),
            ("add", reversed, "ends before it begins"),
            ("add", r#"{"team": "a"}"#, "add needs"),
            ("add", r#"{"team": "a", "begins_at": "noon", "ends_at": "x"}"#, "begins_at: `noon`"),
            ("move", r#"{"team": "b", "begins_at": "1970-01-01T00:02Z"}"#, "several slots"),
            ("move", r#"{"team": "a"}"#, "move needs"),
            ("clear", r#"{"team": "c"}"#, "c has no slot"),
            ("import", r#"{"team": "c"}"#, "import needs"),
            ("import", r#"{"csv": "team"}"#, "no column `begins_at`"),
            ("shift", "{}", "no `shift`"),
        ] {
            let error = after(verb, json).expect_err(json);
            assert!(error.contains(part), "{verb} {json}: {error}");
        }
    }
}
