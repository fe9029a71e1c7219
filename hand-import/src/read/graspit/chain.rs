//! A chain of joints and links, from the palm outwards.

use std::collections::BTreeMap;

use palmares_models::hand::CoordinateSettings;
use palmares_models::{Pose, Rotation, Vec3};
use roxmltree::Node;

use super::body::body;
use super::transform::transform;
use super::units::{FORCE, MM, TORQUE};
use crate::decision::At;
use crate::draft::{Draft, Joint, JointKind, Link, Origin};
use crate::read::reading::Reading;
use crate::xml::{Element, child, child_text, children};

/// Stiffness of a spring in N·mm/rad, N·m/rad; of one in N/mm, N/m.
const SPRING: (f64, f64) = (1e-3, 1e3);

/// A joint that a degree of freedom moves, by `factor` times its value.
pub(super) struct Moved {
    pub(super) joint: String,
    pub(super) factor: f64,
    /// Number of its chain.
    pub(super) chain: usize,
    /// Its axis in the palm's frame, where all coordinates are 0.
    pub(super) axis: Vec3,
}

/// A joint of a chain.
struct ChainJoint {
    name: String,
    /// Before the motion by its coordinate.
    turned: Pose,
    /// After it.
    moved: Pose,
    slides: bool,
    stated: CoordinateSettings,
    limits: Option<[f64; 2]>,
    dof: Option<(usize, f64)>,
}

/// Reads a chain, and lists the joints of each degree of freedom. `frames` gets GraspIt!'s frame of each link in the draft's.
pub(super) fn chain(
    node: Node<'_, '_>,
    k: usize,
    moved_by: &mut [Vec<Moved>],
    frames: &mut BTreeMap<String, Pose>,
    draft: &mut Draft,
    reading: &mut Reading<'_>,
) {
    let element = format!("chain {k}");
    let base = child(node, "transform").map(|node| transform(node, &element, &At::Hand, &mut reading.log));
    // The frame of the next joint, in the last link's frame and in the palm's.
    let mut at = base.unwrap_or(Pose::IDENTITY);
    let mut in_palm = Pose::IDENTITY;
    let joints: Vec<ChainJoint> = children(node, "joint")
        .enumerate()
        .map(|(j, node)| joint(node, format!("chain{k}_joint{j}"), reading))
        .collect();
    let count_of = |link: Node<'_, '_>| match link.attribute("dynamicJointType").map(str::trim) {
        Some("Ball") => 3,
        Some("Universal") => 2,
        Some("Fixed") => 0,
        _ => 1,
    };
    // In some files a fixed link has a joint, which it holds at 0.
    let fixed_have_joints = children(node, "link").map(count_of).sum::<usize>() < joints.len();
    let mut joints = joints.into_iter();
    let mut parent = "palm".to_owned();
    for (l, link) in children(node, "link").enumerate() {
        let name = format!("chain{k}_link{l}");
        let kind = link.attribute("dynamicJointType").unwrap_or("Revolute").trim();
        if !["Ball", "Universal", "Fixed", "Revolute", "Prismatic"].contains(&kind) {
            let text = format!("link {l} has the unknown dynamicJointType '{kind}'; taken is Revolute");
            reading.log.problem(At::Hand, &element, text);
        }
        let count = count_of(link);
        if count == 0 {
            let held = if fixed_have_joints { joints.next() } else { None };
            let (turned, moved) =
                held.map_or((Pose::IDENTITY, Pose::IDENTITY), |joint| (joint.turned, joint.moved));
            let origin = at * turned;
            let fixed = Joint::fixed(format!("{name}_fixed"), &parent, &name);
            draft.joints.push(Joint { origin: Origin::from_pose(&origin), ..fixed });
            in_palm *= origin;
            // The link's frame is the next joint's.
            at = moved;
        }
        for i in 0..count {
            let Some(joint) = joints.next() else {
                reading.log.problem(At::Hand, &element, format!("has no joint for link {l}, of type {kind}"));
                return;
            };
            let child = if i + 1 == count { name.clone() } else { format!("{name}_part{i}") };
            if i + 1 < count {
                draft.links.push(Link { name: child.clone(), ..Link::default() });
            }
            let origin = at * joint.turned;
            in_palm *= origin;
            register(&joint, k, in_palm.rotation * Vec3::Z, moved_by, reading);
            draft.joints.push(Joint {
                kind: if joint.slides { JointKind::Prismatic } else { JointKind::Revolute },
                origin: Origin::from_pose(&origin),
                limits: joint.limits,
                stated: CoordinateSettings {
                    rest: joint.stated.rest.filter(|_| joint.stated.stiffness.is_some()),
                    ..joint.stated
                },
                ..Joint::fixed(&joint.name, &parent, &child)
            });
            parent = child;
            // The next joint is in the frame after this joint's own lengths.
            at = joint.moved;
        }
        frames.insert(name.clone(), at);
        let mut body =
            body(&name, link.text().map(str::trim).unwrap_or_default(), Origin::from_pose(&at), reading);
        collisions(link, k, &mut body, draft, reading);
        draft.links.push(body);
        parent = name;
    }
    let left = joints.count();
    if left > 0 {
        reading.log.problem(
            At::Hand,
            element,
            format!("has {left} joints without a link; they are left out"),
        );
    }
}

