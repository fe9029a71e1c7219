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
        writeln!(
            out,
            "{:<14} {motors}, {} joint coordinates. {}{grasp}",
            hand.name, hand.joints, hand.description
        )?;
    }
    Ok(())
}

/// Prints the tasks.
pub(crate) fn tasks() -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    for task in Task::builtin() {
        let (tick_ms, limit_s) = (task.tick_s * 1e3, task.time_limit_s);
        writeln!(out, "{:<12} ticks of {tick_ms} ms, at most {limit_s} s. {}", task.name, task.description)?;
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
