//! GraspIt!'s robot XML: chains of Denavit-Hartenberg joints on a palm, in mm, degrees and grams.
//!
//! A joint turns by `k · dN + constant`: dN is the N-th degree of freedom, a motor. GraspIt! has forces in g·mm/s², so that
//! 1 N·m is 1e9 of its units.

use palmares_models::{Pose, Rotation, Vec3};
use roxmltree::Node;

use super::reading::Reading;
use super::xml::{Element, child, child_text, children};
use crate::decision::At;
use crate::draft::{
    Actuator, Control, Coupling, Draft, Drive, Geometry, Inertial, Joint, JointKind, Link, Origin, Part,
};
use crate::error::ImportError;

/// m
const MM: f64 = 1e-3;
/// kg
const GRAM: f64 = 1e-3;
/// N·m in GraspIt!'s unit of torque, g·mm²/s².
const TORQUE: f64 = 1e-9;
/// N in GraspIt!'s unit of force, g·mm/s².
const FORCE: f64 = 1e-6;

/// Reads a robot.
pub(crate) fn read(text: &str, reading: &mut Reading<'_>) -> Result<Draft, ImportError> {
    let document = reading.xml(text)?;
    let robot = document.root_element();
    let stem = reading.path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let mut draft = Draft { name: stem, ..Draft::default() };
    reading.log.taken(
        At::Hand,
        "robot",
        "lengths in mm, angles in degrees, masses in g, torques in g·mm²/s²",
    );
    let palm = child_text(robot, "palm").unwrap_or_default();
    draft.links.push(body("palm", palm, Origin::default(), reading));
    let dofs: Vec<Node<'_, '_>> = children(robot, "dof").collect();
    let mut leaders: Vec<Option<(String, f64, f64)>> = vec![None; dofs.len()];
    for (k, node) in children(robot, "chain").enumerate() {
        chain(node, k, &mut leaders, &mut draft, reading);
    }
    for (d, (node, leader)) in dofs.iter().zip(&leaders).enumerate() {
        motor(*node, d, leader.as_ref(), &mut draft, reading);
    }
    let silent = ["palm", "dof", "chain", "name", "collisionRule"];
    for other in robot.children().filter(Node::is_element) {
        let tag = other.tag_name().name();
        if !silent.contains(&tag) {
            let text = match tag {
                "eigenGrasps" => "are directions of GraspIt!'s search, no motors; they are left out",
                "virtualContacts" => "are for GraspIt!'s grasp quality",
                _ => "is for GraspIt! only",
            };
            reading.log.dropped(At::Hand, format!("<{tag}>"), text);
        }
    }
    Ok(draft)
}

/// A joint of a chain.
struct ChainJoint {
    name: String,
    /// Before the rotation by its coordinate.
    turned: Pose,
    /// After it.
    moved: Pose,
    slides: bool,
    damping: Option<f64>,
    stiffness: Option<f64>,
    limits: Option<[f64; 2]>,
    dof: Option<(usize, f64)>,
}

fn chain(
    node: Node<'_, '_>,
    k: usize,
    leaders: &mut [Option<(String, f64, f64)>],
    draft: &mut Draft,
    reading: &mut Reading<'_>,
) {
    let element = format!("chain {k}");
    let mut at =
        child(node, "transform").map(|node| transform(node, &element, reading)).unwrap_or(Pose::IDENTITY);
    let joints: Vec<ChainJoint> = children(node, "joint")
        .enumerate()
        .map(|(j, node)| joint(node, format!("chain{k}_joint{j}"), reading))
        .collect();
    let mut joints = joints.into_iter();
    let mut parent = "palm".to_owned();
    for (l, link) in children(node, "link").enumerate() {
        let name = format!("chain{k}_link{l}");
        let kind = link.attribute("dynamicJointType").unwrap_or("Revolute");
        let count = match kind.to_lowercase().as_str() {
            "ball" => 3,
            "universal" => 2,
            "fixed" => 0,
            _ => 1,
        };
        let mut moved = Pose::IDENTITY;
        let file = link.text().map(str::trim).unwrap_or_default();
        if count == 0 {
            let fixed = Joint::fixed(format!("{name}_fixed"), &parent, &name);
            draft.joints.push(Joint { origin: Origin::from_pose(&at), ..fixed });
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
            couple(&joint, leaders, draft, reading);
            draft.joints.push(Joint {
                kind: if joint.slides { JointKind::Prismatic } else { JointKind::Revolute },
                origin: Origin::from_pose(&(at * joint.turned)),
                limits: joint.limits,
                damping: joint.damping,
                stiffness: joint.stiffness,
                ..Joint::fixed(&joint.name, &parent, &child)
            });
            parent = child;
            // The next joint is in the frame after this joint's own lengths.
            at = joint.moved;
            moved = joint.moved;
        }
        draft.links.push(body(&name, file, Origin::from_pose(&moved), reading));
        parent = name;
    }
}

