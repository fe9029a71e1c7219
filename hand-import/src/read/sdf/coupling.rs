//! Links and joints that depend on others: screws, gearboxes, and pairs of links that do not touch.

use std::collections::BTreeMap;

use palmares_models::{Pose, Vec3};

use super::collect::{Found, Reader};
use super::draft::plain;
use super::scope::joint_key;
use crate::decision::At;
use crate::draft::{Coupling, Draft, Joint, JointKind};
use crate::read::element::{Element, Notes};

impl Reader<'_> {
    /// Metres per radian of a screw: a positive pitch is a right-handed thread.
    pub(super) fn lead(&mut self, element: &Element) -> Option<f64> {
        let pitch = self.number(element, &["screw_thread_pitch"]);
        // The older element is −2π over the pitch.
        let older = self.number(element, &["thread_pitch"]).filter(|x| *x != 0.0).map(|x| -1.0 / x);
        pitch.map(|pitch| pitch / std::f64::consts::TAU).or(older)
    }

    /// A gearbox couples the joints that lead from its reference body to its parent and to its child.
    pub(super) fn gear(
        &mut self,
        found: &Found,
        parent: &str,
        child: &str,
        frames: &BTreeMap<String, Pose>,
        draft: &mut Draft,
    ) {
        let element = &found.element;
        let named = |name: &str| found.around.full(name).unwrap_or_default();
        let body = element.child_text("gearbox_reference_body").map(|name| self.link_of(&named(name)));
        let ratio = self.number(element, &["gearbox_ratio"]).unwrap_or(1.0);
        let from_body = |link: &str| {
            let leads = |joint: &&Joint| joint.child == link && Some(&joint.parent) == body.as_ref();
            draft.joints.iter().find(leads).filter(|joint| joint.kind != JointKind::Fixed).cloned()
        };
        let Some((leader, follower)) = from_body(parent).zip(from_body(child)) else {
            let text = "is a gearbox whose parent and child have no hinges on its <gearbox_reference_body>; it is left out";
            self.log.bad(element, text);
            return;
        };
        // Angles count about the axes of the gearbox, which can be opposite to those of the hinges.
        let pose = self.scope.pose(&joint_key(&named(element.get("name").unwrap_or_default())));
        let mut sign = |tag: &str, joint: &Joint| {
            let mut own = Joint::fixed("", "", "");
            let mut nothing = Draft::default();
            let pose = pose.unwrap_or(Pose::IDENTITY);
            if element.child(tag).is_some() {
                self.axis(found, tag, &pose, &mut own, &mut nothing);
            } else {
                return 1.0;
            }
            let frame = frames.get(&joint.child).copied().unwrap_or(Pose::IDENTITY);
            let there = frame.rotation * Vec3::from_array(joint.axis);
            (pose.rotation * Vec3::from_array(own.axis)).dot(there).signum()
        };
        let slope = -ratio * sign("axis", &leader) * sign("axis2", &follower);
        let (leader, joint) = (leader.name, follower.name);
        let text = format!("couples joint '{joint}' to '{leader}' by the factor {slope}");
        self.log.kept(At::Joint(joint.clone()), element, text);
        draft.couplings.push(Coupling { joint, leader, coefficients: vec![0.0, slope] });
    }

    /// Pairs of links that do not touch: their `collide_bitmask` have no bit in common.
    pub(super) fn exclude_by_bitmask(&mut self, links: &[&Found], draft: &mut Draft) {
        let mut masks: Vec<(String, u64)> = Vec::new();
        for link in links {
            let name = format!("{}{}", link.around.prefix, link.element.get("name").unwrap_or_default());
            let mut mask = None;
            for collision in link.element.all("collision") {
                let contact = collision.child("surface").and_then(|surface| surface.child("contact"));
                let text = contact.and_then(|contact| contact.child_text("collide_bitmask"));
                let bits = text.map_or(Some(0xffff), |text| match text.strip_prefix("0x") {
                    Some(hex) => u64::from_str_radix(hex, 16).ok(),
                    None => text.parse().ok(),
                });
                if bits.is_none() {
                    self.log.bad(collision, format!("its collide_bitmask is '{}'", text.unwrap_or_default()));
                }
                mask = Some(mask.unwrap_or(0) | bits.unwrap_or(0xffff));
            }
            if mask == Some(0) {
                let text = "its collide_bitmask is 0; here it touches objects";
                self.log.lost(At::Link(plain(&name)), &link.element, text);
            }
            masks.extend(mask.map(|mask| (plain(&name), mask)));
        }
        let before = draft.exclusions.len();
        for (k, (a, first)) in masks.iter().enumerate() {
            let others = masks[k + 1..].iter().filter(|(_, second)| first & second == 0);
            draft.exclusions.extend(others.map(|(b, _)| [a.clone(), b.clone()]));
        }
        let count = draft.exclusions.len() - before;
        if let (Some(link), 1..) = (links.first(), count) {
            let text = format!("collide_bitmask: {count} pairs of links never touch");
            self.log.kept(At::Hand, &link.element, text);
        }
    }
}
