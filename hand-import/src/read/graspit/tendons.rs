//! `<tendon>`: a cable, straight from point to point of palm and links. One that runs over joints with springs has a motor.

use std::collections::{BTreeMap, BTreeSet};

use palmares_models::{Pose, Rotation, Vec3};
use roxmltree::Node;

use super::chain::Moved;
use super::units::MM;
use crate::decision::At;
use crate::draft::{Actuator, Draft, Drive, Joint, JointKind, Tendon, TendonPath};
use crate::read::reading::Reading;
use crate::xml::{Element, child, child_text, children};

/// Points of a table of lengths.
const POINTS: usize = 65;

/// A point of a tendon.
struct Eyelet {
    link: String,
    /// In the link's frame, m.
    at: Vec3,
}

/// Adds the tendons; the result names the joints that they pull.
pub(super) fn tendons(
    robot: Node<'_, '_>,
    frames: &BTreeMap<String, Pose>,
    moved: &[Vec<Moved>],
    draft: &mut Draft,
    reading: &mut Reading<'_>,
) -> BTreeSet<String> {
    let mut pulled = BTreeSet::new();
    let wrapped = child(robot, "tendonWrapper").is_some();
    for (k, node) in children(robot, "tendon").enumerate() {
        let stated = node.attribute("name").unwrap_or_default().trim();
        let element = format!("tendon '{}'", stated.chars().take(40).collect::<String>());
        let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
        let name = format!("tendon{k}_{}", stated.chars().map(plain).take(40).collect::<String>());
        let paths = if wrapped {
            Err("may run around a <tendonWrapper>".to_owned())
        } else {
            let points = eyelets(node, &element, frames, reading);
            points
                .ok_or_else(|| "has points that are not read".to_owned())
                .and_then(|points| paths(&points, moved, draft))
        };
        let paths = match paths {
            Ok(paths) => paths,
            Err(reason) => {
                let text = format!("{reason}; it is left out, state its row of R");
                reading.log.dropped(At::Hand, element, text);
                continue;
            }
        };
        let text = format!(
            "its length over each of {} joints is a table of {POINTS} points between the joint's limits",
            paths.len()
        );
        reading.log.taken(At::Tendon(name.clone()), element, text);
        pulled.extend(paths.iter().map(|(joint, _)| joint.clone()));
        draft.tendons.push(Tendon { joints: paths, motors: vec![(name.clone(), 1.0)], ..Tendon::of(&name) });
        draft.actuators.push(Actuator::of(&name, Drive::Tendon(name.clone())));
    }
    pulled
}

fn eyelets(
    node: Node<'_, '_>,
    element: &str,
    frames: &BTreeMap<String, Pose>,
    reading: &mut Reading<'_>,
) -> Option<Vec<Eyelet>> {
    let mut e = Element { name: element, at: At::Hand, log: &mut reading.log };
    let mut read = |point: Node<'_, '_>| {
        let index = |tag: &str| child_text(point, tag)?.parse::<i64>().ok();
        let (chain, link) = (index("chain")?, index("link")?);
        let link = if chain < 0 { "palm".to_owned() } else { format!("chain{chain}_link{link}") };
        let at = e.list::<3>("<position>", child_text(point, "position")?)?;
        let at = *frames.get(&link)? * (Vec3::from_array(at) * MM);
        Some(Eyelet { link, at })
    };
    children(node, "insertionPoint").map(&mut read).collect()
}

/// The length that each joint takes up, or the reason why it is not a sum over joints.
fn paths(
    points: &[Eyelet],
    moved: &[Vec<Moved>],
    draft: &Draft,
) -> Result<Vec<(String, TendonPath)>, String> {
    let mut tables: BTreeMap<String, Vec<[f64; 2]>> = BTreeMap::new();
    for pair in points.windows(2) {
        let ways = [way(&pair[0].link, draft), way(&pair[1].link, draft)];
        let shared = ways[0].iter().zip(&ways[1]).take_while(|(a, b)| a.name == b.name).count();
        let ways = ways.map(|way| way[shared..].to_vec());
        let between: Vec<&Joint> =
            ways.iter().flatten().copied().filter(|joint| joint.kind != JointKind::Fixed).collect();
        let joint = match between.as_slice() {
            [] => continue,
            [joint] => *joint,
            several => return Err(format!("runs straight over {} joints", several.len())),
        };
        let name = &joint.name;
        let alone = moved.iter().any(|joints| joints.len() == 1 && joints[0].joint == *name);
        if joint.stated.stiffness.is_none() || !alone {
            return Err(format!("runs over joint '{name}', which has no spring or moves with others"));
        }
        let [low, high] = joint.limits.ok_or_else(|| format!("runs over joint '{name}' without limits"))?;
        if low >= high {
            continue;
        }
        // From the last frame that both have in common.
        let place = |k: usize, q: f64| {
            ways[k].iter().fold(Pose::IDENTITY, |pose, joint| pose * through(joint, q)) * pair[k].at
        };
        let length = |q: f64| (place(0, q) - place(1, q)).length();
        let rest = length(joint.stated.rest.unwrap_or_default());
        let table = tables.entry(name.clone()).or_insert_with(|| {
            let q = |k: usize| low + (high - low) * k as f64 / (POINTS - 1) as f64;
            (0..POINTS).map(|k| [q(k), 0.0]).collect()
        });
        table.iter_mut().for_each(|[q, s]| *s += rest - length(*q));
    }
    if tables.is_empty() {
        return Err("runs over no joint".to_owned());
    }
    Ok(tables.into_iter().map(|(joint, table)| (joint, TendonPath::Table(table))).collect())
}

/// The joints from the palm to a link.
fn way<'a>(link: &str, draft: &'a Draft) -> Vec<&'a Joint> {
    let mut way = Vec::new();
    let mut at = link;
    while let Some(joint) = draft.joints.iter().find(|joint| joint.child == at) {
        way.push(joint);
        at = &joint.parent;
    }
    way.reverse();
    way
}

/// The child's frame in the parent's.
fn through(joint: &Joint, q: f64) -> Pose {
    let axis = Vec3::from_array(joint.axis);
    let motion = match joint.kind {
        JointKind::Fixed => Pose::IDENTITY,
        JointKind::Prismatic => Pose::from_parts(axis * q, Rotation::IDENTITY),
        _ => Pose::from_parts(Vec3::ZERO, Rotation::from_axis_angle(axis, q)),
    };
    joint.origin.pose() * motion
}
