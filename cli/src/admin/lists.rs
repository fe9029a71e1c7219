//! The server's lists as tables for people: the important columns, times in UTC.

use palmares_hand_tools::table::aligned;
use palmares_protocol::utc;
use serde_json::Value;

/// A column: its heading, whether it is a number, and its cell in a row.
type Column = (&'static str, bool, fn(&Value) -> String);

/// A list that is printed as a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum List {
    Teams,
    Tokens,
    Sessions,
    Runs,
    Similar,
    Hands,
    Audit,
}

impl List {
    fn columns(self) -> Vec<Column> {
        match self {
            List::Teams => vec![
                ("team", false, |row| text(&row["team"])),
                ("live tokens", true, |row| text(&row["live_tokens"])),
                ("sessions", true, |row| text(&row["sessions"])),
                ("added (UTC)", false, |row| time(&row["created_unix_ms"])),
            ],
            List::Tokens => vec![
                ("token", false, |row| text(&row["token_id"])),
                ("role", false, |row| text(&row["role"])),
                ("team", false, |row| text(&row["team"])),
                ("label", false, |row| text(&row["label"])),
                ("made (UTC)", false, |row| time(&row["created_unix_ms"])),
                ("revoked (UTC)", false, |row| time(&row["revoked_unix_ms"])),
            ],
            List::Sessions => vec![
                ("session", false, |row| text(&row["session_id"])),
                ("team", false, |row| text(&row["team"])),
                ("state", false, state),
                ("left", true, |row| row["left_s"].as_f64().map_or("no limit".into(), minutes)),
                ("left, s", true, |row| seconds(&row["left_s"])),
                ("wall, s", true, |row| seconds(&row["clock_wall_s"])),
                ("simulated, s", true, |row| seconds(&row["clock_simulated_s"])),
                ("given back, s", true, |row| seconds(&row["refunded_s"])),
                ("pauses", true, |row| text(&row["pauses"])),
                ("runs", true, |row| text(&row["runs"])),
                ("began (UTC)", false, |row| time(&row["created_unix_ms"])),
                ("ended (UTC)", false, |row| time(&row["ended_unix_ms"])),
            ],
            List::Runs => vec![
                ("run", false, |row| text(&row["run_id"])),
                ("team", false, |row| text(&row["team"])),
                ("task", false, |row| text(&row["task"])),
                ("k", true, |row| text(&row["k"])),
                ("status", false, |row| text(&row["status"])),
                ("verification", false, verification),
                ("score", true, |row| text(&row["score"])),
                ("hand", false, |row| text(&row["hand"])),
                ("mode", false, |row| text(&row["mode"])),
                ("sensing", false, |row| text(&row["sensing"])),
                ("simulated, s", true, |row| seconds(&row["sim_time_s"])),
                ("began (UTC)", false, |row| time(&row["started_unix_ms"])),
                ("ended (UTC)", false, |row| time(&row["ended_unix_ms"])),
                ("similar to", false, similar),
                ("note", false, note),
            ],
            List::Similar => vec![
                ("alike, %", true, |row| percent(&row["share"])),
                ("distance, mm", true, |row| length(&row["distance_mm"])),
                ("offset, mm", true, |row| length(&row["offset_mm"])),
                ("later, s", true, |row| seconds(&row["shift_s"])),
                ("task", false, |row| text(&row["task"])),
                ("k", true, |row| text(&row["k"])),
                ("first", false, |row| text(&row["runs"][0]["team"])),
                ("run", false, |row| text(&row["runs"][0]["run_id"])),
                ("score", true, |row| text(&row["runs"][0]["score"])),
                ("then", false, |row| text(&row["runs"][1]["team"])),
                ("run", false, |row| text(&row["runs"][1]["run_id"])),
                ("score", true, |row| text(&row["runs"][1]["score"])),
                ("status", false, |row| text(&row["runs"][1]["status"])),
                ("began (UTC)", false, |row| time(&row["runs"][1]["started_unix_ms"])),
            ],
            List::Hands => vec![
                ("hand", false, |row| text(&row["hand_id"])),
                ("team", false, |row| text(&row["team"])),
                ("name", false, |row| text(&row["name"])),
                ("status", false, |row| text(&row["status"])),
                ("kB", true, |row| text(&(row["bytes"].as_u64().unwrap_or_default().div_ceil(1000)).into())),
                ("warnings", true, |row| text(&row["warnings"].as_array().map_or(0, Vec::len).into())),
                ("uploaded (UTC)", false, |row| time(&row["created_unix_ms"])),
                ("decided (UTC)", false, |row| time(&row["decided_unix_ms"])),
                ("note", false, |row| text(&row["note"])),
            ],
            List::Audit => vec![
                ("no.", true, |row| text(&row["seq"])),
                ("time (UTC)", false, |row| time(&row["unix_ms"])),
                ("token", false, |row| text(&row["actor"])),
                ("label", false, |row| text(&row["label"])),
                ("did", false, |row| text(&row["action"])),
                ("to", false, |row| text(&row["subject"])),
                ("seconds", true, |row| text(&row["seconds"])),
                ("because", false, |row| text(&row["reason"])),
            ],
        }
    }

