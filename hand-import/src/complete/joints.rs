//! Joints as a hand has them: hinges and slides, linear couplings, limits that leave room.

use std::collections::BTreeMap;

use palmares_models::hand::CoordinateSettings;

use super::followers::{Follows, length, relocate, shorten};
use crate::decision::{At, Log};
use crate::draft::{Coupling, Draft, Drive, Inertial, Joint, JointKind, Link, Origin, TendonPath, Tie};

/// Largest error of a line for a coupling that is a curve, rad or m.
const CURVED: f64 = 0.005;
/// A range smaller than this is none, rad or m.
const SMALLEST_RANGE: f64 = 1e-6;
/// Part of the leader's range below which a follower's limits contradict it.
const SMALLEST_PART: f64 = 0.05;
/// A larger range is a stand-in for none, rad or m: no finger turns 16 times.
const ENDLESS: f64 = 100.0;
/// Limits of a revolute joint that states none, rad.
const WIDE: f64 = std::f64::consts::PI;
/// Mass of a link between the hinges of a ball joint, kg, and its inertia, kg·m²: a ball of 5 mm radius.
const COUPLER: (f64, f64) = (1e-3, 1e-8);

/// Completes all joints.
pub(crate) fn complete(draft: &mut Draft, log: &mut Log) {
    split_balls(draft, log);
    couplings(draft, log);
    virtual_leaders(draft, log);
    limits(draft, log);
    follower_limits(draft, log);
}

/// A ball joint becomes three hinges about x, y and z, with light links between them.
fn split_balls(draft: &mut Draft, log: &mut Log) {
    let mut joints = Vec::new();
    for joint in std::mem::take(&mut draft.joints) {
        if joint.kind != JointKind::Ball {
            joints.push(joint);
            continue;
        }
        let text = "is a ball joint; taken are three hinges about x, y and z, with links of 1 g between them";
        log.guessed(At::Joint(format!("{}_x", joint.name)), format!("joint '{}'", joint.name), text);
        let axes = [("x", [1.0, 0.0, 0.0]), ("y", [0.0, 1.0, 0.0]), ("z", [0.0, 0.0, 1.0])];
        let mut parent = joint.parent.clone();
        for (k, (suffix, axis)) in axes.into_iter().enumerate() {
            let child = if k == 2 { joint.child.clone() } else { format!("{}_{suffix}_part", joint.name) };
            if k < 2 {
                let (mass, i) = COUPLER;
                let inertial = Inertial { mass, inertia: [i, 0.0, 0.0, i, 0.0, i], ..Inertial::default() };
                draft.links.push(Link { name: child.clone(), inertial: Some(inertial), ..Link::default() });
            }
            joints.push(Joint {
                name: format!("{}_{suffix}", joint.name),
                kind: JointKind::Revolute,
                parent: std::mem::replace(&mut parent, child.clone()),
                child,
                origin: if k == 0 { joint.origin } else { Origin::default() },
                axis,
                // A ball joint's limit is that of the angle from its zero.
                limits: joint.limits.map(|[_, most]| [-most, most]),
                stated: CoordinateSettings { rest: joint.stated.rest.map(|_| 0.0), ..joint.stated },
                ..joint.clone()
            });
        }
    }
    draft.joints = joints;
}

