//! A task as text.

use palmares_hand_tools::table::table;
use palmares_tasks::Task;
use palmares_tasks::scene::Scene;
use palmares_tasks::task::Placing;
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
    if let Some(carrier) = &task.arm {
        let arm = carrier.arm();
        let names: Vec<&str> = arm.joints.iter().map(|joint| joint.name.as_str()).collect();
        let root = mm(arm.world_from_root.translation.to_array());
        let _ = writeln!(out, "arm `{}` at ({root} mm): {}", arm.name, names.join(", "));
    }
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
    let _ = writeln!(out, "\nRules\n  {}", task.rules.describe().join("\n  "));
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
