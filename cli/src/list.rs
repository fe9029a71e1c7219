//! `palmares hands`, `palmares tasks`, `palmares objects`.

use palmares_models::builtin::{Grasped, builtin_hands, grasped, sources};
use palmares_models::catalogue::Catalogue;
use palmares_tasks::Task;
use serde::Serialize;
use std::io::Write;

/// A line of `palmares hands --json`.
#[derive(Serialize)]
struct Listed {
    name: String,
    description: String,
    joints: usize,
    motors: usize,
    /// Where its numbers come from; empty if this project chose them all.
    sources: Vec<String>,
    /// Its result in the task `grasp`.
    grasp: Option<Grasped>,
}

/// Prints the hands, as text or as one JSON list.
pub(crate) fn hands(json: bool) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    let listed = builtin_hands().iter().map(|hand| Listed {
        name: hand.name.clone(),
        description: hand.description.clone(),
        joints: hand.coordinates.len(),
        motors: hand.motors.len(),
        sources: sources(&hand.name),
        grasp: grasped(&hand.name),
    });
    if json {
        writeln!(out, "{}", serde_json::to_string_pretty(&listed.collect::<Vec<_>>())?)?;
        return Ok(());
    }
    for hand in listed {
        let motors = if hand.motors == 1 { "1 motor".into() } else { format!("{} motors", hand.motors) };
        let grasp = hand.grasp.map_or(String::new(), |grasp| {
            format!(
                " Grasps {} of {} objects, {:.2} points.",
                grasp.held.len(),
                grasp.held.len() + grasp.not_held.len(),
                grasp.mean
            )
        });
        let text = format!("{motors}, {} joint coordinates. {}{grasp}", hand.joints, hand.description);
        write!(out, "{}", listed_item(&hand.name, 15, &text))?;
    }
    Ok(())
}

/// Columns of a line, on a terminal and in a file.
const COLUMNS: usize = 80;

/// A name and its text, which begins at a column and is wrapped.
fn listed_item(name: &str, column: usize, text: &str) -> String {
    let mut out = format!("{name:<column$}");
    let mut used = out.chars().count();
    let first = used;
    for word in text.split_whitespace() {
        let width = word.chars().count();
        if used > first && used + width > COLUMNS {
            out.truncate(out.trim_end().len());
            out += &format!("\n{:column$}", "");
            used = column;
        }
        out += word;
        out.push(' ');
        used += width + 1;
    }
    out.truncate(out.trim_end().len());
    out.push('\n');
    out
}

/// Prints the tasks.
pub(crate) fn tasks() -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    for task in Task::builtin() {
        let (tick_ms, limit_s) = (task.tick_s * 1e3, task.time_limit_s);
        let text = format!("ticks of {tick_ms} ms, at most {limit_s} s. {}", task.description);
        write!(out, "{}", listed_item(&task.name, 13, &text))?;
    }
    Ok(())
}

/// Prints the catalogue of objects.
pub(crate) fn objects() -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    for item in Catalogue::builtin().items() {
        let ([x, y, z], object) = (item.size.map(|x| x * 1e3), &item.object);
        let (name, mass_g, category) = (&object.name, object.mass * 1e3, &item.category);
        let size = format!("{x:.0} x {y:.0} x {z:.0} mm");
        write!(
            out,
            "{name:<42} {mass_g:>6.0} g  {size:<20} {category:<10} {} ({})",
            item.title, item.source
        )?;
        let note = if item.note.is_empty() { String::new() } else { format!("; {}", item.note) };
        writeln!(out, "{note}")?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_text_is_wrapped_below_its_beginning() {
        let text = "word ".repeat(30);
        let item = listed_item("softhand_skin", 15, &text);
        let lines: Vec<&str> = item.lines().collect();
        assert_eq!(lines.len(), 3, "{item}");
        assert!(
            lines.iter().all(|line| line.len() <= COLUMNS && line.len() == line.trim_end().len()),
            "{item}"
        );
        assert!(
            lines[0].starts_with("softhand_skin  word") && lines[1].starts_with(&format!("{:15}word", ""))
        );
        assert_eq!(item.split_whitespace().count(), 31);
        assert_eq!(listed_item("a", 4, "b"), "a   b\n");
    }
}
