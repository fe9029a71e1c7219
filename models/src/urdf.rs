//! The URDF file as a checked tree: urdf-rs for links and joints, the raw XML for transmissions, which it drops.

use std::collections::BTreeMap;
use std::path::Path;

use urdf_rs::{Joint, JointType, Robot};

use crate::error::ModelError;
use crate::limits::Limits;
use crate::load::Report;
use crate::transmission::{self, Transmission};
use crate::{Pose, Vec3, rotation};

/// A URDF whose links form one tree and whose numbers are finite.
pub(crate) struct Urdf {
    pub(crate) robot: Robot,
    pub(crate) transmissions: Vec<Transmission>,
    /// Index of the link that is nobody's child.
    pub(crate) root: usize,
    /// Joints that leave each link, in file order.
    pub(crate) children: Vec<Vec<usize>>,
    /// Link at the far end of each joint.
    pub(crate) child_link: Vec<usize>,
}

/// Reads and checks the text of a URDF file.
pub(crate) fn parse(text: &str, limits: &Limits, report: &mut Report) -> Result<Urdf, ModelError> {
    let document = document(text, limits, &report.file)?;
    let transmissions = transmission::read(document.root_element(), limits, report)?;
    let robot = urdf_rs::read_from_string(text).map_err(|e| report.syntax("URDF", e))?;
    report.limit("robot", "links", robot.links.len(), limits.links)?;
    report.limit("robot", "joints", robot.joints.len(), limits.joints)?;
    let mut shapes = 0;
    for link in &robot.links {
        let element = format!("link '{}'", link.name);
        report.limit(element, "collision shapes", link.collision.len(), limits.link_shapes)?;
        shapes += link.collision.len();
    }
    report.limit("robot", "collision shapes", shapes, limits.shapes)?;
    check_numbers(&robot, limits, report)?;

    let mut link_by_name = BTreeMap::new();
    for (i, link) in robot.links.iter().enumerate() {
        if link_by_name.insert(link.name.as_str(), i).is_some() {
            return Err(report.bad(
                format!("link '{}'", link.name),
                "appears twice",
                "a name of its own for each link",
            ));
        }
    }
    let mut parent_joint = vec![None; robot.links.len()];
    let mut children = vec![Vec::new(); robot.links.len()];
    let mut child_link = Vec::new();
    let mut joint_names = BTreeMap::new();
    for (j, joint) in robot.joints.iter().enumerate() {
        let element = format!("joint '{}'", joint.name);
        if joint_names.insert(joint.name.as_str(), j).is_some() {
            return Err(report.bad(element, "appears twice", "a name of its own for each joint"));
        }
        let find = |name: &str| {
            link_by_name.get(name).copied().ok_or_else(|| {
                report.bad(
                    element.clone(),
                    format!("names link '{name}', which is not there"),
                    "a <link> of this file",
                )
            })
        };
        let (parent, child) = (find(&joint.parent.link)?, find(&joint.child.link)?);
        if parent_joint[child].replace(j).is_some() {
            return Err(report.bad(
                format!("link '{}'", joint.child.link),
                "is the child of two joints",
                "a tree: one joint leads to each link",
            ));
        }
        children[parent].push(j);
        child_link.push(child);
    }
    let roots: Vec<usize> = (0..robot.links.len()).filter(|&l| parent_joint[l].is_none()).collect();
    let &[root] = roots.as_slice() else {
        let names: Vec<&str> = roots.iter().map(|&l| robot.links[l].name.as_str()).collect();
        return Err(report.bad(
            "robot".to_owned(),
            format!("{} links are no joint's child: {names:?}", roots.len()),
            "exactly one root link, the hand's base",
        ));
    };
    check_reach(&robot, &children, &child_link, root, limits, report)?;
    Ok(Urdf { robot, transmissions, root, children, child_link })
}

/// Well-formed XML of bounded size and nesting; later parsers recurse.
fn document<'a>(text: &'a str, limits: &Limits, file: &Path) -> Result<roxmltree::Document<'a>, ModelError> {
    let syntax = |message: String| ModelError::Syntax { file: file.to_owned(), format: "XML", message };
    let too_large = |element: String, what: &'static str, found: u64, limit: u64| ModelError::TooLarge {
        file: file.to_owned(),
        element,
        what,
        found,
        limit,
    };
    limits.check_tags(text, file)?;
    let options = roxmltree::ParsingOptions { nodes_limit: limits.xml_nodes, ..Default::default() };
    let document = roxmltree::Document::parse_with_options(text, options).map_err(|e| match e {
        roxmltree::Error::NodesLimitReached => {
            let limit = u64::from(limits.xml_nodes);
            too_large("robot".to_owned(), "XML nodes and more", limit + 1, limit)
        }
        e => syntax(e.to_string()),
    })?;
    let mut open = vec![(document.root_element(), 1_usize)];
    while let Some((node, depth)) = open.pop() {
        if depth > limits.xml_depth {
            let element = format!("<{}>", node.tag_name().name());
            return Err(too_large(element, "nested XML elements", depth as u64, limits.xml_depth as u64));
        }
        open.extend(node.children().filter(roxmltree::Node::is_element).map(|child| (child, depth + 1)));
    }
    if document.root_element().tag_name().name() != "robot" {
        return Err(syntax("the root element is not <robot>".to_owned()));
    }
    Ok(document)
}

