//! `hand.toml`: motors, tendons and everything else that a URDF cannot express.

use std::fmt::Write as _;

use super::{Comments, number};
use crate::complete::{Complete, implausible_inertia};
use crate::decision::At;
use crate::draft::JointKind;

/// The text of `hand.toml`.
pub(crate) fn settings(hand: &Complete, head: &str, comments: &mut Comments<'_>) -> String {
    let draft = &hand.draft;
    let mut out = format!("# {head}\n");
    let motors: Vec<&str> = hand.motors.iter().map(|motor| motor.name.as_str()).collect();
    let kept = draft.settings.is_some();
    let here = |at: &At| kept || !matches!(at, At::Motor(name) if motors.contains(&name.as_str()));
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
    if let Some(reason) = implausible_inertia(draft) {
        let _ = writeln!(out, "# guessed: {reason}.\ninertia = \"from_geometry\"");
    }
    for motor in &hand.motors {
        out.push('\n');
        comment(&mut out, comments.at(&At::Motor(motor.name.clone())));
        let _ = writeln!(out, "[motors.{}]", key(&motor.name));
        let _ = writeln!(out, "scaling = {}", number(motor.scaling));
        if motor.offset != 0.0 {
            let _ = writeln!(out, "offset = {}", number(motor.offset));
        }
        let _ = writeln!(out, "speed_limit = {}", number(motor.speed_limit));
    }
    for tendon in &hand.tendons {
        let _ = writeln!(out, "\n[tendons.{}]", key(&tendon.name));
        let _ = writeln!(out, "stiffness = {}", number(tendon.stiffness));
        if tendon.damping != 0.0 {
            let _ = writeln!(out, "damping = {}", number(tendon.damping));
        }
        let _ = writeln!(out, "force_limit = {}", number(tendon.force_limit));
        if tendon.both_ways {
            out.push_str("both_ways = true\n");
        }
    }
    // Springs of joints in a transmission are there.
    let in_tendon = |name: &str| hand.tendons.iter().any(|t| t.arms.iter().any(|(joint, _)| joint == name));
    let sprung = |joint: &&crate::draft::Joint| joint.kind != JointKind::Fixed && !in_tendon(&joint.name);
    for joint in draft.joints.iter().filter(sprung) {
        let Some(stiffness) = joint.stiffness else { continue };
        let _ = writeln!(out, "\n[coordinates.{}]", key(&joint.name));
        let _ = writeln!(out, "stiffness = {}", number(stiffness));
        if let Some(rest) = joint.rest {
            let _ = writeln!(out, "rest = {}", number(rest));
        }
    }
    for link in &draft.links {
        if let Some(friction) = link.friction {
            let _ = writeln!(out, "\n[links.{}]\nfriction = {}", key(&link.name), number(friction));
        }
    }
    out
}

fn comment(out: &mut String, lines: Vec<String>) {
    for line in lines {
        let _ = writeln!(out, "# {line}");
    }
}

/// A TOML key: bare if it can be.
fn key(name: &str) -> String {
    let bare = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if bare { name.to_owned() } else { quoted(name) }
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.replace(['\n', '\r'], " ")).to_string()
}
