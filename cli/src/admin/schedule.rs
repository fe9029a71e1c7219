//! `palmares admin schedule`: the time slots of teams.

use super::client::Client;
use super::reason::Reason;
use super::team_name::team_name;
use anyhow::{Context, bail};
use clap::Subcommand;
use palmares_hand_tools::table::{self, aligned};
use palmares_protocol::text::printable;
use palmares_protocol::utc;
use serde_json::{Value, json};
use std::io::Write;
use std::path::PathBuf;

/// Commands on the schedule. Times state their offset from UTC: 2027-05-04T09:00:00+02:00, or 2027-05-04T07:00:00Z.
#[derive(Debug, Subcommand)]
pub(super) enum Schedule {
    /// Show the slots, and problems such as more teams at once than places
    Show,
    /// Replace the schedule by a CSV file with the columns team, begins_at and ends_at
    Import {
        /// The file
        file: PathBuf,
        #[command(flatten)]
        reason: Reason,
    },
    /// Add a slot
    Add {
        /// The team
        #[arg(allow_hyphen_values = true, value_parser = team_name)]
        team: String,
        /// Its begin
        #[arg(long, value_name = "TIME")]
        begins: String,
        /// Its end
        #[arg(long, value_name = "TIME")]
        ends: String,
        #[command(flatten)]
        reason: Reason,
    },
    /// Move a team's slot to another time, or with --by all slots that have not begun
    Move {
        /// The team
        #[arg(required_unless_present = "by", allow_hyphen_values = true, value_parser = team_name)]
        team: Option<String>,
        /// The new begin
        #[arg(long, value_name = "TIME", required_unless_present = "by", conflicts_with = "by")]
        begins: Option<String>,
        /// The new end [default: the slot keeps its length]
        #[arg(long, value_name = "TIME", conflicts_with = "by")]
        ends: Option<String>,
        /// The present begin of the slot, if the team has several
        #[arg(long, value_name = "TIME", conflicts_with = "by")]
        from: Option<String>,
        /// Move all slots that have not begun, of the team or of all teams, by this many minutes
        #[arg(long, value_name = "MINUTES", allow_negative_numbers = true)]
        by: Option<i32>,
        #[command(flatten)]
        reason: Reason,
    },
    /// Remove the slots of a team, or all; without a slot, every team can begin at any time
    Clear {
        /// The team
        #[arg(allow_hyphen_values = true, value_parser = team_name)]
        team: Option<String>,
        #[command(flatten)]
        reason: Reason,
    },
}

/// Runs the command; prints the schedule afterwards.
pub(super) fn schedule(client: &Client, command: &Schedule, as_json: bool) -> anyhow::Result<()> {
    let (verb, body) = match command {
        Schedule::Show => return print(&client.get("/v1/admin/schedule")?, as_json),
        Schedule::Import { file, reason } => {
            let csv =
                std::fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))?;
            ("import", json!({"csv": csv, "reason": reason.reason}))
        }
        Schedule::Add { team, begins, ends, reason } => {
            ("add", json!({"team": team, "begins_at": begins, "ends_at": ends, "reason": reason.reason}))
        }
        Schedule::Move { team, by: Some(minutes), reason, .. } => {
            let Some(by_s) = minutes.checked_mul(60) else { bail!("--by {minutes}: too many minutes") };
            ("move", json!({"team": team, "by_s": by_s, "reason": reason.reason}))
        }
        Schedule::Move { team, begins, ends, from, by: None, reason } => {
            let reason = &reason.reason;
            (
                "move",
                json!({"team": team, "begins_at": begins, "ends_at": ends, "from": from, "reason": reason}),
            )
        }
        Schedule::Clear { team, reason } => ("clear", json!({"team": team, "reason": reason.reason})),
    };
    print(&client.post(&format!("/v1/admin/schedule/{verb}"), &body)?, as_json)
}

/// Prints the slots; the warnings go to stderr.
fn print(answer: &Value, as_json: bool) -> anyhow::Result<()> {
    let text = if as_json { table::json(answer) + "\n" } else { shown(answer) };
    std::io::stdout().lock().write_all(text.as_bytes()).context("cannot write to stdout")?;
    for warning in answer["warnings"].as_array().into_iter().flatten().filter_map(Value::as_str) {
        eprintln!("warning: {}", printable(warning));
    }
    Ok(())
}

fn shown(answer: &Value) -> String {
    let slots = answer["slots"].as_array().map_or(&[][..], Vec::as_slice);
    if slots.is_empty() {
        return "no schedule: every team can begin at any time\n".to_owned();
    }
    let mut cells =
        vec![["team", "begins (UTC)", "ends (UTC)", "minutes", "state"].map(str::to_owned).to_vec()];
    for slot in slots {
        let time = |name: &str| slot[name].as_i64().unwrap_or_default();
        let (begins, ends) = (time("begins_unix_ms"), time("ends_unix_ms"));
        let word = |name: &str| slot[name].as_str().unwrap_or_default().to_owned();
        let minutes = format!("{:.0}", (ends - begins) as f64 / 60_000.0);
        cells.push(vec![word("team"), utc(begins), utc(ends), minutes, word("state")]);
    }
    aligned(&cells, |column| column == 3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_schedule_is_a_table() {
        assert!(shown(&json!({"slots": []})).starts_with("no schedule"));
        let slot = json!({"team": "crabs", "begins_unix_ms": 1_809_511_200_000_i64,
            "ends_unix_ms": 1_809_513_600_000_i64, "state": "later"});
        let text = shown(&json!({"slots": [slot], "places": 32, "warnings": []}));
        let line = text.lines().nth(1).unwrap_or_default();
        for part in ["crabs", "2027-05-05T10:00:00Z", "2027-05-05T10:40:00Z", " 40 ", "later"] {
            assert!(line.contains(part), "{part}: {text}");
        }
    }
}