/// Every link hangs on the root, and the tree is not absurdly deep.
fn check_reach(
    robot: &Robot,
    children: &[Vec<usize>],
    child_link: &[usize],
    root: usize,
    limits: &Limits,
    report: &Report,
) -> Result<(), ModelError> {
    let mut reached = 0;
    let mut open = vec![(root, 1)];
    while let Some((link, depth)) = open.pop() {
        reached += 1;
        if depth > limits.depth {
            let element = format!("link '{}'", robot.links[link].name);
            return report.limit(element, "links in one chain", depth, limits.depth);
        }
        open.extend(children[link].iter().map(|&j| (child_link[j], depth + 1)));
    }
    if reached != children.len() {
        return Err(report.bad(
            "robot".to_owned(),
            format!("{} links form a loop of their own", children.len() - reached),
            "a tree: joints lead from the base to every link",
        ));
    }
    Ok(())
}

fn check_numbers(robot: &Robot, limits: &Limits, report: &Report) -> Result<(), ModelError> {
    let pose = |element: &dyn Fn() -> String, p: &urdf_rs::Pose| {
        p.xyz.iter().try_for_each(|&x| report.number(element, "an origin at (m)", x, limits.length_m))?;
        p.rpy.iter().try_for_each(|&x| report.number(element, "an origin turned by (rad)", x, limits.number))
    };
    for link in &robot.links {
        let element = || format!("link '{}'", link.name);
        let mass = link.inertial.mass.value;
        if mass < 0.0 {
            return Err(report.bad(
                element(),
                format!("has the negative mass {mass} kg"),
                "a mass of at least 0 kg",
            ));
        }
        report.number(element, "a mass (kg) of", mass, limits.mass_kg)?;
        let i = &link.inertial.inertia;
        for moment in [i.ixx, i.ixy, i.ixz, i.iyy, i.iyz, i.izz] {
            report.number(element, "a moment of inertia (kg·m²) of", moment, limits.number)?;
        }
        pose(&element, &link.inertial.origin)?;
        for collision in &link.collision {
            pose(&element, &collision.origin)?;
            check_geometry(&collision.geometry, &element, limits, report)?;
        }
    }
    for joint in &robot.joints {
        let element = || format!("joint '{}'", joint.name);
        pose(&element, &joint.origin)?;
        joint.axis.xyz.iter().try_for_each(|&x| report.number(element, "an axis with", x, limits.number))?;
        report.number(element, "a lower limit of", joint.limit.lower, f64::MAX)?;
        report.number(element, "an upper limit of", joint.limit.upper, f64::MAX)?;
        let damping = joint.dynamics.as_ref().map_or(0.0, |d| d.damping);
        report.number(element, "damping", damping, limits.number)?;
        let friction = joint.dynamics.as_ref().map_or(0.0, |d| d.friction);
        report.number(element, "friction", friction, limits.number)?;
        if damping < 0.0 {
            return Err(report.bad(
                element(),
                format!("has damping {damping}"),
                "finite damping of at least 0",
            ));
        }
        if let Some(m) = &joint.mimic {
            let (multiplier, offset) = (m.multiplier.unwrap_or(1.0), m.offset.unwrap_or(0.0));
            let usable = 1.0 / limits.number..=limits.number;
            if !usable.contains(&multiplier.abs()) || !(0.0..=limits.number).contains(&offset.abs()) {
                return Err(report.bad(
                    element(),
                    format!("mimics with multiplier {multiplier} and offset {offset}"),
                    "a finite multiplier other than 0 and a finite offset",
                ));
            }
        }
    }
    Ok(())
}

/// Sizes are bounded before anything is computed from them; whether they are positive, the shape itself checks.
fn check_geometry(
    geometry: &urdf_rs::Geometry,
    element: &dyn Fn() -> String,
    limits: &Limits,
    report: &Report,
) -> Result<(), ModelError> {
    use urdf_rs::Geometry;
    let sizes: &[f64] = match geometry {
        Geometry::Box { size } => &**size,
        Geometry::Cylinder { radius, length } | Geometry::Capsule { radius, length } => &[*radius, *length],
        Geometry::Sphere { radius } => &[*radius],
        // A mesh's corners are looked at when it has been read and scaled.
        Geometry::Mesh { .. } => &[],
    };
    sizes
        .iter()
        .try_for_each(|&x| report.number(element, "a collision shape of size (m)", x, limits.length_m))
}

/// A URDF origin as a pose: fixed-axis roll, pitch, yaw.
pub(crate) fn pose(origin: &urdf_rs::Pose) -> Pose {
    Pose::from_parts(Vec3::from_array(*origin.xyz), rotation::from_rpy(*origin.rpy))
}

/// Whether a joint moves, or why this hand cannot have it.
pub(crate) fn moves(joint: &Joint, report: &Report) -> Result<bool, ModelError> {
    match joint.joint_type {
        JointType::Fixed => Ok(false),
        JointType::Revolute | JointType::Continuous | JointType::Prismatic => Ok(true),
        JointType::Floating | JointType::Planar | JointType::Spherical => Err(report.bad(
            format!("joint '{}'", joint.name),
            format!("is of type {:?}", joint.joint_type),
            "fixed, revolute, continuous or prismatic",
        )),
    }
}
