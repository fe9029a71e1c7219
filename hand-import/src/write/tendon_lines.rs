//! Lines of `hand.toml` that put a tendon over the joints of each finger, for a hand whose file states servos only: Klamp't has no tendons,
//! so hands with tendons leave them to a program beside the file.

use std::fmt::Write as _;

use palmares_models::measure::HandLimits;

use super::number;
use super::settings::{inline, key};
use crate::complete::{Complete, Finger, SPRING_LAG, STRETCH, counted};
use crate::draft::Joint;

/// The lines, if the hand has fingers of servos.
pub(crate) fn lines(hand: &Complete, fingers: &[Finger<'_>]) -> Option<String> {
    if fingers.is_empty() {
        return None;
    }
    let taken = |name: &str| {
        hand.servos.iter().any(|servo| servo.motor == name || servo.joint == name || servo.name == name)
    };
    let names: Vec<String> = (1..=fingers.len())
        .map(|k| format!("finger_{k}"))
        .map(|name| if taken(&name) { format!("{name}_tendon") } else { name })
        .collect();
    let named: Vec<(&str, &Finger<'_>)> = names.iter().map(String::as_str).zip(fingers).collect();
    Some(if is_reflex(hand, fingers) { reflex(&named) } else { to_state(&named) })
}

/// The lines as comments.
pub(crate) fn commented(lines: &str) -> String {
    lines.lines().fold(String::from("\n# Tendons\n"), |out, line| out + format!("# {line}").trim_end() + "\n")
}

/// Whether the fingers have the links of the ReFlex of the IROS 2016 manipulation challenge.
fn is_reflex(hand: &Complete, fingers: &[Finger<'_>]) -> bool {
    let links = |finger: &Finger<'_>| -> Vec<String> {
        finger.joints.iter().map(|joint| joint.child.clone()).collect()
    };
    let swivels =
        ["swivel_1", "swivel_2"].iter().all(|name| hand.draft.links.iter().any(|link| link.name == *name));
    swivels
        && fingers.len() == 3
        && (1..=3)
            .zip(fingers)
            .all(|(k, finger)| links(finger) == [format!("proximal_{k}"), format!("distal_{k}")])
}

/// The numbers of the challenge's program, `plugins/reflex.py`: R of a Da Vinci transmission, E, q0 and the way of a motor. Rocchi and Hauser,
/// "A generic simulator for underactuated compliant hands" (2016), has the law.
fn reflex(fingers: &[(&str, &Finger<'_>)]) -> String {
    // 3.6 rad of the proximal joint, from where the springs rest: R q0 = -0.34 rad.
    const TRAVEL: f64 = 3.6;
    const REST: f64 = -0.34;
    let mut out = String::from(
        "# R, E and q0 of the challenge's plugins/reflex.py. s is in rad of the proximal joint, tension in N·m.\n\
         # The real hand has weaker springs and motors: those of the built-in hand `reflex`.\n[motors]\n",
    );
    for (name, _) in fingers {
        let _ = writeln!(out, "{} = {{ scaling = {TRAVEL}, speed_limit = 1.0 }}", key(name));
    }
    out.push_str("\n[coordinates]\n");
    for (proximal, distal) in fingers.iter().map(|(_, finger)| (finger.joints[0], finger.joints[1])) {
        let _ = writeln!(out, "{} = {{ stiffness = 1.0, rest = {REST} }}", key(&proximal.name));
        let _ = writeln!(out, "{} = {{ stiffness = 2.0, rest = 0.0 }}", key(&distal.name));
    }
    for (name, finger) in fingers {
        let (name, [proximal, distal]) = (key(name), [0, 1].map(|k| key(&finger.joints[k].name)));
        let _ = writeln!(
            out,
            "\n[tendons.{name}]\nmotors = {{ {name} = 1 }}\njoints = {{ {proximal} = 1 }}\n\
             rest = {REST}         # s at sigma = 0: just taut\n\
             stiffness = 300.0    # so stiff that its stretch does not count\n\
             force_limit = 10.0   # `torquemax` of the proximal joints 1 and 2\n\
             [tendons.{name}.da_vinci]\n\
             {distal} = {{ r0 = 0.015, r1 = 0.002, r2 = 0.0, a1 = 0.04, b1 = 0.01, l1 = 0.05, a2 = 0.02, b2 = 0.0 }}"
        );
    }
    out
}

/// Lines with numbers that their author is to replace; those that stand here load.
fn to_state(fingers: &[(&str, &Finger<'_>)]) -> String {
    let limits = HandLimits::default();
    let (mut motors, mut coordinates, mut tendons) = (String::new(), String::new(), String::new());
    for (name, finger) in fingers {
        let ways: Vec<Way> = finger.joints.iter().map(|joint| Way::of(joint)).collect();
        let arms: Vec<(String, f64)> =
            finger.joints.iter().zip(&ways).map(|(joint, way)| (joint.name.clone(), way.arm)).collect();
        let at_rest: f64 = ways.iter().map(|way| way.arm * way.rest).sum();
        let travel: f64 = ways.iter().map(|way| way.travel).sum();
        let (offset, wound) = counted([at_rest, at_rest + travel]);
        let force = finger.joints[0].effort.unwrap_or(1.0).min(limits.joint_torque_nm);
        let speed = finger.joints[0].velocity.unwrap_or(1.0) / travel;
        let speed = speed.min(limits.motor_speed_per_s).min(limits.motor_power_w / (force * travel));
        let stiffness = (force / (STRETCH * travel)).min(limits.tendon_stiffness);
        let name = key(name);
        let _ = writeln!(
            motors,
            "{name} = {{ scaling = {}, offset = {}, speed_limit = {} }}   # to state: s from σ = 0 to 1; 1/s",
            short(travel),
            short(offset),
            short(speed)
        );
        for (joint, way) in finger.joints.iter().zip(&ways) {
            // Half of the largest tension bends the spring to the joint's limit.
            let spring = (0.5 * force / way.travel).min(limits.joint_stiffness_nm_rad);
            let _ = writeln!(
                coordinates,
                "{} = {{ stiffness = {}, rest = {}, damping = {} }}   # to state: E, q0, D; N·m, rad, s",
                key(&joint.name),
                short(spring),
                number(way.rest),
                short(SPRING_LAG * spring)
            );
        }
        let rest = if wound == 0.0 { String::new() } else { format!("rest = {}\n", number(wound)) };
        let _ = writeln!(
            tendons,
            "\n[tendons.{name}]\nmotors = {{ {name} = 1 }}\n{rest}joints = {}   # to state: R\n\
             stiffness = {}   # to state\nforce_limit = {}   # to state",
            inline(&arms),
            short(stiffness),
            number(force)
        );
    }
    format!(
        "# The file states no tendon: each number marked \"to state\" is a guess. With R relative to one joint, s is in rad and tension in N·m;\n\
         # with radii in m, s is in m and tension in N.\n[motors]\n{motors}\n[coordinates]\n{coordinates}{tendons}"
    )
}

/// How a joint closes, as far as its limits say it.
struct Way {
    /// 1 or −1: towards the farther limit.
    arm: f64,
    rest: f64,
    /// From the rest to the farther limit, rad.
    travel: f64,
}

impl Way {
    fn of(joint: &Joint) -> Way {
        let [low, high] = joint.limits.unwrap_or([0.0, 1.0]);
        let rest = 0.0f64.clamp(low, high);
        if high - rest >= rest - low {
            Way { arm: 1.0, rest, travel: high - rest }
        } else {
            Way { arm: -1.0, rest, travel: rest - low }
        }
    }
}

/// A guess with four digits.
fn short(x: f64) -> String {
    let digits = (3 - x.abs().log10().floor().clamp(-9.0, 9.0) as i32).max(0) as usize;
    if x == 0.0 { "0".to_owned() } else { number(format!("{x:.digits$}").parse().unwrap_or(x)) }
}