    /// The list of a response as a table.
    pub(crate) fn table(self, answer: &Value) -> String {
        let name = match self {
            List::Teams => "teams",
            List::Tokens => "tokens",
            List::Sessions => "sessions",
            List::Runs => "runs",
            List::Similar => "pairs",
            List::Hands => "hands",
            List::Audit => "records",
        };
        let rows = answer[name].as_array().map_or(&[][..], Vec::as_slice);
        if rows.is_empty() {
            return format!("no {name}\n");
        }
        let more = if answer["more"] == true { "there are more: raise --limit\n" } else { "" };
        let columns = self.columns();
        let mut cells = vec![columns.iter().map(|(heading, ..)| (*heading).to_owned()).collect::<Vec<_>>()];
        cells.extend(rows.iter().map(|row| columns.iter().map(|(.., cell)| cell(row)).collect()));
        aligned(&cells, |k| columns[k].1) + more
    }
}

fn text(value: &Value) -> String {
    match value {
        Value::Null => "-".to_owned(),
        Value::String(text) if text.is_empty() => "-".to_owned(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

fn time(value: &Value) -> String {
    value.as_i64().map_or("-".to_owned(), utc)
}

fn seconds(value: &Value) -> String {
    value.as_f64().map_or("-".to_owned(), |s| format!("{s:.1}"))
}

/// Minutes and whole seconds, rounded down.
fn minutes(seconds: f64) -> String {
    let seconds = seconds.max(0.0) as u64;
    format!("{}:{:02}", seconds / 60, seconds % 60)
}

/// A part in percent, rounded down.
fn percent(part: &Value) -> String {
    part.as_f64().map_or("-".to_owned(), |part| format!("{:.0}", (100.0 * part).floor()))
}

fn length(mm: &Value) -> String {
    mm.as_f64().map_or("-".to_owned(), |mm| format!("{mm:.1}"))
}

/// The greatest likeness to another team's run.
fn similar(row: &Value) -> String {
    match row["similar"].as_array().map_or(&[][..], Vec::as_slice) {
        [] => "-".to_owned(),
        [longest, others @ ..] => {
            let more = if others.is_empty() { String::new() } else { format!(", {} more", others.len()) };
            format!(
                "{} of {}: {} %{more}",
                text(&longest["run_id"]),
                text(&longest["team"]),
                percent(&longest["share"])
            )
        }
    }
}

/// Whether a run waits for its verification, and why it still does.
fn verification(row: &Value) -> String {
    let tries =
        || if row["verify_tries"] == 1 { "1 try".into() } else { format!("{} tries", row["verify_tries"]) };
    let mut state = match (row["verify_state"].as_str(), &row["verify_host"]) {
        (None, _) => return "-".to_owned(),
        (Some("stuck"), _) => format!("stuck after {}", tries()),
        (Some(_), Value::String(host)) => format!("by {host}"),
        (Some(_), _) if row["verify_problem"].is_string() && row["verify_tries"].is_u64() => {
            format!("waits after {}", tries())
        }
        _ => "waits".to_owned(),
    };
    if let Some(problem) = row["verify_problem"].as_str() {
        state += &format!(": {problem}");
    }
    state
}

/// The reason why a run ended, and what people and the verification noted.
fn note(row: &Value) -> String {
    let rejected = row["status"] == "rejected";
    let notes = [&row["reason"], &row["note"], if rejected { &row["verify_note"] } else { &Value::Null }];
    let notes: Vec<String> = notes.into_iter().filter(|note| !note.is_null()).map(text).collect();
    if notes.is_empty() { "-".to_owned() } else { notes.join("; ") }
}

fn state(row: &Value) -> String {
    match row["paused_unix_ms"].as_i64() {
        Some(since) if row["status"] == "open" => format!("paused since {}", utc(since)),
        None if row["place_in_queue"].is_u64() => format!("no. {} in the queue", row["place_in_queue"]),
        _ => text(&row["status"]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_session_has_its_time_left_and_its_teams_name_escaped() {
        let row = json!({"session_id": "ses_1", "team": "cr\u{202e}abs 蟹", "status": "open", "left_s": 1798.4,
            "clock_wall_s": 1.6, "clock_simulated_s": 0.5, "refunded_s": 0.0, "pauses": 1, "runs": 2,
            "paused_unix_ms": 1_795_238_560_323_i64, "created_unix_ms": 1_795_238_500_000_i64,
            "ended_unix_ms": null});
        let table = List::Sessions.table(&json!({"sessions": [row]}));
        let lines: Vec<&str> = table.lines().collect();
        assert_eq!(lines.len(), 2);
        for part in ["cr\\u{202E}abs 蟹", "paused since 2026-11-21T05:22:40Z", " 29:58 ", " 1798.4 ", " 1.6 "]
        {
            assert!(lines[1].contains(part), "{part}: {table}");
        }
        assert!(lines[1].ends_with(" -"), "{table}");
        assert_eq!(List::Teams.table(&json!({"teams": []})), "no teams\n");
    }

    #[test]
    fn a_table_says_that_there_is_more() {
        let run = json!({"run_id": "run_1", "team": "crabs", "status": "verified", "score": 4.5,
            "started_unix_ms": 1_795_238_500_000_i64});
        let pair = json!({"share": 0.999, "distance_mm": 0.44, "offset_mm": 2.06, "shift_s": -0.5,
            "task": "balls", "k": 3, "runs": [run, run]});
        let table = |more: bool| List::Similar.table(&json!({"pairs": [pair], "more": more}));
        assert!(
            table(false).lines().nth(1).is_some_and(|line| line
                .split_whitespace()
                .take(5)
                .eq(["99", "0.4", "2.1", "-0.5", "balls"]))
        );
        assert_eq!((table(false).lines().count(), table(true).lines().count()), (2, 3), "{}", table(true));
    }

    #[test]
    fn a_run_says_why_it_is_not_verified() {
        for (row, state) in [
            (json!({}), "-"),
            (json!({"verify_state": "waiting", "verify_tries": 0}), "waits"),
            (json!({"verify_state": "waiting", "verify_tries": 1, "verify_host": "h2"}), "by h2"),
            (
                json!({"verify_state": "waiting", "verify_tries": 1, "verify_problem": "missing_file: gone"}),
                "waits after 1 try: missing_file: gone",
            ),
            (
                json!({"verify_state": "stuck", "verify_tries": 5, "verify_problem": "missing_file: gone"}),
                "stuck after 5 tries: missing_file: gone",
            ),
        ] {
            assert_eq!(verification(&row), state);
        }
    }

    #[test]
    fn time_left_is_rounded_down() {
        assert_eq!(
            [1800.0, 1799.99, 61.0, 59.9, 0.4, 0.0].map(minutes),
            ["30:00", "29:59", "1:01", "0:59", "0:00", "0:00"]
        );
    }
}
