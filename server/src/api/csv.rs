//! Tables as CSV (RFC 4180), from the same JSON that the other format sends.

use crate::store::LeaderboardRow;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use serde_json::{Map, Value, json};

/// The leaderboard as flat rows: one column per task.
pub(super) fn leaderboard_rows(rows: &[LeaderboardRow], tasks: &[String]) -> Value {
    let flat = |row: &LeaderboardRow| {
        let mut cells = Map::new();
        let mut put = |name: &str, value: Value| cells.insert(name.to_owned(), value);
        put("rank", json!(row.rank));
        put("team", json!(row.team));
        put("total", json!(row.total));
        for task in tasks {
            let best = row.tasks.get(task);
            put(task, json!(best.map(|best| best.score)));
            put(&format!("{task}_status"), json!(best.map(|best| &best.status)));
            put(&format!("{task}_run_id"), json!(best.map(|best| &best.run_id)));
        }
        put("runs", json!(row.runs));
        put("sensors_only", json!(row.sensors_only));
        put("sensors_rank", json!(row.sensors_rank));
        put("reached_unix_ms", json!(row.reached_unix_ms));
        Value::Object(cells)
    };
    rows.iter().map(flat).collect()
}

/// Rows as an answer.
pub(super) fn response(rows: &Value) -> Response {
    ([(CONTENT_TYPE, "text/csv; charset=utf-8")], write(rows)).into_response()
}

/// A list of objects as text, one column per field of the rows, in alphabetic order. Lists in a cell stay JSON.
fn write(rows: &Value) -> String {
    let empty = Vec::new();
    let rows = rows.as_array().unwrap_or(&empty);
    // A field that is left out of one row may stand in another.
    let mut names: Vec<&str> = Vec::new();
    for row in rows.iter().filter_map(Value::as_object) {
        for name in row.keys() {
            if !names.contains(&name.as_str()) {
                names.push(name);
            }
        }
    }
    let mut text = names.iter().map(|name| cell(&Value::from(*name))).collect::<Vec<_>>().join(",");
    text.push_str("\r\n");
    for row in rows {
        let cells: Vec<String> = names.iter().map(|name| cell(&row[*name])).collect();
        text.push_str(&cells.join(","));
        text.push_str("\r\n");
    }
    text
}

fn cell(value: &Value) -> String {
    let text = match value {
        Value::Null => return String::new(),
        Value::String(text) if text.starts_with(['=', '+', '-', '@', '\t', '\r']) => {
            // A spreadsheet would take it for a formula.
            format!("'{text}")
        }
        Value::String(text) => text.clone(),
        other => other.to_string(),
    };
    if text.contains([',', '"', '\r', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_teams_write_stays_in_its_cell() {
        let rows = json!([
            {"team": "a,\"b\"\nc", "total": -1.5, "k": null},
            {"team": "=HYPERLINK(1)", "total": 2, "events": [1, 2]},
        ]);
        let text = write(&rows);
        let quoted = "\"a,\"\"b\"\"\nc\"";
        assert!(text.contains(quoted) && text.contains("-1.5"), "{text}");
        assert!(text.contains("'=HYPERLINK(1)") && text.contains("\"[1,2]\""), "{text}");
        let head = text.split("\r\n").next().expect("a line");
        let mut names: Vec<&str> = head.split(',').collect();
        names.sort_unstable();
        assert_eq!(names, ["events", "k", "team", "total"]);
    }
}