/// The first joint of a degree of freedom carries its motor; the others follow it.
fn couple(
    joint: &ChainJoint,
    leaders: &mut [Option<(String, f64, f64)>],
    draft: &mut Draft,
    reading: &mut Reading<'_>,
) {
    let Some((dof, factor)) = joint.dof else {
        reading.log.taken(
            At::Joint(joint.name.clone()),
            format!("joint '{}'", joint.name),
            "has no degree of freedom",
        );
        return;
    };
    match leaders.get_mut(dof) {
        None => {
            let text = format!("names the degree of freedom d{dof}, which is not there");
            reading.log.problem(At::Joint(joint.name.clone()), format!("joint '{}'", joint.name), text);
        }
        Some(leader @ None) => *leader = Some((joint.name.clone(), factor, 0.0)),
        Some(Some((leader, leading, _))) => {
            let coefficients = vec![0.0, factor / *leading];
            draft.couplings.push(Coupling {
                joint: joint.name.clone(),
                leader: leader.clone(),
                coefficients,
            });
        }
    }
}

fn joint(node: Node<'_, '_>, name: String, reading: &mut Reading<'_>) -> ChainJoint {
    let element = format!("joint '{name}'");
    let slides = node.attribute("type").is_some_and(|kind| kind.eq_ignore_ascii_case("prismatic"));
    let unit = if slides { MM } else { 1f64.to_radians() };
    let mut e = Element { name: &element, at: At::Joint(name.clone()), log: &mut reading.log };
    let mut dof = None;
    // `d1*0.333+40`: a degree of freedom, its factor, a constant.
    let mut term = |tag: &str, e: &mut Element<'_>| {
        let text = child_text(node, tag).unwrap_or("0");
        let Some(rest) = text.strip_prefix('d') else {
            return e.number(&format!("<{tag}>"), text).unwrap_or(0.0);
        };
        let digits = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
        let (index, rest) = rest.split_at(digits);
        let rest = rest.trim();
        let (factor, constant) = match rest.strip_prefix('*') {
            Some(rest) => {
                let end = rest.get(1..).and_then(|tail| tail.find(['+', '-'])).map_or(rest.len(), |i| i + 1);
                rest.split_at(end)
            }
            None => ("1", rest),
        };
        let factor = e.number(&format!("<{tag}>"), factor).unwrap_or(1.0);
        dof = index.parse().ok().map(|index: usize| (index, factor));
        // `+-5` occurs.
        let constant = constant.trim_start_matches('+');
        if constant.is_empty() { 0.0 } else { e.number(&format!("<{tag}>"), constant).unwrap_or(0.0) }
    };
    let (theta, d) = (term("theta", &mut e).to_radians(), term("d", &mut e) * MM);
    let mut number = |tag: &str| child_text(node, tag).and_then(|text| e.number(&format!("<{tag}>"), text));
    let (a, alpha) = (number("a").unwrap_or(0.0) * MM, number("alpha").unwrap_or(0.0).to_radians());
    let limits = number("minValue").zip(number("maxValue")).map(|(low, high)| [low * unit, high * unit]);
    let scale = if slides { FORCE / MM } else { TORQUE };
    let damping = number("viscousFriction").map(|x| x * scale);
    let stiffness = number("springStiffness").map(|x| x * scale).filter(|x| *x > 0.0);
    if number("Coulomb").is_some_and(|x| x != 0.0) {
        e.log.dropped(e.at.clone(), &element, "dry friction <Coulomb> is not modelled");
    }
    let about = |axis: Vec3, angle: f64| Pose::from_parts(Vec3::ZERO, Rotation::from_axis_angle(axis, angle));
    let along = |v: Vec3| Pose::from_parts(v, Rotation::IDENTITY);
    let rest = along(Vec3::X * a) * about(Vec3::X, alpha);
    let (turned, moved) = if slides {
        (about(Vec3::Z, theta) * along(Vec3::Z * d), rest)
    } else {
        (about(Vec3::Z, theta), along(Vec3::Z * d) * rest)
    };
    ChainJoint { name, turned, moved, slides, damping, stiffness, limits, dof }
}

/// `<translation>` in mm, then `<rotation>` about an axis in degrees, in order.
fn transform(node: Node<'_, '_>, element: &str, reading: &mut Reading<'_>) -> Pose {
    let mut pose = Pose::IDENTITY;
    for part in node.children().filter(Node::is_element) {
        let text = part.text().unwrap_or_default().trim();
        let mut e = Element { name: element, at: At::Hand, log: &mut reading.log };
        match part.tag_name().name() {
            "translation" => {
                let Some(xyz) = e.list::<3>("<translation>", text) else { continue };
                pose *= Pose::from_parts(Vec3::from_array(xyz) * MM, Rotation::IDENTITY);
            }
            "rotation" => {
                let (angle, axis) = text.split_once(char::is_whitespace).unwrap_or((text, "z"));
                let axis = match axis.trim() {
                    "x" => Vec3::X,
                    "y" => Vec3::Y,
                    _ => Vec3::Z,
                };
                let angle = e.number("<rotation>", angle).unwrap_or(0.0).to_radians();
                pose *= Pose::from_parts(Vec3::ZERO, Rotation::from_axis_angle(axis, angle));
            }
            other => e.log.problem(At::Hand, element, format!("<{other}> in a <transform> is not read")),
        }
    }
    pose
}

