//! GraspIt!'s robot XML: chains of Denavit-Hartenberg joints on a palm, in mm, degrees and grams.
//!
//! A joint turns by `k · dN + constant`: dN is the N-th degree of freedom, a motor. GraspIt! has forces in g·mm/s², so that
//! 1 N·m is 1e9 of its units. Source: the user's manual of GraspIt! 4.0 and the readers of its program.

mod body;
mod chain;
mod comments;
mod dofs;
mod tendons;
mod transform;
mod units;

use std::collections::BTreeMap;

use palmares_models::Pose;
use roxmltree::Node;

use self::body::body;
use self::chain::{Moved, chain};
use self::comments::without_comments;
use super::reading::Reading;
use crate::decision::At;
use crate::draft::{Draft, Origin};
use crate::error::ImportError;
use crate::glance::Glance;
use crate::xml::{child_text, children};

/// Whether a file is a robot of GraspIt!.
pub(super) fn is(file: &Glance<'_>) -> bool {
    file.root == "robot" && ["<palm>", "<palm "].iter().any(|palm| file.text.contains(palm))
}

/// Reads a robot.
pub(super) fn read(reading: &mut Reading<'_>) -> Result<Draft, ImportError> {
    let text = without_comments(&reading.text);
    let document = reading.xml(&text)?;
    let robot = document.root_element();
    let stem = reading.path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let mut draft = Draft { name: stem, ..Draft::default() };
    reading.log.taken(
        At::Hand,
        "robot",
        "lengths in mm, angles in degrees, masses in g, springs in N·mm, other torques in g·mm²/s²",
    );
    let palm = child_text(robot, "palm").unwrap_or_default();
    draft.links.push(body("palm", palm, Origin::default(), reading));
    let mut moved: Vec<Vec<Moved>> = children(robot, "dof").map(|_| Vec::new()).collect();
    let mut frames = BTreeMap::from([("palm".to_owned(), Pose::IDENTITY)]);
    for (k, node) in children(robot, "chain").enumerate() {
        chain(node, k, &mut moved, &mut frames, &mut draft, reading);
    }
    let pulled = tendons::tendons(robot, &frames, &moved, &mut draft, reading);
    for (d, (node, joints)) in children(robot, "dof").zip(moved).enumerate() {
        if joints.iter().any(|moved| pulled.contains(&moved.joint)) {
            reading.log.dropped(
                At::Hand,
                format!("dof {d}"),
                "moves a joint that a tendon pulls; it gets no motor",
            );
            continue;
        }
        dofs::dof(node, d, &joints, &mut draft, reading);
    }
    untouched(robot, &mut draft, reading);
    let silent = ["palm", "dof", "chain", "name", "disableCollision", "tendon"];
    for other in robot.children().filter(Node::is_element) {
        let tag = other.tag_name().name();
        if !silent.contains(&tag) {
            let text = match tag {
                "eigenGrasps" => "are directions of GraspIt!'s search, no motors; they are left out",
                "virtualContacts" => "are for GraspIt!'s grasp quality",
                "tendonWrapper" => "is a cylinder around which tendons run, which is not read",
                "filter" => "is a tactile sensor; `[[tactile]]` has a hand's",
                "approachDirection" => "is the palm's normal; [base] turns a hand's palm towards +x",
                _ => "is for GraspIt! only",
            };
            reading.log.dropped(At::Hand, format!("<{tag}>"), text);
        }
    }
    Ok(draft)
}

/// Pairs of links that GraspIt! never lets touch: those that the file states, and those of its own kinds of robots.
fn untouched(robot: Node<'_, '_>, draft: &mut Draft, reading: &mut Reading<'_>) {
    let link = |chain: i64, link: i64| {
        if chain < 0 { "palm".to_owned() } else { format!("chain{chain}_link{link}") }
    };
    let mut pairs: Vec<[String; 2]> = Vec::new();
    for node in children(robot, "disableCollision") {
        let number = |name: &str| node.attribute(name).and_then(|text| text.trim().parse::<i64>().ok());
        let ends = |k: u8| Some(link(number(&format!("body{k}_chain"))?, number(&format!("body{k}_link"))?));
        match ends(1).zip(ends(2)) {
            Some((a, b)) => pairs.push([a, b]),
            None => {
                reading.log.problem(At::Hand, "<disableCollision>", "names no two bodies; it is left out")
            }
        }
    }
    let kind = robot.attribute("type").unwrap_or_default();
    let own: &[[(i64, i64); 2]] = match kind {
        "RobotIQ" => &[[(-1, -1), (0, 1)], [(-1, -1), (1, 1)], [(-1, -1), (2, 1)]],
        "Robonaut" => &[[(-1, -1), (0, 1)]],
        "Shadow" => &[[(-1, -1), (4, 1)], [(1, 0), (0, 0)]],
        "Pr2Gripper" | "M7Tool" => &[[(0, 0), (1, 0)]],
        _ => &[],
    };
    if !own.is_empty() {
        let text =
            format!("is of type '{kind}': as in GraspIt!, {} pairs of its links never touch", own.len());
        reading.log.taken(At::Hand, "robot", text);
    }
    pairs.extend(own.iter().map(|pair| pair.map(|(c, l)| link(c, l))));
    pairs.retain(|pair| {
        let there = pair.iter().all(|name| draft.links.iter().any(|link| link.name == *name));
        if !there {
            let text = format!("{} and {} never touch, but are not both there", pair[0], pair[1]);
            reading.log.problem(At::Hand, "robot", text);
        }
        there && pair[0] != pair[1]
    });
    draft.exclusions.extend(pairs);
}
