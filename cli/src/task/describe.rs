//! A task as text.

use palmares_hand_tools::table::table;
use palmares_tasks::Task;
use palmares_tasks::scene::Scene;
use palmares_tasks::task::{Goal, Placing, Rules};
use std::fmt::Write;

/// Rows of a table.
type Rows = Vec<Vec<String>>;

fn row(cells: &[&str]) -> Vec<String> {
    cells.iter().map(|cell| (*cell).to_owned()).collect()
}

fn mm(xs: [f64; 3]) -> String {
    xs.iter().map(|x| format!("{:.1}", x * 1e3)).collect::<Vec<_>>().join(" ")
}

/// The content of a task.
pub(super) fn describe(task: &Task) -> String {
    let mut out = String::new();
    let count = task.objects.count;
    let objects = if count == 1 { "1 object".to_owned() } else { format!("{count} objects") };
    let _ = writeln!(out, "{}: {}\nhash {}", task.name, task.description, task.content_hash());
    let _ = writeln!(
        out,
        "ticks of {} ms, steps of {} ms, at most {} s; {objects}; the hand starts at ({} mm)",
        task.tick_s * 1e3,
        task.step_s * 1e3,
        task.time_limit_s,
        mm(task.hand.position)
    );
    if !task.objects.own.is_empty() {
        let _ = writeln!(out, "\nObjects of its own");
        for own in &task.objects.own {
            let _ = writeln!(out, "  {}: {}", own.name, own.source);
        }
    }
    let _ = writeln!(out, "\nPlacing: {}", placing(&task.place));
    let _ = writeln!(out, "\nRegions (mm)");
    let mut rows: Rows = vec![row(&["name", "role", "from", "to"])];
    for (name, (min, max)) in task.regions() {
        rows.push(row(&[name, task.rules.role(name).unwrap_or("none"), &mm(min), &mm(max)]));
    }
    out += &table(&rows);
    let _ = writeln!(out, "\nRules\n{}", rules(&task.rules));
    let cameras: Vec<String> =
        task.cameras.iter().map(|c| format!("{} ({} x {})", c.name, c.width, c.height)).collect();
    let cameras = if cameras.is_empty() { "none".to_owned() } else { cameras.join(", ") };
    let _ = writeln!(out, "\nCameras: {cameras}");
    out
}

fn placing(place: &Placing) -> String {
    match place {
        Placing::Pour(pour) => format!("dropped into `{}` in layers of {}", pour.into, pour.layer),
        Placing::Scatter(scatter) => {
            format!("put down in `{}`, {:.1} mm apart or more", scatter.into, scatter.gap * 1e3)
        }
        Placing::Fixed(list) => {
            let each = list.iter().map(|fixed| {
                let on = fixed.on.as_deref().map_or(String::new(), |on| format!(" on `{on}`"));
                let (at, shift) = (mm(fixed.position), mm(fixed.shift));
                format!("`{}`{on} at ({at}) mm, ± ({shift}) mm, ± {}°", fixed.object, fixed.turn_deg)
            });
            each.collect::<Vec<_>>().join("; ")
        }
    }
}

fn rules(rules: &Rules) -> String {
    match rules {
        Rules::Collect(rules) => format!(
            "  collect: from `{}` to `{}`; {} for each in the goal, {} for each in neither",
            rules.start, rules.goal, rules.in_goal, rules.outside
        ),
        Rules::Hold(rules) => format!(
            "  hold: lift by {} mm, hold for {} s, slip by less than {} mm, through a shake",
            rules.lift_m * 1e3,
            rules.hold_s,
            rules.slip_m * 1e3
        ),
        Rules::Arrange(rules) => {
            let goals = rules.goals.iter().enumerate().map(|(k, goal)| format!("  {}. {}", k + 1, aim(goal)));
            goals.collect::<Vec<_>>().join("\n")
        }
    }
}

/// A goal in one line.
fn aim(goal: &Goal) -> String {
    let mut asks = Vec::new();
    if let Some(region) = &goal.inside {
        asks.push(format!("in `{region}`"));
    }
    if let Some(within) = &goal.within {
        asks.push(format!("within ({}) to ({}) mm of `{}`", mm(within.min), mm(within.max), within.object));
    }
    if let Some(above_m) = goal.above_m {
        asks.push(format!("raised by {} mm", above_m * 1e3));
    }
    if let Some(upright_deg) = goal.upright_deg {
        asks.push(format!("upright within {upright_deg}°"));
    }
    if goal.at_rest {
        asks.push("at rest".to_owned());
    }
    if let Some(hand_off_m) = goal.hand_off_m {
        asks.push(format!("{} mm or more from the hand's base", hand_off_m * 1e3));
    }
    if goal.for_s > 0.0 {
        asks.push(format!("for {} s", goal.for_s));
    }
    let point = goal.point.map_or(String::new(), |point| format!(", its point ({}) mm", mm(point)));
    format!("{}: `{}`{point} {}: {} points", goal.name, goal.object, asks.join(", "), goal.points)
}

/// The bodies of a scene.
pub(super) fn bodies(scene: &Scene) -> String {
    let mut rows: Rows = vec![row(&["body", "kg", "friction", "parts", "size (mm)", "at (mm)"])];
    for body in &scene.bodies {
        let size = body.half_extents().map(|x| 2.0 * x);
        let mass = if body.free { format!("{:.3}", body.mass) } else { "fixed".to_owned() };
        let size = if body.endless { "endless".to_owned() } else { mm(size) };
        rows.push(row(&[
            &body.name,
            &mass,
            &body.friction.to_string(),
            &body.parts.len().to_string(),
            &size,
            &mm(body.position.unwrap_or_default()),
        ]));
    }
    table(&rows)
}