/// A link by the file of its body, in `iv/` beside the robot. `shapes` is the file's frame in the link's.
fn body(name: &str, file: &str, shapes: Origin, reading: &mut Reading<'_>) -> Link {
    let (at, element) = (At::Link(name.to_owned()), format!("link '{name}'"));
    let mut link = Link { name: name.to_owned(), ..Link::default() };
    let found = reading.source.resolve(&reading.path, &format!("iv/{file}"));
    let found = found.or_else(|_| reading.source.resolve(&reading.path, file));
    let text = found.and_then(|found| {
        let text = reading.source.text(&found.path, &element).map_err(|error| error.to_string())?;
        Ok((found.path, text))
    });
    let (path, text) = match text {
        Ok(read) => read,
        Err(problem) => {
            reading.log.problem(at, element, format!("its body {problem}"));
            return link;
        }
    };
    let mut inner = reading.of(&path);
    let document = match inner.xml(&text) {
        Ok(document) => document,
        Err(error) => {
            reading.log.problem(at, element, error.to_string());
            return link;
        }
    };
    let root = document.root_element();
    let mut e = Element { name: &element, at: at.clone(), log: &mut inner.log };
    let mass = child_text(root, "mass").and_then(|text| e.number("<mass>", text)).map(|g| g * GRAM);
    let cog = child_text(root, "cog").and_then(|text| e.list::<3>("<cog>", text)).unwrap_or_default();
    let matrix = child_text(root, "inertia_matrix").and_then(|text| e.list::<9>("<inertia_matrix>", text));
    if let Some(mass) = mass {
        // GraspIt! divides the matrix by the mass: mm².
        let i = matrix.map(|m| [m[0], m[1], m[2], m[4], m[5], m[8]].map(|x| x * MM * MM * mass));
        let place = shapes.pose() * Pose::from_parts(Vec3::from_array(cog) * MM, Rotation::IDENTITY);
        link.inertial =
            Some(Inertial { origin: Origin::from_pose(&place), mass, inertia: i.unwrap_or_default() });
    }
    match child_text(root, "geometryFile") {
        Some(file) => {
            if let Some(mesh) = inner.mesh(file, [MM; 3], at.clone(), &element, false) {
                let part = Part { origin: shapes, geometry: Geometry::Mesh(mesh) };
                link.visuals.push(part.clone());
                link.collisions.push(part);
            }
        }
        None => inner.log.taken(at.clone(), &element, "its body names no geometryFile"),
    }
    if let Some(material) = child_text(root, "material") {
        let friction = match material {
            "rubber" => Some(1.0),
            "wood" => Some(0.4),
            "plastic" => Some(0.3),
            "metal" => Some(0.2),
            _ => None,
        };
        if let Some(friction) = friction {
            link.friction = Some(friction);
            inner.log.guessed(at, &element, format!("its material '{material}' has the friction {friction}"));
        }
    }
    reading.log.decisions.append(&mut inner.log.decisions);
    link
}

/// A degree of freedom as a motor.
fn motor(
    node: Node<'_, '_>,
    d: usize,
    leader: Option<&(String, f64, f64)>,
    draft: &mut Draft,
    reading: &mut Reading<'_>,
) {
    let name = format!("d{d}");
    let element = format!("dof {d}");
    let Some((joint, factor, _)) = leader else {
        reading.log.problem(At::Hand, element, "moves no joint");
        return;
    };
    let at = At::Motor(name.clone());
    let slides = draft.joints.iter().any(|j| j.name == *joint && j.kind == JointKind::Prismatic);
    let scale = if slides { FORCE } else { TORQUE };
    let mut e = Element { name: &element, at: at.clone(), log: &mut reading.log };
    let mut number = |tag: &str| child_text(node, tag).and_then(|text| e.number(&format!("<{tag}>"), text));
    let effort = number("maxEffort").map(|x| x * scale);
    let (kp, kd) = (number("Kp").map(|x| x * TORQUE), number("Kd").map(|x| x * TORQUE));
    let breakaway = number("breakAwayTorque");
    match node.attribute("type").unwrap_or("r") {
        "r" | "" => {}
        "b" => {
            let torque = breakaway.map(|x| format!(" of {x} N·m")).unwrap_or_default();
            reading.log.dropped(
                at.clone(),
                &element,
                format!("a breakaway clutch{torque}; the joints stay coupled"),
            );
        }
        "c" => {
            let text =
                "is compliant: GraspIt! takes its joints' springs; the joints stay coupled in proportion";
            reading.log.guessed(at.clone(), &element, text);
        }
        other => reading.log.problem(at.clone(), &element, format!("is of the unknown type '{other}'")),
    }
    if *factor != 1.0 {
        reading.log.taken(
            at,
            &element,
            format!("its motor is on joint '{joint}', which it turns by {factor}"),
        );
    }
    draft.actuators.push(Actuator {
        control: Some(Control::Position),
        gain: kp,
        damping: kd,
        force_limit: effort,
        ..Actuator::of(&name, Drive::Joint(joint.clone()))
    });
}
