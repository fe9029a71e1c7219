//! `hand.toml`: motors, tendons and everything else that a URDF cannot express.

use std::fmt::Write as _;

use palmares_models::hand::CoordinateSettings;
use palmares_models::hand::number::{Entry, Number, Numbers, Unstated};

use super::{Comments, number};
use crate::complete::{Complete, Finger, Servo, ServoNumbers};
use crate::decision::At;
use crate::draft::{Draft, JointKind, TendonPath};

/// The line of `hand.toml` before the servos that the lines of tendons replace.
const REPLACED: &str =
    "# Servos of the fingers. The lines after \"Tendons\", without \"# \", replace all from here on.";

/// The text of `hand.toml`. The servos of `fingers` are its last tables, after [`REPLACED`].
pub(crate) fn settings(
    hand: &Complete,
    fingers: &[Finger<'_>],
    head: &str,
    comments: &mut Comments<'_>,
) -> String {
    let draft = &hand.draft;
    let mut out = format!("# {head}\n");
    let of_joints = hand.servos.iter().map(|servo| servo.motor.as_str());
    let motors: Vec<&str> = hand.motors.iter().map(|motor| motor.name.as_str()).chain(of_joints).collect();
    let kept = draft.settings.is_some();
    let tables: Vec<&str> = hand.tendons.iter().map(|tendon| tendon.name.as_str()).collect();
    let here = |at: &At| match at {
        At::Motor(name) => kept || !motors.contains(&name.as_str()),
        At::Tendon(name) => kept || !tables.contains(&name.as_str()),
        _ => true,
    };
    comment(&mut out, comments.all(here));
    if let Some(text) = &draft.settings {
        return out + text;
    }
    let _ = writeln!(out, "name = {}", quoted(&draft.name));
    if !draft.description.is_empty() {
        let _ = writeln!(out, "description = {}", quoted(&draft.description));
    }
    if let Some(friction) = draft.friction {
        let _ = writeln!(out, "friction = {}", number(friction));
    }
    if !draft.exclusions.is_empty() {
        out.push_str("no_collision = [\n");
        for [a, b] in &draft.exclusions {
            let _ = writeln!(out, "  [{}, {}],", quoted(a), quoted(b));
        }
        out.push_str("]\n");
    }
    start(&mut out, hand);
    for motor in &hand.motors {
        out.push('\n');
        comment(&mut out, comments.at(&At::Motor(motor.name.clone())));
        let _ = writeln!(out, "[motors.{}]", key(&motor.name));
        entries(&mut out, motor.numbers.needed());
    }
    for tendon in &hand.tendons {
        out.push('\n');
        comment(&mut out, comments.at(&At::Tendon(tendon.name.clone())));
        let _ = writeln!(out, "[tendons.{}]", key(&tendon.name));
        if tendon.motor_in_urdf().is_none() {
            if !tendon.motors.is_empty() {
                let _ = writeln!(out, "motors = {}", inline(&tendon.motors));
            }
            if !tendon.arms.is_empty() {
                let _ = writeln!(out, "joints = {}", inline(&tendon.arms));
            }
        }
        entries(&mut out, tendon.numbers.needed());
        for (joint, path) in &tendon.paths {
            let table = |kind: &str| format!("[tendons.{}.{kind}.{}]", key(&tendon.name), key(joint));
            let _ = match path {
                TendonPath::Polynomial(list) => {
                    writeln!(out, "{}\ncoefficients = {}", table("polynomial"), array(list))
                }
                TendonPath::Table(points) => {
                    let column = |k: usize| array(&points.iter().map(|point| point[k]).collect::<Vec<_>>());
                    writeln!(out, "{}\nat = {}\nlength = {}", table("table"), column(0), column(1))
                }
                TendonPath::Arm(_) => Ok(()),
            };
        }
    }
    let of_finger = |servo: &Servo| {
        fingers.iter().flat_map(|finger| &finger.joints).any(|joint| joint.name == servo.joint)
    };
    let (of_fingers, others): (Vec<&Servo>, Vec<&Servo>) =
        hand.servos.iter().partition(|servo| of_finger(servo));
    every_servo(&mut out, hand);
    servos(&mut out, hand, &others, comments);
    for spring in &draft.springs {
        let _ = writeln!(out, "\n[springs.{}]\njoints = {}", key(&spring.name), inline(&spring.joints));
        entries(&mut out, spring.numbers.entries());
    }
    for pin in &draft.loops {
        let [a, b] = pin.links.each_ref().map(|link| quoted(link));
        let [p, q] = pin.points.map(|point| array(&point));
        let _ = writeln!(out, "\n[linkages.{}]\nlinks = [{a}, {b}]\npoints = [{p}, {q}]", key(&pin.name));
    }
    // Springs of joints in a transmission are there.
    let in_urdf = hand.tendons.iter().filter(|tendon| tendon.motor_in_urdf().is_some());
    let in_tendon = |name: &str| in_urdf.clone().any(|t| t.arms.iter().any(|(joint, _)| joint == name));
    let sprung = |joint: &&crate::draft::Joint| joint.kind != JointKind::Fixed && !in_tendon(&joint.name);
    for joint in draft.joints.iter().filter(sprung) {
        if joint.stated.stiffness.is_none() {
            continue;
        }
        let _ = writeln!(out, "\n[coordinates.{}]", key(&joint.name));
        // The URDF has its damper and dry friction.
        entries(&mut out, CoordinateSettings { damping: None, friction: None, ..joint.stated }.entries());
    }
    for link in &draft.links {
        let from_shapes = hand.inertia_from_shapes.contains(&link.name);
        let mass = link.inertial.filter(|_| from_shapes).map(|inertial| inertial.mass);
        let numbers = [("mass", mass), ("friction", link.friction)];
        let stated: Vec<(&str, f64)> = numbers.into_iter().filter_map(|(name, x)| Some((name, x?))).collect();
        if stated.is_empty() {
            continue;
        }
        let _ = writeln!(out, "\n[links.{}]", key(&link.name));
        for (name, x) in stated {
            let _ = writeln!(out, "{name} = {}", number(x));
        }
    }
    if !of_fingers.is_empty() {
        let _ = writeln!(out, "\n{}", REPLACED);
        servos(&mut out, hand, &of_fingers, comments);
    }
    out
}

/// How the hand begins, as far as its joints and motors are still there.
fn start(out: &mut String, hand: &Complete) {
    let draft = &hand.draft;
    let follows = |name: &str| draft.couplings.iter().any(|coupling| coupling.joint == name);
    let moves = |name: &str| draft.joints.iter().any(|j| j.name == name && j.kind != JointKind::Fixed);
    let motor = |name: &str| {
        hand.motors.iter().any(|motor| motor.name == name) || hand.servos.iter().any(|s| s.motor == name)
    };
    let (mut joints, mut motors) = (draft.start.joints.clone(), draft.start.motors.clone());
    joints.retain(|(name, _)| moves(name) && !follows(name));
    for (name, q) in &mut joints {
        *q = limits(draft, name).into_iter().fold(*q, |q, [low, high]| q.max(low).min(high));
    }
    motors.retain(|(name, _)| motor(name));
    if joints.is_empty() && motors.is_empty() {
        return;
    }
    out.push_str("\n[start]\n");
    for (field, list) in [("joints", joints), ("motors", motors)] {
        if !list.is_empty() {
            let _ = writeln!(out, "{field} = {}", inline(&list));
        }
    }
}

/// Limits of a joint: its own, and those that the joints that follow it give it. A start of the source may be beyond them.
fn limits(draft: &Draft, name: &str) -> Vec<[f64; 2]> {
    let of =
        |name: &str| draft.joints.iter().find(|joint| joint.name == *name).and_then(|joint| joint.limits);
    let followers = draft.couplings.iter().filter(|coupling| coupling.leader == name);
    let given = followers.filter_map(|coupling| {
        let (&[offset, ratio], [low, high]) = (coupling.coefficients.as_slice(), of(&coupling.joint)?) else {
            return None;
        };
        let ends = [(low - offset) / ratio, (high - offset) / ratio];
        (ratio != 0.0).then_some([ends[0].min(ends[1]), ends[0].max(ends[1])])
    });
    of(name).into_iter().chain(given).collect()
}

/// Stiffness and damping that all servos have in common.
fn in_common(hand: &Complete) -> [Option<f64>; 2] {
    let numbers: Vec<ServoNumbers> = hand.servos.iter().filter_map(|servo| servo.numbers).collect();
    let same = |of: fn(&ServoNumbers) -> f64| {
        let first = of(numbers.first()?);
        (numbers.len() > 1 && numbers.iter().all(|other| of(other) == first)).then_some(first)
    };
    [same(|servo| servo.stiffness), same(|servo| servo.damping)]
}

/// What all servos have in common.
fn every_servo(out: &mut String, hand: &Complete) {
    let [stiffness, damping] = in_common(hand);
    if stiffness.is_some() || damping.is_some() {
        out.push_str("\n[every_servo]\n");
        for (field, value) in [("stiffness", stiffness), ("damping", damping)] {
            if let Some(value) = value {
                let _ = writeln!(out, "{field} = {}", number(value));
            }
        }
    }
}

/// What each of these servos has of its own.
fn servos(out: &mut String, hand: &Complete, servos: &[&Servo], comments: &mut Comments<'_>) {
    let [stiffness, damping] = in_common(hand);
    for (servo, numbers) in servos.iter().filter_map(|servo| Some((*servo, servo.numbers?))) {
        let lines = comments.at(&At::Motor(servo.motor.clone()));
        let mut own = String::new();
        if let Some(range) = numbers.range {
            let _ = writeln!(own, "range = {}", array(&range));
        }
        if let Some([effort, velocity]) = numbers.limits {
            let _ = writeln!(own, "effort = {}\nvelocity = {}", number(effort), number(velocity));
        }
        if stiffness.is_none() {
            let _ = writeln!(own, "stiffness = {}", number(numbers.stiffness));
        }
        if damping.is_none() {
            let _ = writeln!(own, "damping = {}", number(numbers.damping));
        }
        if !lines.is_empty() || !own.is_empty() {
            out.push('\n');
        }
        comment(out, lines);
        // A joint with a tendon has a servo only if its table says so.
        let of_joint = |(joint, _): &(String, f64)| *joint == servo.joint;
        let pulled = hand.tendons.iter().any(|tendon| {
            tendon.arms.iter().any(of_joint) || tendon.paths.iter().any(|(joint, _)| *joint == servo.joint)
        });
        // The loader leaves out a last joint that touches nothing, unless it has a table.
        let child =
            hand.draft.joints.iter().find(|joint| joint.name == servo.joint).map(|joint| &joint.child);
        let bare =
            hand.draft.links.iter().any(|link| Some(&link.name) == child && link.collisions.is_empty());
        if !own.is_empty() || pulled || bare {
            let _ = write!(out, "[servos.{}]\n{own}", key(&servo.joint));
        }
    }
}

/// Tables for every coordinate and link, as comments to fill in.
pub(crate) fn template(hand: &Complete) -> String {
    let mut out =
        String::from("\n# Springs, dampers and surfaces, to fill in. docs/hands.md explains every field.\n");
    let follows = |name: &str| hand.draft.couplings.iter().any(|coupling| coupling.joint == name);
    for joint in hand.draft.joints.iter().filter(|j| j.kind != JointKind::Fixed && !follows(&j.name)) {
        let (unit, force) = if joint.kind == JointKind::Prismatic { ("m", "N") } else { ("rad", "N·m") };
        let range = joint.limits.map(|[low, high]| format!("{} to {} {unit}", number(low), number(high)));
        let range = range.unwrap_or_else(|| "without limits".to_owned());
        let value = |x: Option<f64>| number(x.unwrap_or_default());
        let _ = writeln!(out, "\n# [coordinates.{}]  # {range}", key(&joint.name));
        let _ = writeln!(out, "# stiffness = {}  # E, {force}/{unit}", value(joint.stated.stiffness));
        let _ = writeln!(out, "# damping = {}  # D, {force}·s/{unit}", value(joint.stated.damping));
        let _ = writeln!(out, "# rest = {}  # q0, {unit}", value(joint.stated.rest));
    }
    for link in hand.draft.links.iter().filter(|link| !link.collisions.is_empty()) {
        let mass = link.inertial.map(|inertial| inertial.mass).unwrap_or_default();
        let _ = writeln!(
            out,
            "\n# [links.{}]  # {} kg, {} shapes",
            key(&link.name),
            number(mass),
            link.collisions.len()
        );
        out.push_str("# friction = 1.0\n# rounding = 0.0  # edge radius of boxes, m\n");
    }
    out
}

/// A line for each number, and then for each switch and number that not each part has.
fn entries(out: &mut String, mut entries: Vec<(Number, Entry)>) {
    entries.sort_by_key(|(number, entry)| {
        matches!(entry, Entry::Switch(_)) || number.unstated == Unstated::Absent
    });
    for (Number { name, .. }, entry) in entries {
        let _ = match entry {
            Entry::Number(x) => writeln!(out, "{name} = {}", number(x)),
            Entry::Switch(on) => writeln!(out, "{name} = {on}"),
        };
    }
}

fn comment(out: &mut String, lines: Vec<String>) {
    for line in lines {
        let _ = writeln!(out, "# {line}");
    }
}

/// `{ a = 1, b = -1 }`
pub(crate) fn inline(list: &[(String, f64)]) -> String {
    let entries: Vec<String> =
        list.iter().map(|(name, x)| format!("{} = {}", key(name), number(*x))).collect();
    format!("{{ {} }}", entries.join(", "))
}

fn array(list: &[f64]) -> String {
    format!("[{}]", list.iter().map(|x| number(*x)).collect::<Vec<_>>().join(", "))
}

/// A TOML key: bare if it can be.
pub(crate) fn key(name: &str) -> String {
    let bare = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if bare { name.to_owned() } else { quoted(name) }
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.replace(['\n', '\r'], " ")).to_string()
}