/// `collisionRule`: a link that nothing touches, or a pair that does not touch.
fn collisions(link: Node<'_, '_>, k: usize, body: &mut Link, draft: &mut Draft, reading: &mut Reading<'_>) {
    let (at, element) = (At::Link(body.name.clone()), format!("link '{}'", body.name));
    let other = match link.attribute("collisionRule").map(str::trim) {
        None => return,
        Some("Off") => {
            body.collisions.clear();
            reading.log.taken(at, element, "its collisionRule is Off: it touches nothing");
            return;
        }
        Some("OverlappingPair") => match link.attribute("targetChain").map(str::trim) {
            Some("base") => Some("palm".to_owned()),
            chain => {
                let chain = chain.map_or(Some(k), |chain| chain.parse().ok());
                let target = link.attribute("targetLink").and_then(|text| text.trim().parse::<usize>().ok());
                chain.zip(target).map(|(chain, link)| format!("chain{chain}_link{link}"))
            }
        },
        Some(_) => None,
    };
    match other.filter(|other| *other != body.name && draft.links.iter().any(|link| link.name == *other)) {
        Some(other) => draft.exclusions.push([other, body.name.clone()]),
        None => reading.log.problem(at, element, "its collisionRule names no link before it; it is left out"),
    }
}

/// Notes the joint at its degree of freedom.
fn register(
    joint: &ChainJoint,
    chain: usize,
    axis: Vec3,
    moved_by: &mut [Vec<Moved>],
    reading: &mut Reading<'_>,
) {
    let (at, element) = (At::Joint(joint.name.clone()), format!("joint '{}'", joint.name));
    let Some((dof, factor)) = joint.dof else {
        reading.log.taken(at, element, "has no degree of freedom");
        return;
    };
    match moved_by.get_mut(dof) {
        None => {
            let text = format!("names the degree of freedom d{dof}, which is not there");
            reading.log.problem(at, element, text);
        }
        Some(_) if factor == 0.0 => {
            reading.log.taken(at, element, format!("follows d{dof} by the factor 0: no motor moves it"));
        }
        Some(list) => list.push(Moved { joint: joint.name.clone(), factor, chain, axis }),
    }
}

