//! A hand at the end of an arm: descriptions of whole robots have both, and `--root` reads the hand alone.

use std::collections::{BTreeMap, BTreeSet};

use crate::draft::{Draft, Joint, JointKind};

/// Joints in a row before a palm that a hand may have: those of a wrist.
const WRIST: usize = 3;
/// Links that the sentence names.
const NAMED: usize = 4;

/// A sentence about the hands at the ends of arms, if there are any.
pub(crate) fn hint(draft: &Draft) -> Option<String> {
    let tree = Tree::new(draft);
    let found: Vec<(&str, usize)> = tree.palms();
    let &(first, joints) = found.first()?;
    let names: Vec<&str> = found.iter().skip(1).take(NAMED).map(|(name, _)| *name).collect();
    let others = if names.is_empty() { String::new() } else { format!("; also: {}", names.join(", ")) };
    Some(format!(
        "{joints} joints in a row lead to link '{first}', where others branch off: as of an arm with a hand. They are joints of this hand; \
         --root {first} reads only the hand{others}"
    ))
}

/// A draft's joints by their links. Links that fixed joints join are one body, named by the nearest to the base.
struct Tree<'a> {
    /// The joint that leads to a link.
    before: BTreeMap<&'a str, &'a Joint>,
    /// The joints that move and lead away from a body.
    behind: BTreeMap<&'a str, Vec<&'a Joint>>,
    /// Joints that follow others.
    followers: BTreeSet<&'a str>,
}

impl<'a> Tree<'a> {
    fn new(draft: &'a Draft) -> Tree<'a> {
        let before = draft.joints.iter().map(|joint| (joint.child.as_str(), joint)).collect();
        let followers = draft.couplings.iter().map(|coupling| coupling.joint.as_str()).collect();
        let mut tree = Tree { before, behind: BTreeMap::new(), followers };
        for joint in draft.joints.iter().filter(|joint| joint.kind != JointKind::Fixed) {
            tree.behind.entry(tree.body_of(&joint.parent)).or_default().push(joint);
        }
        tree
    }

    /// The links from one to the base of its body.
    fn to_body(&self, link: &'a str) -> Vec<&'a str> {
        let mut links = vec![link];
        // A loop of links is refused later.
        while let Some(joint) = self.before.get(links[links.len() - 1])
            && joint.kind == JointKind::Fixed
            && links.len() <= self.before.len()
        {
            links.push(&joint.parent);
        }
        links
    }

    fn body_of(&self, link: &'a str) -> &'a str {
        let links = self.to_body(link);
        links[links.len() - 1]
    }

    /// The links at which several joints branch off behind more joints in a row than a wrist has, and the number of these.
    fn palms(&self) -> Vec<(&'a str, usize)> {
        let several = self.behind.iter().filter(|(_, joints)| joints.len() > 1);
        several
            .map(|(body, joints)| (self.carries_all(body, joints), self.row_before(body)))
            .filter(|(_, row)| *row > WRIST)
            .collect()
    }

    /// Joints before a body, back to the base or the last body at which others branch off; one that follows another is none of its own.
    fn row_before(&self, body: &'a str) -> usize {
        let (mut row, mut body) = (0, body);
        for _ in 0..self.before.len() {
            let Some(joint) = self.before.get(body) else { break };
            row += usize::from(!self.followers.contains(joint.name.as_str()));
            body = self.body_of(&joint.parent);
            if self.behind.get(body).is_some_and(|joints| joints.len() > 1) {
                break;
            }
        }
        row
    }

    /// The link of a body farthest from the base that carries all these joints.
    fn carries_all(&self, body: &'a str, joints: &[&'a Joint]) -> &'a str {
        let ways: Vec<Vec<&str>> = joints.iter().map(|joint| self.to_body(&joint.parent)).collect();
        let common = |link: &&&str| ways.iter().all(|way| way.contains(*link));
        ways[0].iter().find(common).copied().unwrap_or(body)
    }
}
