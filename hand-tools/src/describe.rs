//! A hand as text: tree, coordinates with R and E, motors and tendons.

use crate::table::{table, widest, wrapped};
use palmares_models::camera::Camera;
use palmares_models::hand::describe::{HandDescription, TendonDescription, UncertainDescription};
use palmares_models::hand::number::{Entry, Numbers};
use palmares_models::hand::sensors::Sensors;
use palmares_models::hand::{Guide, Hand, HingeKind, TactilePatch};
use palmares_models::shape::Shape;
use std::fmt::Write;

/// Describes the model of a hand; tables have at most `width` columns.
pub(crate) fn describe(hand: &Hand, width: Option<usize>) -> String {
    let about = hand.describe();
    let mut out = String::new();
    // Writing to a string cannot fail.
    let _ = write!(out, "{}", heading(hand, &about));
    let _ = write!(out, "\nTree (link: mass; joint; shapes)\n{}", tree(hand));
    let _ = write!(
        out,
        "\nCoordinates, E, D and R (one column of R per tendon)\n{}",
        coordinates(hand, &about, width)
    );
    let _ = write!(out, "\nMotors and tendons\n{}{}", actuation(&about), friction(hand));
    let _ = write!(out, "\nSensors, besides those of the motors\n{}", sensors(hand));
    if !about.uncertain.is_empty() {
        let _ =
            write!(out, "\nUncertain (range of a factor, or of the number itself)\n{}", uncertain(&about));
    }
    out
}

fn heading(hand: &Hand, about: &HandDescription) -> String {
    let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    let shapes: usize = hand.links.iter().map(|l| l.geoms.len()).sum();
    let parts = [
        count(hand.links.len(), "link"),
        count(hand.coordinates.len(), "coordinate"),
        count(hand.tendons.len(), "tendon"),
        count(hand.motors.len(), "motor"),
        count(shapes, "shape"),
    ];
    let gravity = if hand.gravity_compensation { "compensated" } else { "not compensated" };
    format!(
        "{}: {}\n{}; mass {} kg; its own weight is {gravity}\n",
        about.name,
        about.description,
        parts.join(", "),
        short(about.mass)
    )
}

fn tree(hand: &Hand) -> String {
    let mut out = String::new();
    branch(hand, 0, "", "", &mut out);
    out
}

/// Recursive: the depth of the links is bounded.
fn branch(hand: &Hand, i: usize, first: &str, rest: &str, out: &mut String) {
    let link = &hand.links[i];
    let joint = link.joint.as_ref().map_or(String::new(), |joint| {
        let kind = match (joint.hinges.len(), joint.hinges.first().map(|h| h.kind)) {
            (2, _) => "rolling",
            (_, Some(HingeKind::Prismatic)) => "slides",
            _ => "turns",
        };
        let name = &hand.coordinates[joint.coordinate].name;
        let ratio = joint.hinges.first().map_or(1.0, |h| h.ratio);
        let unit = match (kind, hand.slides(joint.coordinate)) {
            ("slides", false) => " m/rad",
            ("turns", true) => " rad/m",
            _ => "",
        };
        let plain = ratio == 1.0 && unit.is_empty();
        let ratio = if plain { String::new() } else { format!(" x {}{unit}", short(ratio)) };
        format!("; {kind} by {name}{ratio}")
    });
    let shapes: Vec<&str> = link.geoms.iter().map(|g| kind(&g.shape)).collect();
    let shapes = if shapes.is_empty() { "no shape".to_owned() } else { shapes.join(", ") };
    let _ = writeln!(out, "  {first}{}: {} kg{joint}; {shapes}", link.name, short(link.inertia.mass));
    let children: Vec<usize> = (0..hand.links.len()).filter(|&c| hand.links[c].parent == Some(i)).collect();
    for (k, &child) in children.iter().enumerate() {
        let (a, b) = if k + 1 == children.len() { ("└─ ", "   ") } else { ("├─ ", "│  ") };
        branch(hand, child, &format!("{rest}{a}"), &format!("{rest}{b}"), out);
    }
}

fn kind(shape: &Shape) -> &'static str {
    match shape {
        Shape::Sphere { .. } => "ball",
        Shape::Capsule { .. } => "capsule",
        Shape::Cylinder { .. } => "cylinder",
        Shape::Box { .. } => "box",
        Shape::Hull { .. } => "hull",
    }
}

/// Columns of the table of coordinates before those of R.
const OF_A_COORDINATE: usize = 7;