fn couplings(draft: &mut Draft, log: &mut Log) {
    let mut kept: Vec<Coupling> = Vec::new();
    for coupling in std::mem::take(&mut draft.couplings) {
        let (at, element) = (At::Joint(coupling.joint.clone()), format!("joint '{}'", coupling.joint));
        let kind = |name: &str| draft.joints.iter().find(|joint| joint.name == name).map(|joint| joint.kind);
        let leader = &coupling.leader;
        if kept.iter().any(|other| other.joint == coupling.joint) {
            log.problem(
                at,
                element,
                format!("follows a second joint, '{leader}'; only the first one counts"),
            );
            continue;
        }
        if kind(&coupling.joint).is_none() || *leader == coupling.joint {
            log.problem(at, element, format!("follows '{leader}', but is no joint that can; left out"));
            continue;
        }
        let Some(of_leader) = kind(leader) else {
            log.problem(at, element, format!("follows '{leader}', which is not there; it moves by itself"));
            continue;
        };
        if kind(&coupling.joint) == Some(JointKind::Fixed) {
            log.dropped(at, element, format!("is fixed; that it follows '{leader}' has no effect"));
            continue;
        }
        let coefficients = &coupling.coefficients;
        let constant = coefficients.first().copied().unwrap_or_default();
        let slope = coefficients.get(1).copied().unwrap_or_default();
        let curved = coefficients.iter().skip(2).any(|c| *c != 0.0);
        if of_leader == JointKind::Fixed || (slope == 0.0 && !curved) {
            let text = format!("follows '{leader}' by the factor 0; taken is a fixed joint at {constant}");
            log.taken(at, element, text);
            fix(draft, &coupling.joint, constant);
            continue;
        }
        if curved {
            let range = range_of(draft, leader);
            let (line, off) = linear_fit(coefficients, range, range_of(draft, &coupling.joint));
            let joints = || draft.joints.iter().filter(|joint| !draft.moves_nothing(joint));
            let moves = |name: &str| joints().any(|joint| joint.name == name);
            if off > CURVED && draft.settings.is_none() && moves(leader) && moves(&coupling.joint) {
                let text = format!(
                    "follows '{leader}' by the polynomial {coefficients:?}, no line: a stiff tendon that pulls both ways keeps it there"
                );
                log.taken(at, element, text);
                let name = format!("{}_curve", coupling.joint);
                let turns = kind(&coupling.joint) != Some(JointKind::Prismatic);
                let path = TendonPath::Polynomial(
                    std::iter::once(0.0).chain(coefficients[1..].iter().map(|c| -c)).collect(),
                );
                let joints = vec![(coupling.joint.clone(), TendonPath::Arm(1.0)), (leader.clone(), path)];
                draft.tendons.push(Tie { turns, rest: constant }.tendon(&name, joints));
                continue;
            }
            let text = format!(
                "follows '{leader}' by the polynomial {coefficients:?}; taken is the line {line:?}, off by at most {off:.4} over the \
                 leader's range"
            );
            log.guessed(at, element, text);
            kept.push(Coupling { coefficients: line.to_vec(), ..coupling });
            continue;
        }
        kept.push(Coupling { coefficients: vec![constant, slope], ..coupling });
    }
    // A follower of a follower is linear in the first leader; circles have none.
    let by_joint: BTreeMap<&str, &str> = kept.iter().map(|c| (c.joint.as_str(), c.leader.as_str())).collect();
    let circular = |joint: &str| {
        let mut at = joint;
        for _ in 0..=by_joint.len() {
            match by_joint.get(at) {
                Some(next) => at = next,
                None => return false,
            }
        }
        true
    };
    let circles: Vec<String> = kept.iter().map(|c| c.joint.clone()).filter(|joint| circular(joint)).collect();
    for joint in circles {
        let text = "follows itself through other joints; it moves by itself";
        log.problem(At::Joint(joint.clone()), format!("joint '{joint}'"), text);
        kept.retain(|coupling| coupling.joint != joint);
    }
    draft.couplings = kept;
}

