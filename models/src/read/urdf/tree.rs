//! The URDF file as a checked tree: urdf-rs for links and joints, the raw XML for transmissions, which it drops.

use std::collections::BTreeMap;

use urdf_rs::Robot;

use super::elements;
use super::numbers::check_numbers;
use super::transmission::{self, Servo, Transmission};
use super::xml::document;
use crate::error::ModelError;
use crate::read::limits::Limits;
use crate::read::report::Report;
use crate::{Pose, Vec3, rotation};

/// A URDF whose links form one tree.
pub(crate) struct Urdf {
    pub(crate) robot: Robot,
    pub(crate) transmissions: Vec<Transmission>,
    /// Transmissions of one joint and one actuator.
    pub(crate) servos: Vec<Servo>,
    /// Index of the link without a parent.
    pub(crate) root: usize,
    /// Joints that leave each link, in file order.
    pub(crate) children: Vec<Vec<usize>>,
    /// Link at the far end of each joint.
    pub(crate) child_link: Vec<usize>,
    /// Whether all numbers are finite and within the limits; an error is kept for each other one.
    pub(crate) sound: bool,
}

/// Reads and checks the text of a URDF file; `None` if errors were kept.
pub(crate) fn parse(text: &str, limits: &Limits, report: &mut Report) -> Result<Option<Urdf>, ModelError> {
    let document = document(text, limits, report)?;
    if document.root_element().tag_name().name() != "robot" {
        return Err(report.syntax("XML", "the root element is not <robot>"));
    }
    let (transmissions, servos) = transmission::read(document.root_element(), limits, report)?;
    let robot = elements::robot(text, document.root_element(), limits, report)?;
    let whole = report.kept() == 0;
    let sound = check_numbers(&robot, limits, report);
    let of_numbers = report.kept();

    let mut link_by_name = BTreeMap::new();
    for (i, link) in robot.links.iter().enumerate() {
        if link_by_name.insert(link.name.as_str(), i).is_some() {
            let element = format!("link '{}'", link.name);
            report.keep::<()>(Err(report.bad(element, "appears twice", "a name of its own for each link")));
        }
    }
    let mut parent_joint = vec![None; robot.links.len()];
    let mut children = vec![Vec::new(); robot.links.len()];
    let mut child_link = Vec::new();
    let mut joint_names = BTreeMap::new();
    for (j, joint) in robot.joints.iter().enumerate() {
        let element = format!("joint '{}'", joint.name);
        if joint_names.insert(joint.name.as_str(), j).is_some() {
            report.keep::<()>(Err(report.bad(&element, "appears twice", "a name of its own for each joint")));
        }
        let find = |name: &str| {
            link_by_name.get(name).copied().ok_or_else(|| {
                let problem = format!("names link '{name}', which is not there");
                report.bad(&element, problem, "a <link> of this file")
            })
        };
        let ends = (report.keep(find(&joint.parent.link)), report.keep(find(&joint.child.link)));
        let (Some(parent), Some(child)) = ends else { continue };
        if parent_joint[child].replace(j).is_some() {
            let (element, valid) =
                (format!("link '{}'", joint.child.link), "a tree: one joint leads to each link");
            report.keep::<()>(Err(report.bad(element, "is the child of two joints", valid)));
        }
        children[parent].push(j);
        child_link.push(child);
    }
    if !whole || report.kept() > of_numbers {
        // A tree with gaps has wrong roots.
        return Ok(None);
    }
    let roots: Vec<usize> = (0..robot.links.len()).filter(|&l| parent_joint[l].is_none()).collect();
    let &[root] = roots.as_slice() else {
        let names: Vec<&str> = roots.iter().map(|&l| robot.links[l].name.as_str()).collect();
        let problem = format!("{} links are no joint's child: {names:?}", roots.len());
        return Err(report.bad("robot", problem, "exactly one root link, the hand's base"));
    };
    check_reach(&robot, &children, &child_link, root, limits, report)?;
    Ok(Some(Urdf { robot, transmissions, servos, root, children, child_link, sound }))
}

/// Checks that every link is connected to the root, and that the tree is not too deep.
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
        let element = format!("link '{}'", robot.links[link].name);
        report.limit(element, "links in one chain", depth, limits.depth)?;
        open.extend(children[link].iter().map(|&j| (child_link[j], depth + 1)));
    }
    if reached != children.len() {
        let problem = format!("{} links form a loop of their own", children.len() - reached);
        return Err(report.bad("robot", problem, "a tree: joints lead from the base to every link"));
    }
    Ok(())
}

/// A URDF origin as a pose: fixed-axis roll, pitch, yaw.
pub(crate) fn pose(origin: &urdf_rs::Pose) -> Pose {
    Pose::from_parts(Vec3::from_array(*origin.xyz), rotation::from_rpy(*origin.rpy))
}
