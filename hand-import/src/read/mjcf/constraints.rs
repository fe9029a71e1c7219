//! Equalities, excluded contacts and keyframes of a document.

use palmares_models::{Pose, Vec3};

use super::compile::Reader;
use super::defaults::Attributes;
use super::model::{Equality, Joint, JointKind, Key, Law, Model};
use crate::decision::At;
use crate::glance::WITH_CORNERS;
use crate::read::element::{Element, Notes};

impl Reader<'_> {
    pub(super) fn equalities(&mut self, root: &Element) {
        let poses = self.model.world_from_bodies(&vec![0.0; self.model.joints.len()]);
        for element in root.all("equality").flat_map(|equality| &equality.children) {
            let at = self.defaults.of(element, "equality", None, self.log);
            if at.get("active") == Some("false") {
                self.log.lost(At::Hand, element, "is not active; it is left out");
                continue;
            }
            let law = match element.name.as_str() {
                "joint" => self.joint_law(element, &at),
                "connect" | "weld" => self.body_law(element, &at, &poses),
                "tendon" => self.tendon_law(element, &at),
                _ => {
                    self.log.lost(
                        At::Hand,
                        element,
                        format!("<{}> has no counterpart; it is left out", element.name),
                    );
                    None
                }
            };
            let Some(law) = law else { continue };
            let index = self.model.equalities.len();
            let name = element.get("name").map_or_else(|| format!("loop_{index}"), str::to_owned);
            self.model.equalities.push(Equality { name, law, element: element.clone() });
        }
    }

    pub(super) fn joint_law(&mut self, element: &Element, at: &Attributes<'_>) -> Option<Law> {
        let first = self.named(element, "joint1", |model, name| model.joint(name))?;
        let second = match element.get("joint2") {
            Some(_) => Some(self.named(element, "joint2", |model, name| model.joint(name))?),
            None => None,
        };
        Some(Law::Joint(first, second, self.polynomial(at)))
    }

    /// The polynomial of an equality, from the constant upwards.
    pub(super) fn polynomial(&mut self, at: &Attributes<'_>) -> [f64; 5] {
        let mut coefficients = [0.0, 1.0, 0.0, 0.0, 0.0];
        if let Some(list) = at.list("polycoef", self.log) {
            list.iter().take(5).enumerate().for_each(|(k, x)| coefficients[k] = *x);
        }
        coefficients
    }

    pub(super) fn body_law(&mut self, element: &Element, at: &Attributes<'_>, poses: &[Pose]) -> Option<Law> {
        let welded = element.name == "weld";
        if element.get("site1").is_some() {
            let site = |model: &Model, name: &str| model.sites.iter().position(|site| site.name == name);
            let sites = [self.named(element, "site1", site)?, self.named(element, "site2", site)?];
            let bodies = sites.map(|s| self.model.sites[s].body);
            let points = sites.map(|s| self.model.sites[s].pose.translation);
            return Some(if welded { Law::Weld(bodies, points) } else { Law::Connect(bodies, points) });
        }
        let first = self.named(element, "body1", |model, name| model.body(name))?;
        let second = match element.get("body2") {
            Some(_) => self.named(element, "body2", |model, name| model.body(name))?,
            None => 0,
        };
        let anchor = at.array::<3>("anchor", self.log).map_or(Vec3::ZERO, Vec3::from_array);
        let first_from_second = poses[first].inverse() * poses[second];
        let stated =
            at.array::<7>("relpose", self.log).filter(|r| welded && r[3..].iter().any(|x| *x != 0.0));
        let first_from_second = stated.map_or(first_from_second, |[x, y, z, w, i, j, k]| {
            let turn = palmares_models::Rotation::from_xyzw(i, j, k, w).normalize();
            Pose::from_parts(Vec3::new(x, y, z), turn)
        });
        // A connect's anchor is in the first body's frame, a weld's in the second's.
        Some(if welded {
            Law::Weld([first, second], [first_from_second * anchor, anchor])
        } else {
            Law::Connect([first, second], [anchor, first_from_second.inverse() * anchor])
        })
    }

    pub(super) fn excludes(&mut self, root: &Element) {
        let ours =
            |element: &&Element| element.get("name").is_some_and(|name| name.starts_with(WITH_CORNERS));
        let excludes = root.all("contact").flat_map(|contact| contact.all("exclude"));
        for element in excludes.filter(|element| !ours(element)) {
            let find = |model: &Model, name: &str| model.body(name);
            let first = self.named(element, "body1", find);
            let second = self.named(element, "body2", find);
            if let (Some(a), Some(b)) = (first, second) {
                self.model.excludes.push([a, b]);
            }
        }
    }

    pub(super) fn keys(&mut self, root: &Element) {
        for element in root.all("keyframe").flat_map(|keyframe| keyframe.all("key")) {
            let Some(qpos) = element.get("qpos").and_then(crate::numbers::numbers) else { continue };
            let name = element.get("name").unwrap_or_default().to_owned();
            let width = |joint: &Joint| match joint.kind {
                JointKind::Free => 7,
                JointKind::Ball => 4,
                JointKind::Hinge | JointKind::Slide => 1,
            };
            let wanted: usize = self.model.joints.iter().map(width).sum();
            if qpos.len() != wanted {
                self.log.bad(element, format!("qpos has {} numbers; the joints have {wanted}", qpos.len()));
                continue;
            }
            let mut rest = qpos.as_slice();
            let mut values = Vec::new();
            for joint in &self.model.joints {
                let (own, others) = rest.split_at(width(joint));
                values.push(if own.len() == 1 { own[0] - joint.reference } else { 0.0 });
                rest = others;
            }
            let commands = element.get("ctrl").and_then(crate::numbers::numbers);
            self.model.keys.push(Key { name, x: values, commands });
        }
    }
}
