//! Tables as CSV (RFC 4180), from the JSON of the other format.
//!
//! All columns are always present, in an order for people. Every time in ms since 1970 (`…_unix_ms`) is repeated in ISO 8601
//! (`…_utc`).

use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use csv::{Terminator, WriterBuilder};
use palmares_protocol::utc;
use palmares_store::LeaderboardRow;
use serde_json::{Map, Value, json};

/// Columns of the sessions.
pub(super) const SESSIONS: [&str; 19] = [
    "session_id",
    "team",
    "mode",
    "status",
    "created_utc",
    "ended_utc",
    "limit_s",
    "elapsed_s",
    "left_s",
    "clock_wall_s",
    "clock_simulated_s",
    "refunded_s",
    "pauses",
    "paused_utc",
    "runs",
    "client_version",
    "created_unix_ms",
    "ended_unix_ms",
    "paused_unix_ms",
];

/// Columns of the runs.
pub(super) const RUNS: [&str; 31] = [
    "run_id",
    "team",
    "task",
    "k",
    "hand",
    "mode",
    "sensing",
    "status",
    "score",
    "in_goal",
    "outside",
    "reason",
    "note",
    "started_utc",
    "ended_utc",
    "ticks",
    "sim_time_s",
    "missed_ticks",
    "verified_utc",
    "verify_note",
    "session_id",
    "seed",
    "seed_hex",
    "state_hash",
    "replay_sha256",
    "events",
    "server_version",
    "build_hash",
    "started_unix_ms",
    "ended_unix_ms",
    "verified_unix_ms",
];

/// Columns of the audit.
pub(super) const AUDIT: [&str; 9] =
    ["seq", "utc", "actor", "action", "subject", "reason", "unix_ms", "label", "seconds"];

/// Rows and the order of their columns.
pub(super) struct Table {
    columns: Vec<String>,
    /// A list of objects.
    pub(super) rows: Value,
}

impl Table {
    /// A list of objects, with these columns first. Other fields follow, by name.
    pub(super) fn new(columns: &[&str], mut rows: Value) -> Self {
        let mut columns: Vec<String> = columns.iter().map(|name| (*name).to_owned()).collect();
        for row in rows.as_array_mut().into_iter().flatten().filter_map(Value::as_object_mut) {
            for (name, value) in row.clone() {
                if let Some(stem) = name.strip_suffix("unix_ms") {
                    row.insert(format!("{stem}utc"), value.as_i64().map(utc).into());
                }
            }
            for name in row.keys().filter(|name| !columns.contains(name)).cloned().collect::<Vec<_>>() {
                columns.push(name);
            }
        }
        Table { columns, rows }
    }
}

/// The leaderboard as flat rows: three columns per task.
pub(super) fn leaderboard(rows: &[LeaderboardRow], tasks: &[String]) -> Table {
    let of_task = |task: &String| [task.clone(), format!("{task}_status"), format!("{task}_run_id")];
    let names: Vec<String> = tasks.iter().flat_map(of_task).collect();
    let mut columns = vec!["rank", "team", "total"];
    columns.extend(names.iter().map(String::as_str));
    columns.extend(["runs", "sensors_only", "sensors_rank", "reached_utc", "reached_unix_ms"]);
    let flat = |row: &LeaderboardRow| {
        let mut cells = Map::new();
        let mut put = |name: &str, value: Value| cells.insert(name.to_owned(), value);
        put("rank", json!(row.rank));
        put("team", json!(row.team));
        put("total", json!(row.total));
        for task in tasks {
            let best = row.tasks.get(task);
            let [score, status, run_id] = of_task(task);
            put(&score, json!(best.map(|best| best.score)));
            put(&status, json!(best.map(|best| &best.status)));
            put(&run_id, json!(best.map(|best| &best.run_id)));
        }
        put("runs", json!(row.runs));
        put("sensors_only", json!(row.sensors_only));
        put("sensors_rank", json!(row.sensors_rank));
        put("reached_unix_ms", json!(row.reached_unix_ms));
        Value::Object(cells)
    };
    Table::new(&columns, rows.iter().map(flat).collect())
}

/// The response with a table.
pub(super) fn response(table: &Table) -> Response {
    ([(CONTENT_TYPE, "text/csv; charset=utf-8")], write(table)).into_response()
}

/// Encodes a table; lists in a cell are JSON.
fn write(table: &Table) -> String {
    let mut writer = WriterBuilder::new().terminator(Terminator::CRLF).from_writer(Vec::new());
    let columns = &table.columns;
    let head = columns.iter().map(|name| cell(&json!(name)));
    // Rows have the length of the head, and are written to memory: this cannot fail.
    let _ = writer.write_record(head);
    for row in table.rows.as_array().into_iter().flatten() {
        let _ = writer.write_record(columns.iter().map(|name| cell(&row[name.as_str()])));
    }
    String::from_utf8(writer.into_inner().unwrap_or_default()).unwrap_or_default()
}

fn cell(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        // A spreadsheet would evaluate it as a formula.
        Value::String(text) if text.starts_with(['=', '+', '-', '@', '\t', '\r']) => format!("'{text}"),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_of_teams_stays_in_its_cell() {
        let rows = json!([
            {"team": "a,\"b\"\nc", "total": -1.5, "k": null},
            {"team": "=HYPERLINK(1)", "total": 2, "events": [1, 2]},
        ]);
        let text = write(&Table::new(&["total", "team"], rows));
        let quoted = "\"a,\"\"b\"\"\nc\"";
        assert!(text.contains(quoted) && text.contains("-1.5"), "{text}");
        assert!(text.contains("'=HYPERLINK(1)") && text.contains("\"[1,2]\""), "{text}");
        assert!(text.starts_with("total,team,k,events\r\n"), "{text}");
    }

    #[test]
    fn times_are_in_iso_8601_too_and_columns_are_there_without_rows() {
        let rows = json!([{"seq": 1, "unix_ms": 1_795_238_560_323_i64, "ended_unix_ms": null}]);
        let text = write(&Table::new(&AUDIT, rows));
        assert_eq!(
            text,
            "seq,utc,actor,action,subject,reason,unix_ms,label,seconds,ended_unix_ms,ended_utc\r\n\
             1,2026-11-21T05:22:40Z,,,,,1795238560323,,,,\r\n"
        );
        assert_eq!(write(&leaderboard(&[], &["balls".into()])).lines().count(), 1);
    }
}