/// A joint that moves no shape itself, but that others follow, is a stand-in for a motor: its first follower leads instead.
fn virtual_leaders(draft: &mut Draft, log: &mut Log) {
    let leaders: Vec<String> = draft.couplings.iter().map(|coupling| coupling.leader.clone()).collect();
    for name in leaders {
        let Some(old) = draft.joints.iter().find(|joint| joint.name == name).cloned() else { continue };
        let follows = draft.couplings.iter().any(|coupling| coupling.joint == name);
        if old.kind == JointKind::Fixed || follows || !draft.moves_nothing(&old) {
            continue;
        }
        let Some(first) = draft.couplings.iter().position(|coupling| coupling.leader == name) else {
            continue;
        };
        let first = draft.couplings.remove(first);
        let (constant, slope) = (first.coefficients[0], first.coefficients[1]);
        let mut others = 0;
        for coupling in draft.couplings.iter_mut().filter(|coupling| coupling.leader == name) {
            // x_old = (x_first − constant) / slope.
            let factor = coupling.coefficients[1] / slope;
            coupling.coefficients = vec![coupling.coefficients[0] - factor * constant, factor];
            coupling.leader.clone_from(&first.joint);
            others += 1;
        }
        if let (Some([low, high]), Some(joint)) =
            (old.limits, draft.joints.iter_mut().find(|joint| joint.name == first.joint))
        {
            let (a, b) = (constant + slope * low, constant + slope * high);
            let image = [a.min(b), a.max(b)];
            joint.limits = match joint.limits {
                Some([low, high]) if low.max(image[0]) < high.min(image[1]) => {
                    Some([low.max(image[0]), high.min(image[1])])
                }
                _ => Some(image),
            };
            joint.effort = joint.effort.or(old.effort.map(|effort| effort / slope.abs()));
            joint.velocity = joint.velocity.or(old.velocity.map(|velocity| velocity * slope.abs()));
        }
        // A motor of its own would be a second one.
        if draft.actuators.iter().any(|actuator| actuator.drive == Drive::Joint(name.clone())) {
            draft.actuators.retain(|actuator| actuator.drive != Drive::Joint(first.joint.clone()));
        }
        let inverse = Follows { ratio: 1.0 / slope, offset: -constant / slope };
        relocate(draft, (&name, &first.joint, inverse), log);
        let text = format!(
            "moves no shape, but {} joints follow it; '{}' leads the {others} others instead",
            others + 1,
            first.joint
        );
        log.taken(At::Joint(name.clone()), format!("joint '{name}'"), text);
        fix(draft, &name, 0.0);
    }
}

/// Fixes joints that move no shape and carry none, as the loader does, and takes them out of whatever names them. Only after the
/// meshes were read it is known which these are.
pub(crate) fn idle(draft: &mut Draft, log: &mut Log) {
    if draft.settings.is_some() {
        return;
    }
    virtual_leaders(draft, log);
    let moves = |joint: &&Joint| joint.kind != JointKind::Fixed && draft.moves_nothing(joint);
    let names: Vec<String> = draft.joints.iter().filter(moves).map(|joint| joint.name.clone()).collect();
    for name in &names {
        let joint = draft.joints.iter().find(|joint| joint.name == *name);
        let start = joint.and_then(|joint| joint.limits).map_or(0.0, |[low, high]| 0f64.clamp(low, high));
        // As the second synergy of a hand whose description has only the first one.
        let driven = draft.actuators.iter().any(|actuator| actuator.drive == Drive::Joint(name.clone()));
        let text = if driven {
            "moves no shape and carries none; it is fixed. If its motor moves other joints in the real hand, state the \
             motor and a tendon over them in hand.toml"
        } else {
            "moves no shape and carries none; it is fixed"
        };
        log.dropped(At::Joint(name.clone()), format!("joint '{name}'"), text);
        fix(draft, name, start);
    }
    let idle = |name: &String| names.contains(name);
    draft.couplings.retain(|coupling| !idle(&coupling.joint));
    draft.start.joints.retain(|(joint, _)| !idle(joint));
    for tendon in &mut draft.tendons {
        tendon.joints.retain(|(joint, _)| !idle(joint));
    }
    draft.tendons.retain(|tendon| {
        if tendon.joints.is_empty() {
            log.dropped(At::Hand, format!("tendon '{}'", tendon.name), "passes no joint that moves a shape");
        }
        !tendon.joints.is_empty()
    });
    for spring in &mut draft.springs {
        spring.joints.retain(|(joint, _)| !idle(joint));
    }
    draft.springs.retain(|spring| !spring.joints.is_empty());
}

