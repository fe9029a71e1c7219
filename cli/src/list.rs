//! `palmares hands`, `palmares tasks`, `palmares objects`.

use palmares_models::builtin::builtin_hands;
use palmares_models::catalogue::Catalogue;
use palmares_tasks::Task;
use std::io::Write;

/// Prints the hands.
pub(crate) fn hands() -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    for hand in builtin_hands() {
        let (motors, joints) = (hand.motors.len(), hand.coordinates.len());
        let motors = if motors == 1 { "1 motor".into() } else { format!("{motors} motors") };
        writeln!(out, "{:<12} {motors}, {joints} joint coordinates. {}", hand.name, hand.description)?;
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
