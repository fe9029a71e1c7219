//! A part of a robot: a link with everything that it carries, such as the hand of an arm.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::decision::{At, Log};
use crate::draft::{Draft, Drive};
use crate::error::ImportError;

/// Keeps the link `root` and what is behind it.
///
/// # Errors
/// There is no such link.
pub(crate) fn keep(draft: &mut Draft, root: &str, file: &Path, log: &mut Log) -> Result<(), ImportError> {
    // SDF writes names of nested models with colons.
    let plain = root.replace("::", "_");
    let Some(root) = draft.links.iter().map(|link| &link.name).find(|name| **name == root || **name == plain)
    else {
        let names: Vec<&str> = draft.links.iter().map(|link| link.name.as_str()).collect();
        let problem = format!("has no link '{root}'; valid for --root: one of: {}", names.join(", "));
        return Err(ImportError::unreadable(file, problem));
    };
    let root = root.clone();
    let mut children: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for joint in &draft.joints {
        children.entry(&joint.parent).or_default().push(&joint.child);
    }
    let mut kept = BTreeSet::from([root.clone()]);
    let mut open = vec![root.as_str()];
    while let Some(link) = open.pop() {
        for &child in children.get(link).into_iter().flatten() {
            if kept.insert(child.to_owned()) {
                open.push(child);
            }
        }
    }
    let all = draft.links.len();
    draft.links.retain(|link| kept.contains(&link.name));
    draft.joints.retain(|joint| kept.contains(&joint.parent));
    let joints: BTreeSet<&str> = draft.joints.iter().map(|joint| joint.name.as_str()).collect();
    draft.couplings.retain(|coupling| joints.contains(coupling.joint.as_str()));
    for tendon in &mut draft.tendons {
        tendon.joints.retain(|(joint, _)| joints.contains(joint.as_str()));
    }
    draft.tendons.retain(|tendon| !tendon.joints.is_empty());
    for spring in &mut draft.springs {
        spring.joints.retain(|(joint, _)| joints.contains(joint.as_str()));
    }
    draft.springs.retain(|spring| !spring.joints.is_empty());
    let tendons = &draft.tendons;
    draft.actuators.retain(|actuator| match &actuator.drive {
        Drive::Joint(joint) => joints.contains(joint.as_str()),
        Drive::Tendon(name) => tendons.iter().any(|tendon| tendon.name == *name),
    });
    draft.loops.retain(|pin| pin.links.iter().all(|link| kept.contains(link)));
    draft.exclusions.retain(|pair| pair.iter().all(|link| kept.contains(link)));
    if draft.settings.take().is_some() {
        log.dropped(
            At::Hand,
            "hand.toml",
            "is of the whole robot; a part of it has other motors and tendons",
        );
    }
    let text = format!("--root: taken is link '{root}' with what it carries, {} of {all} links", kept.len());
    log.taken(At::Hand, "robot", text);
    Ok(())
}