/// The line with the least squared error over a range among those within the follower's limits, and its largest error.
fn linear_fit(coefficients: &[f64], [low, high]: [f64; 2], limits: [f64; 2]) -> ([f64; 2], f64) {
    const POINTS: usize = 101;
    if low == high {
        return ([coefficients[0], coefficients.get(1).copied().unwrap_or_default()], 0.0);
    }
    let value = |x: f64| coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c);
    // The part of the range from its lower end.
    let part = |k: usize| k as f64 / (POINTS - 1) as f64;
    let at = |k: usize| value(low + (high - low) * part(k));
    // Normal equations in the values at both ends.
    let (mut aa, mut ab, mut bb, mut ay, mut by) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for k in 0..POINTS {
        let (a, b, y) = (1.0 - part(k), part(k), at(k));
        (aa, ab, bb, ay, by) = (aa + a * a, ab + a * b, bb + b * b, ay + a * y, by + b * y);
    }
    let clamped = |x: f64| x.clamp(limits[0], limits[1]);
    let determinant = aa * bb - ab * ab;
    let (mut from, mut to) = ((ay * bb - by * ab) / determinant, (by * aa - ay * ab) / determinant);
    if clamped(from) != from || clamped(to) != to {
        let sum = |from: f64, to: f64| {
            (0..POINTS).map(|k| (from + (to - from) * part(k) - at(k)).powi(2)).sum::<f64>()
        };
        // The least value is at a limit of one end, with the other free within its own.
        let edges = limits.into_iter().flat_map(|edge| {
            [(edge, clamped((by - ab * edge) / bb)), (clamped((ay - ab * edge) / aa), edge)]
        });
        let best = edges.min_by(|a, b| sum(a.0, a.1).total_cmp(&sum(b.0, b.1)));
        (from, to) = best.unwrap_or((from, to));
    }
    let off = (0..POINTS).map(|k| (from + (to - from) * part(k) - at(k)).abs()).fold(0.0, f64::max);
    let slope = (to - from) / (high - low);
    ([from - slope * low, slope], off)
}

fn range_of(draft: &Draft, joint: &str) -> [f64; 2] {
    let found = draft.joints.iter().find(|other| other.name == joint);
    found.and_then(|joint| joint.limits).unwrap_or([-WIDE, WIDE])
}

/// Replaces a joint by a fixed one at a coordinate. Tendons and springs over it keep the length that it takes up there.
fn fix(draft: &mut Draft, name: &str, coordinate: f64) {
    use palmares_models::{Pose, Rotation, Vec3};
    for index in 0..draft.tendons.len() {
        let joints = &mut draft.tendons[index].joints;
        if let Some(at) = joints.iter().position(|(joint, _)| joint == name) {
            let (_, path) = joints.remove(at);
            shorten(draft, index, length(&path, coordinate));
        }
    }
    for spring in &mut draft.springs {
        if let Some(at) = spring.joints.iter().position(|(joint, _)| joint == name) {
            spring.numbers.rest -= spring.joints.remove(at).1 * coordinate;
        }
    }
    draft.springs.retain(|spring| !spring.joints.is_empty());
    let Some(joint) = draft.joints.iter_mut().find(|joint| joint.name == name) else { return };
    let axis = Vec3::from_array(joint.axis).normalize_or_zero();
    if coordinate != 0.0 {
        let moved = if joint.kind == JointKind::Prismatic {
            Pose::from_parts(axis * coordinate, Rotation::IDENTITY)
        } else {
            Pose::from_parts(Vec3::ZERO, Rotation::from_axis_angle(axis, coordinate))
        };
        joint.origin = Origin::from_pose(&(joint.origin.pose() * moved));
    }
    *joint = Joint { origin: joint.origin, ..Joint::fixed(name, joint.parent.clone(), joint.child.clone()) };
}

