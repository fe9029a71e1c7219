//! `palmares hands`, `palmares tasks`.

use palmares_models::builtin::builtin_hands;
use palmares_tasks::Task;
use std::io::Write;

/// Prints the hands.
pub(super) fn hands() -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    for hand in builtin_hands() {
        let (motors, joints) = (hand.motors.len(), hand.coordinates.len());
        writeln!(
            out,
            "{:<12} {motors} motor(s), {joints} joint coordinates. {}",
            hand.name, hand.description
        )?;
    }
    Ok(())
}

/// Prints the tasks.
pub(super) fn tasks() -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    for task in Task::builtin() {
        let (tick_ms, limit_s) = (task.tick_s * 1e3, task.time_limit_s);
        writeln!(out, "{:<12} ticks of {tick_ms} ms, at most {limit_s} s. {}", task.name, task.description)?;
    }
    Ok(())
}