fn coordinates(hand: &Hand, about: &HandDescription, width: Option<usize>) -> String {
    let mut rows = vec![vec!["name", "unit", "lower", "upper", "rest", "E", "D"]]
        .into_iter()
        .map(|row| row.into_iter().map(str::to_owned).collect::<Vec<String>>())
        .collect::<Vec<_>>();
    rows[0].extend(about.tendons.iter().map(|t| format!("R {}", t.name)));
    for (i, c) in about.coordinates.iter().enumerate() {
        let bound = |x: Option<f64>| x.map_or("-".to_owned(), short);
        let mut row = vec![
            c.name.clone(),
            (if hand.slides(i) { "m" } else { "rad" }).to_owned(),
            bound(c.minimum),
            bound(c.maximum),
            short(c.numbers.rest),
            short(c.numbers.stiffness),
            short(c.numbers.damping),
        ];
        row.extend(about.tendons.iter().map(|t| match t.moment_arms[i] {
            0.0 => ".".to_owned(),
            r => short(r),
        }));
        rows.push(row);
    }
    let whole = table(&rows);
    let entries = |i: usize| about.tendons.iter().filter(move |tendon| tendon.moment_arms[i] != 0.0);
    let few = (0..about.coordinates.len()).all(|i| entries(i).count() <= FEW_ENTRIES);
    if width.is_none_or(|width| widest(&whole) <= width) || !few {
        return wrapped(&rows, OF_A_COORDINATE, 1, width);
    }
    // One column with the entries of R that are not 0.
    for row in &mut rows {
        row.truncate(OF_A_COORDINATE);
    }
    rows[0].push("R of tendon".to_owned());
    for (i, coordinate) in about.coordinates.iter().enumerate() {
        let named = entries(i).map(|tendon| {
            let name = if tendon.name == coordinate.name { "its own" } else { &tendon.name };
            format!("{} {name}", short(tendon.moment_arms[i]))
        });
        rows[i + 1].push(named.collect::<Vec<_>>().join(", "));
    }
    wrapped(&rows, OF_A_COORDINATE, 1, width)
}

/// Tendons of a coordinate that are listed in one cell.
const FEW_ENTRIES: usize = 2;

fn actuation(about: &HandDescription) -> String {
    let mut out = String::new();
    for motor in &about.motors {
        let m = motor.numbers;
        let offset = if m.offset == 0.0 { String::new() } else { format!(" - {}", short(m.offset)) };
        let _ = writeln!(
            out,
            "  motor {}: s = {} (σ{offset}), at most {} /s",
            motor.name,
            short(m.scaling),
            short(m.speed_limit)
        );
        for (number, entry) in m.needed() {
            if let Entry::Number(x) = entry
                && !number.shown.is_empty()
            {
                let _ = writeln!(out, "    {}", number.shown.replace("{}", &short(x)));
            }
        }
    }
    for t in &about.tendons {
        let numbers = t.numbers;
        let _ = writeln!(
            out,
            "  tendon {} of {}: stiffness K {}, damping {}, tension at most {}",
            t.name,
            wound_by(t),
            short(numbers.stiffness),
            short(numbers.damping),
            short(numbers.force_limit)
        );
        if numbers.both_ways {
            let _ = writeln!(out, "    pushes as well as it pulls");
        }
        if let Some(hold) = numbers.hold_limit {
            let ends = if numbers.breakaway { "its clutch lets go" } else { "its motors stop" };
            let _ = writeln!(
                out,
                "    {ends} at {}; no load below {} turns it back",
                short(numbers.force_limit),
                short(hold)
            );
        }
        for e in &t.elements {
            let _ = writeln!(
                out,
                "    its arm at {} depends on that joint's angle; R is that at rest",
                e.coordinate
            );
        }
    }
    for spring in &about.springs {
        let _ = writeln!(
            out,
            "  spring {} on {}: stiffness {}, damping {}, rest {}",
            spring.name,
            sum_of(spring.moment_arms.iter().zip(&about.coordinates).map(|(arm, c)| (*arm, c.name.as_str()))),
            short(spring.numbers.stiffness),
            short(spring.numbers.damping),
            short(spring.numbers.rest)
        );
    }
    for pin in &about.linkages {
        let [a, b] = &pin.links;
        let _ = writeln!(
            out,
            "  linkage {}: pins {a} to {b}, stiffness {} N/m",
            pin.name,
            short(pin.numbers.stiffness)
        );
    }
    if out.is_empty() {
        out.push_str("  none\n");
    }
    out
}

/// Guides on which cables rub, and joints with dry friction; nothing without.
fn friction(hand: &Hand) -> String {
    let mut out = String::new();
    let name = |c: usize| hand.coordinates[c].name.as_str();
    for tendon in hand.tendons.iter().filter(|tendon| !tendon.guides.is_empty()) {
        let way = tendon.guides.iter().map(|g| format!("{} {}", name(g.coordinate), short(g.exponent())));
        let sum: f64 = tendon.guides.iter().map(Guide::exponent).sum();
        let _ = writeln!(
            out,
            "  tendon {} rubs on its way (μφ): {}; of the motor's pull {} % reach its end",
            tendon.name,
            way.collect::<Vec<_>>().join(", "),
            short(100.0 * (-sum).exp())
        );
    }
    let dry = hand.coordinates.iter().filter(|c| c.friction > 0.0);
    let dry: Vec<String> = dry.map(|c| format!("{} {}", c.name, short(c.friction))).collect();
    if !dry.is_empty() {
        let _ = writeln!(out, "  dry friction of joints: {}", dry.join(", "));
    }
    out
}