fn limits(draft: &mut Draft, log: &mut Log) {
    let mut fixed = Vec::new();
    for joint in &mut draft.joints {
        let (at, element) = (At::Joint(joint.name.clone()), format!("joint '{}'", joint.name));
        if joint.axis.iter().all(|x| x.abs() < 1e-9) && joint.kind != JointKind::Fixed {
            log.problem(at.clone(), &element, "has the axis 0 0 0; taken is 1 0 0");
            joint.axis = [1.0, 0.0, 0.0];
        }
        let wide = match joint.kind {
            JointKind::Fixed | JointKind::Continuous | JointKind::Ball => continue,
            JointKind::Revolute => WIDE,
            JointKind::Prismatic => 0.1,
        };
        match joint.limits {
            None => {
                let unit = if joint.kind == JointKind::Prismatic { "m" } else { "rad" };
                joint.limits = Some([-wide, wide]);
                log.guessed(at, element, format!("has no limits; taken are ±{wide:.4} {unit}"));
            }
            Some([low, high]) if (high - low).abs() < SMALLEST_RANGE => {
                if draft.couplings.iter().any(|c| c.joint == joint.name) {
                    joint.limits = None;
                    log.guessed(
                        at,
                        element,
                        format!("has limits {low} to {high}; those of its leader are taken"),
                    );
                } else {
                    log.taken(
                        at,
                        element,
                        format!("has limits {low} to {high}; taken is a fixed joint there"),
                    );
                    fixed.push((joint.name.clone(), low));
                }
            }
            Some([low, high]) if (high - low).abs() > ENDLESS => {
                let text = format!("has limits {low} to {high}: a stand-in for none");
                if joint.kind == JointKind::Prismatic {
                    joint.limits = Some([-wide, wide]);
                    log.guessed(at, element, format!("{text}; taken are ±{wide:.4} m"));
                } else {
                    (joint.kind, joint.limits) = (JointKind::Continuous, None);
                    log.guessed(at, element, format!("{text}; it turns without limits"));
                }
            }
            Some([low, high]) if low > high => {
                joint.limits = Some([high, low]);
                log.problem(
                    at,
                    element,
                    format!("has limits {low} to {high}, lower above upper; they are exchanged"),
                );
            }
            Some(_) => {}
        }
    }
    for (name, coordinate) in fixed {
        fix(draft, &name, coordinate);
        draft.couplings.retain(|coupling| coupling.joint != name);
        for coupling in &mut draft.couplings {
            if coupling.leader == name {
                let text = format!("follows '{name}', which does not move; taken is a fixed joint");
                log.taken(At::Joint(coupling.joint.clone()), format!("joint '{}'", coupling.joint), text);
            }
        }
    }
    let still: Vec<String> =
        draft.joints.iter().filter(|j| j.kind == JointKind::Fixed).map(|j| j.name.clone()).collect();
    let stuck: Vec<Coupling> =
        draft.couplings.iter().filter(|coupling| still.contains(&coupling.leader)).cloned().collect();
    for coupling in stuck {
        let constant = coupling.coefficients[0];
        fix(draft, &coupling.joint, constant);
        draft.couplings.retain(|other| other.joint != coupling.joint);
    }
}

/// The limits of a follower count for its leader too. Where they leave the leader no room, they contradict each other.
fn follower_limits(draft: &mut Draft, log: &mut Log) {
    // Leaders before their followers, however they are listed.
    for _ in 0..draft.couplings.len().max(1) {
        let mut changed = false;
        for coupling in &draft.couplings {
            let (constant, slope) = (coupling.coefficients[0], coupling.coefficients[1]);
            let leader = draft.joints.iter().find(|joint| joint.name == coupling.leader);
            let Some([low, high]) = leader.and_then(|joint| joint.limits) else { continue };
            let image = [constant + slope * low, constant + slope * high];
            let image = [image[0].min(image[1]), image[0].max(image[1])];
            let Some(joint) = draft.joints.iter_mut().find(|joint| joint.name == coupling.joint) else {
                continue;
            };
            if joint.kind == JointKind::Continuous {
                continue;
            }
            let text = match joint.limits {
                Some([a, b]) => {
                    let common = b.min(image[1]) - a.max(image[0]);
                    if common >= SMALLEST_PART * (image[1] - image[0]) {
                        continue;
                    }
                    format!(
                        "has limits {a} to {b}, but follows '{}' to {:.6} to {:.6}; its own limits are replaced by these",
                        coupling.leader, image[0], image[1]
                    )
                }
                None => format!("takes the limits that '{}' gives it", coupling.leader),
            };
            let kind = joint.limits.is_some();
            joint.limits = Some(image);
            changed = true;
            let (at, element) = (At::Joint(joint.name.clone()), format!("joint '{}'", joint.name));
            if kind {
                log.problem(at, element, text);
            } else {
                log.taken(at, element, text);
            }
        }
        if !changed {
            break;
        }
    }
}
