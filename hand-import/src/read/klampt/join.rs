//! Two robots become one.

use crate::draft::{Draft, Drive, Joint, Origin};

/// Fixes a robot to a link of another one.
pub(super) fn join(draft: &mut Draft, mut part: Draft, link: &str, origin: Origin, prefix: &str) {
    let name = |name: &mut String| *name = format!("{prefix}{name}");
    part.links.iter_mut().for_each(|link| name(&mut link.name));
    for joint in &mut part.joints {
        name(&mut joint.name);
        name(&mut joint.parent);
        name(&mut joint.child);
    }
    for coupling in &mut part.couplings {
        name(&mut coupling.joint);
        name(&mut coupling.leader);
    }
    for tendon in &mut part.tendons {
        name(&mut tendon.name);
        tendon.joints.iter_mut().for_each(|(joint, _)| name(joint));
        tendon.motors.iter_mut().for_each(|(motor, _)| name(motor));
    }
    for actuator in &mut part.actuators {
        name(&mut actuator.name);
        match &mut actuator.drive {
            Drive::Joint(joint) => name(joint),
            Drive::Tendon(tendon) => name(tendon),
        }
    }
    part.exclusions.iter_mut().flatten().for_each(name);
    let root = part.links.iter().find(|link| part.joints.iter().all(|joint| joint.child != link.name));
    if let Some(root) = root {
        let joint = Joint::fixed(format!("{}_mount", root.name), link, root.name.clone());
        draft.joints.push(Joint { origin, ..joint });
    }
    draft.links.append(&mut part.links);
    draft.joints.append(&mut part.joints);
    draft.couplings.append(&mut part.couplings);
    draft.tendons.append(&mut part.tendons);
    draft.actuators.append(&mut part.actuators);
    draft.exclusions.append(&mut part.exclusions);
}