/// The motors of a tendon, in words.
fn wound_by(tendon: &TendonDescription) -> String {
    match (tendon.motor.is_empty(), tendon.motors.is_empty()) {
        (true, _) => format!("no motor, wound by {}", short(tendon.rest)),
        (false, true) => format!("motor {}", tendon.motor),
        (false, false) => {
            let motors = tendon.motors.iter().map(|entry| (entry.weight, entry.motor.as_str()));
            format!("motors {}", sum_of(motors))
        }
    }
}

/// A weighted sum of names: `0.5 a - 0.5 b`.
fn sum_of<'a>(terms: impl Iterator<Item = (f64, &'a str)>) -> String {
    let mut out = String::new();
    for (weight, name) in terms.filter(|(weight, _)| *weight != 0.0) {
        let sign = match (out.is_empty(), weight < 0.0) {
            (true, true) => "-",
            (true, false) => "",
            (false, true) => " - ",
            (false, false) => " + ",
        };
        let _ = match weight.abs() {
            1.0 => write!(out, "{sign}{name}"),
            size => write!(out, "{sign}{} {name}", short(size)),
        };
    }
    out
}

fn sensors(hand: &Hand) -> String {
    let mut out = String::new();
    // Exhaustive, so that a new sensor is not forgotten; every motor has its sensor.
    let Sensors { motors: _, joints, touch, accelerometer, cameras } = &hand.sensors;
    if let Some(encoders) = joints {
        let _ = writeln!(out, "  encoders of {}", encoders.on.join(", "));
    }
    if !hand.tactile.is_empty() {
        let taxels: usize = hand.tactile.iter().map(TactilePatch::len).sum();
        let shear = if touch.shear { "" } else { ", no shear" };
        let (patches, rate) = (hand.tactile.len(), short(touch.rate_hz));
        let _ = writeln!(out, "  touch: {taxels} taxels in {patches} patches, {rate} Hz{shear}");
    }
    if let Some(accelerometer) = accelerometer {
        let _ = writeln!(out, "  accelerometer on {}", accelerometer.link);
    }
    for camera in cameras {
        let Camera { name, width, height, .. } = camera;
        let on = camera.link.as_deref().unwrap_or("the base");
        let _ = writeln!(out, "  camera {name} on {on}: {width} x {height}");
    }
    if out.is_empty() {
        out.push_str("  none\n");
    }
    out
}

fn uncertain(about: &HandDescription) -> String {
    let mut out = String::new();
    for UncertainDescription { name, of, on, factor, value } in &about.uncertain {
        let range = match (factor, value) {
            (Some([low, high]), _) => format!("x {} to {}", short(*low), short(*high)),
            (None, value) => {
                let [low, high] = value.unwrap_or_default();
                format!("{} to {}", short(low), short(high))
            }
        };
        let of = if of.name() == name { String::new() } else { format!(": {}", of.name()) };
        let on = if on.is_empty() { String::new() } else { format!(" of {}", on.join(", ")) };
        let _ = writeln!(out, "  {name}{of}{on}: {range}");
    }
    out
}

/// A number with at most five significant digits.
pub(crate) fn short(x: f64) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    let magnitude = x.abs().log10().floor();
    if !(-4.0..6.0).contains(&magnitude) {
        return format!("{x:.3e}");
    }
    let decimals = (4.0 - magnitude).max(0.0) as usize;
    let text = format!("{x:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let cases =
            [(0.0, "0"), (1.0, "1"), (-0.2, "-0.2"), (12.5, "12.5"), (300.0, "300"), (0.765398163, "0.7654")];
        for (x, text) in cases {
            assert_eq!(short(x), text);
        }
        assert_eq!(short(1.0 / 3.0), "0.33333");
        assert_eq!(short(2.5e-7), "2.500e-7");
        assert_eq!(short(123456.0), "123456");
    }

    #[test]
    fn the_softhand_is_drawn_with_all_its_fingers() {
        let text = describe(&Hand::builtin("softhand").expect("it is built in"), None);
        assert!(text.contains("20 links, 19 coordinates, 1 tendon, 1 motor, 24 shapes"), "{text}");
        assert!(text.contains("├─ index_knuckle: 0.009 kg; turns by index_abd; box"), "{text}");
        assert!(text.contains("   └─ little_distal") || text.contains("└─ little_distal"), "{text}");
        assert!(text.contains("distal_arms: moment_arms of thumb_outer, "), "{text}");
        let row = text.lines().find(|l| l.trim_start().starts_with("index_abd ")).expect("its row");
        assert!(row.trim_end().ends_with("-0.2"), "{row}");
    }
}