fn joint(node: Node<'_, '_>, name: String, reading: &mut Reading<'_>) -> ChainJoint {
    let element = format!("joint '{name}'");
    let slides = node.attribute("type").is_some_and(|kind| kind.trim().eq_ignore_ascii_case("prismatic"));
    let unit = if slides { MM } else { 1f64.to_radians() };
    let mut e = Element { name: &element, at: At::Joint(name.clone()), log: &mut reading.log };
    let mut dof = None;
    let mut of_dof = |tag: &str, e: &mut Element<'_>| {
        let text = child_text(node, tag).unwrap_or("0");
        let Some((index, factor, constant)) = term(text) else {
            return e.number(&format!("<{tag}>"), text).unwrap_or(0.0);
        };
        dof = index.parse().ok().zip(e.number(&format!("<{tag}>"), factor));
        if constant.starts_with('-') {
            let text =
                format!("<{tag}> {text}: its constant is {constant}; GraspIt! reads only those after a '+'");
            e.log.taken(e.at.clone(), e.name, text);
        }
        let constant = constant.strip_prefix('+').unwrap_or(constant).trim();
        if constant.is_empty() { 0.0 } else { e.number(&format!("<{tag}>"), constant).unwrap_or(0.0) }
    };
    let (theta, d) = (of_dof("theta", &mut e).to_radians(), of_dof("d", &mut e) * MM);
    let mut number = |tag: &str| child_text(node, tag).and_then(|text| e.number(&format!("<{tag}>"), text));
    let (a, alpha) = (number("a").unwrap_or(0.0) * MM, number("alpha").unwrap_or(0.0).to_radians());
    let limits = number("minValue").zip(number("maxValue"));
    // Some published joints have them exchanged.
    let limits = limits.map(|(low, high)| [low.min(high) * unit, low.max(high) * unit]);
    let scale = if slides { FORCE / MM } else { TORQUE };
    let damping = number("viscousFriction").map(|x| x * scale);
    let friction = number("CoulombFriction").map(|x| x * if slides { FORCE } else { TORQUE });
    let spring = if slides { SPRING.1 } else { SPRING.0 };
    let stiffness = number("springStiffness").map(|x| x * spring).filter(|x| *x > 0.0);
    let rest = number("restValue").map(|x| x * unit);
    let about = |axis: Vec3, angle: f64| Pose::from_parts(Vec3::ZERO, Rotation::from_axis_angle(axis, angle));
    let along = |v: Vec3| Pose::from_parts(v, Rotation::IDENTITY);
    let after = along(Vec3::X * a) * about(Vec3::X, alpha);
    let (turned, moved) = if slides {
        (about(Vec3::Z, theta) * along(Vec3::Z * d), after)
    } else {
        (about(Vec3::Z, theta), along(Vec3::Z * d) * after)
    };
    let stated = CoordinateSettings { stiffness, damping, rest, friction };
    ChainJoint { name, turned, moved, slides, stated, limits, dof }
}

/// `d1*0.333+40`: a degree of freedom, its factor, a constant with its sign. `None` for a plain number.
fn term(text: &str) -> Option<(&str, &str, &str)> {
    let rest = text.strip_prefix('d')?;
    let (index, rest) = rest.split_at(rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len()));
    let rest = rest.trim_start();
    let Some(rest) = rest.strip_prefix('*').map(str::trim_start) else {
        return Some((index, "1", rest));
    };
    // The factor can have a sign of its own, and an exponent.
    let mut before = ' ';
    let end = rest.char_indices().find(|&(i, c)| {
        let ends = i > 0 && matches!(c, '+' | '-') && !matches!(before, 'e' | 'E');
        before = c;
        ends
    });
    let (factor, constant) = rest.split_at(end.map_or(rest.len(), |(i, _)| i));
    Some((index, factor, constant))
}

#[cfg(test)]
mod tests {
    use super::term;

    #[test]
    fn an_expression_has_a_factor_and_a_constant() {
        assert_eq!(term("90"), None);
        for (text, expected) in [
            ("d0", ("0", "1", "")),
            ("d12+-5.5", ("12", "1", "+-5.5")),
            ("d1-90", ("1", "1", "-90")),
            ("d1*0.25-40", ("1", "0.25", "-40")),
            ("d1*-1+40", ("1", "-1", "+40")),
            ("d1*1e-1+-4", ("1", "1e-1", "+-4")),
            ("d1 * 2", ("1", "2", "")),
            ("d", ("", "1", "")),
        ] {
            assert_eq!(term(text), Some(expected), "{text}");
        }
    }
}
