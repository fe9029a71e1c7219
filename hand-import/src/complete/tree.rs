//! One tree of links with unique names.

use std::collections::{BTreeMap, BTreeSet};

use crate::decision::{At, Log};
use crate::draft::Draft;

/// Makes names valid and unique, and drops what is not connected.
pub(crate) fn check(draft: &mut Draft, log: &mut Log) {
    draft.name = hand_name(&draft.name, log);
    let mut links = BTreeSet::new();
    draft.links.retain(|link| {
        let new = links.insert(link.name.clone());
        if !new {
            let element = format!("link '{}'", link.name);
            log.problem(At::Link(link.name.clone()), element, "appears twice; the second one is left out");
        }
        new
    });
    let mut joints = BTreeSet::new();
    let mut parents: BTreeMap<String, String> = BTreeMap::new();
    draft.joints.retain(|joint| {
        let (at, element) = (At::Joint(joint.name.clone()), format!("joint '{}'", joint.name));
        let missing = [&joint.parent, &joint.child].into_iter().find(|link| !links.contains(*link));
        let problem = if let Some(link) = missing {
            Some(format!("names link '{link}', which is not there; it is left out"))
        } else if !joints.insert(joint.name.clone()) {
            Some("appears twice; the second one is left out".to_owned())
        } else if let Some(first) = parents.get(&joint.child) {
            let child = &joint.child;
            Some(format!("leads to link '{child}', to which '{first}' leads already; it is left out"))
        } else {
            parents.insert(joint.child.clone(), joint.name.clone());
            None
        };
        problem.is_none_or(|text| {
            log.problem(at, element, text);
            false
        })
    });
    one_root(draft, log);
}

/// Keeps the largest tree.
fn one_root(draft: &mut Draft, log: &mut Log) {
    let mut children: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    let mut has_parent = BTreeSet::new();
    for joint in &draft.joints {
        children.entry(&joint.parent).or_default().push(&joint.child);
        has_parent.insert(joint.child.as_str());
    }
    let below = |root: &str| {
        let mut reached = BTreeSet::from([root.to_owned()]);
        let mut open = vec![root];
        while let Some(link) = open.pop() {
            for &child in children.get(link).into_iter().flatten() {
                if reached.insert(child.to_owned()) {
                    open.push(child);
                }
            }
        }
        reached
    };
    let roots = draft.links.iter().map(|link| link.name.as_str()).filter(|name| !has_parent.contains(name));
    let trees: Vec<BTreeSet<String>> = roots.map(below).collect();
    // The first of the largest.
    let Some(kept) = trees.iter().rev().max_by_key(|tree| tree.len()).cloned() else {
        if !draft.links.is_empty() {
            log.problem(At::Hand, "robot", "its joints form a circle; no link is its base");
        }
        return;
    };
    for link in draft.links.iter().filter(|link| !kept.contains(&link.name)) {
        let text = "no joint connects it with the hand's base; it is left out";
        log.problem(At::Link(link.name.clone()), format!("link '{}'", link.name), text);
    }
    draft.links.retain(|link| kept.contains(&link.name));
    draft.joints.retain(|joint| kept.contains(&joint.parent));
    draft.exclusions.retain(|pair| pair.iter().all(|link| kept.contains(link)));
}

/// A valid name of a hand: 1 to 64 letters, digits, `_`, `-`, `.`.
fn hand_name(name: &str, log: &mut Log) -> String {
    let valid = |c: char| if c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.') { c } else { '_' };
    let mut clean: String = name.trim().chars().map(valid).take(64).collect();
    if clean.is_empty() || clean.starts_with('.') {
        clean = format!("hand{clean}");
    }
    if clean != name {
        log.guessed(At::Hand, "robot", format!("the name '{}' becomes '{clean}'", name.escape_debug()));
    }
    clean
}
