//! A team's hand, for the decision on it: figures, a drawing, and trial runs.

use super::client::{Client, escaped};
use anyhow::{Context, anyhow};
use palmares_hand_tools::table::columns;
use palmares_hand_tools::{draw_hand, figures, print_trials};
use palmares_models::hand::Hand;
use palmares_models::read::{self, Files, LoadOptions};
use palmares_tasks::Task;
use palmares_tasks::inspect::FigureRow;
use serde::Deserialize;
use serde_json::Value;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

/// The server's response on a hand.
#[derive(Debug, Deserialize)]
struct Shown {
    hand: Value,
    figures: Vec<FigureRow>,
    in_the_way: Vec<String>,
}

impl Shown {
    fn of(client: &Client, id: &str) -> anyhow::Result<Shown> {
        let answer = client.get(&format!("/v1/admin/hands/{}", escaped(id)))?;
        serde_json::from_value(answer)
            .context("this server sends less about a hand than this program expects")
    }

    fn word(&self, field: &str) -> &str {
        self.hand[field].as_str().unwrap_or_default()
    }
}

/// Downloads the hand and reads it as the server does.
fn fetched(client: &Client, id: &str) -> anyhow::Result<Hand> {
    let mut bytes = Vec::new();
    client.fetch(&format!("/v1/admin/hands/{}/archive", escaped(id)), &mut bytes)?;
    let options = LoadOptions::default();
    let files = Files::archive(Path::new("hand.zip"), &bytes, &options.limits)?;
    Ok(read::from_files(files, None, &options)?.hand)
}

/// Prints the figures, and draws the hand from three sides.
pub(crate) fn show(client: &Client, id: &str, picture: Option<&Path>, json: bool) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    if json {
        let answer = client.get(&format!("/v1/admin/hands/{}", escaped(id)))?;
        writeln!(out, "{}", serde_json::to_string_pretty(&answer)?)?;
        if let Some(file) = picture {
            draw_hand(&fetched(client, id)?, file)?;
        }
        return Ok(());
    }
    let shown = Shown::of(client, id)?;
    let (team, name) = (shown.word("team"), shown.word("name"));
    writeln!(out, "{id}: {name} of {team}, {}", shown.word("status"))?;
    for warning in shown.hand["warnings"].as_array().into_iter().flatten() {
        writeln!(out, "  warning: {}", warning.as_str().unwrap_or_default())?;
    }
    for line in &shown.in_the_way {
        writeln!(out, "  NOT ALLOWED: {line}")?;
    }
    write!(out, "\n{}", figures(name, &shown.figures, columns()))?;
    if let Some(file) = picture {
        draw_hand(&fetched(client, id)?, file)?;
        writeln!(out, "wrote {}", file.display())?;
    }
    Ok(())
}

/// Plays the hand in this process, in each task of the server.
pub(crate) fn attempt(client: &Client, id: &str, json: bool) -> anyhow::Result<()> {
    let hand = Arc::new(fetched(client, id)?);
    let listed = client.get("/v1/tasks")?;
    let served: Vec<&str> =
        listed["tasks"].as_array().into_iter().flatten().filter_map(|task| task["name"].as_str()).collect();
    let tasks: Vec<Arc<Task>> =
        Task::builtin().into_iter().filter(|task| served.contains(&task.name.as_str())).collect();
    if tasks.is_empty() {
        return Err(anyhow!("this program has none of the server's tasks: {}", served.join(", ")));
    }
    let head = format!("{}: practice runs by a fixed script\n", hand.name);
    print_trials(&tasks, &hand, &head, json).map(drop)
}

/// Prints on stderr, before an approval, which figures are beyond limits or other hands.
pub(crate) fn warn(client: &Client, id: &str) -> anyhow::Result<()> {
    let shown = Shown::of(client, id)?;
    for line in &shown.in_the_way {
        eprintln!("not allowed: {line}");
    }
    for row in &shown.figures {
        match (row.allowed, row.beyond_others) {
            (false, _) => eprintln!("not allowed: {}", row.in_words()),
            (true, true) => eprintln!("beyond the program's hands: {}", row.in_words()),
            (true, false) => {}
        }
    }
    Ok(())
}
