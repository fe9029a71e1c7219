//! From collected links and joints to a [`Draft`].

use std::collections::BTreeMap;

use palmares_models::{Pose, Vec3};

use super::collect::{Found, Reader, yes};
use super::scope::joint_key;
use crate::decision::At;
use crate::draft::{Coupling, Draft, Inertial, Joint, JointKind, Link, LinkShape, Loop, Origin};
use crate::numbers::numbers;
use crate::read::element::{Element, Notes};

/// Density of a shape whose mass SDF leaves to it, kg/m³.
const DENSITY: f64 = 1000.0;

impl Reader<'_> {
    pub(super) fn draft(mut self) -> Draft {
        let parts = std::mem::take(&mut self.parts);
        let mut draft = Draft::default();
        let links: Vec<&Found> = parts.iter().filter(|part| part.element.name == "link").collect();
        let joints: Vec<&Found> = parts.iter().filter(|part| part.element.name == "joint").collect();
        // Frame of each link: that of the joint that leads to it.
        let mut led: BTreeMap<String, Pose> = BTreeMap::new();
        let mut tree = Vec::new();
        let mut gears = Vec::new();
        for joint in joints {
            let name = |tag: &str| joint.element.child_text(tag).map(str::to_owned);
            let (Some(parent), Some(child)) = (name("parent"), name("child")) else {
                self.log.bad(&joint.element, "has no <parent> or no <child>");
                continue;
            };
            if parent == "world" || child == "world" {
                self.log.lost(
                    At::Hand,
                    &joint.element,
                    "holds the hand at the world; a base is moved by its servo",
                );
                continue;
            }
            let full = |name: &str| joint.around.full(name).unwrap_or_default();
            let (parent, child) = (self.link_of(&full(&parent)), self.link_of(&full(&child)));
            if joint.element.get("type") == Some("gearbox") {
                gears.push((joint, parent, child));
                continue;
            }
            let own = full(joint.element.get("name").unwrap_or_default());
            let Some(pose) = self.scope.pose(&joint_key(&own)) else {
                self.log.bad(&joint.element, "its pose is relative to a frame that is not there");
                continue;
            };
            if led.contains_key(&child) {
                self.close(&joint.element, &parent, &child, pose, &mut draft);
                continue;
            }
            led.insert(child.clone(), pose);
            tree.push((joint, own, parent, child, pose));
        }
        let mut frames: BTreeMap<String, Pose> = BTreeMap::new();
        for &link in &links {
            let name = format!("{}{}", link.around.prefix, link.element.get("name").unwrap_or_default());
            let Some(pose) = self.scope.pose(&name) else {
                self.log.bad(&link.element, "its pose is relative to a frame that is not there");
                continue;
            };
            let frame = led.get(&name).copied().unwrap_or(pose);
            let mapped = self.link(link, &name, frame.inverse(), pose);
            draft.links.push(mapped);
            frames.insert(name, frame);
        }
        for closed in &mut draft.loops {
            // Points were noted in the model's frame until the links' frames were known.
            for (link, point) in closed.links.iter().zip(&mut closed.points) {
                let frame = frames.get(link).copied().unwrap_or(Pose::IDENTITY);
                *point = (frame.inverse() * Vec3::from_array(*point)).to_array();
            }
        }
        for (joint, name, parent, child, pose) in tree {
            let Some(from) = frames.get(&parent) else {
                self.log.bad(&joint.element, format!("names link '{parent}', which is not there"));
                continue;
            };
            self.joint(joint, &name, (&parent, &child), (from, &pose), &mut draft);
        }
        for (joint, parent, child) in gears {
            self.gear(joint, &parent, &child, &frames, &mut draft);
        }
        self.exclude_by_bitmask(&links, &mut draft);
        for part in parts.iter().filter(|part| part.element.name == "plugin") {
            self.plugin(part, &mut draft);
        }
        for name in draft.links.iter_mut().map(|link| &mut link.name) {
            *name = plain(name);
        }
        for joint in &mut draft.joints {
            (joint.parent, joint.child) = (plain(&joint.parent), plain(&joint.child));
        }
        for closed in &mut draft.loops {
            closed.links = closed.links.clone().map(|link| plain(&link));
        }
        draft
    }

    /// The link that a joint's end means: a frame is attached to one, and a model moves with one.
    pub(super) fn link_of(&self, name: &str) -> String {
        let mut at = name.to_owned();
        for _ in 0..=self.scope.frames.len() {
            if self.links.contains(&at) {
                break;
            }
            let next = self.scope.canonical.get(&at);
            match next.or_else(|| self.scope.get(&at).map(|frame| &frame.attached_to)) {
                Some(next) => at.clone_from(next),
                None => break,
            }
        }
        at
    }

    /// A second joint that leads to one link closes a chain.
    fn close(&mut self, element: &Element, parent: &str, child: &str, pose: Pose, draft: &mut Draft) {
        let text = format!("closes a chain at link '{child}': its axis is a pin between the two links");
        self.log.kept(At::Hand, element, text);
        let point = pose.translation.to_array();
        draft.loops.push(Loop {
            name: element.get("name").unwrap_or("loop").to_owned(),
            links: [parent.to_owned(), child.to_owned()],
            points: [point, point],
            welded: element.get("type") == Some("fixed"),
        });
    }

    /// A link whose frame in the hand is that of its joint; `pose` is that of the link itself.
    fn link(&mut self, found: &Found, name: &str, from_model: Pose, pose: Pose) -> Link {
        let element = &found.element;
        let mut link = Link { name: name.to_owned(), ..Link::default() };
        if let Some(inertial) = element.child("inertial") {
            let origin = self.placed(found, inertial, pose);
            let mass = self.number(inertial, &["mass"]);
            let mut moment = |name: &str| self.number(inertial, &["inertia", name]).unwrap_or(0.0);
            let names = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"];
            let inertia = names.map(&mut moment);
            if yes(inertial.get("auto")) {
                let density = self.number(inertial, &["density"]);
                let text = "auto: mass and inertia come from the shapes";
                match density.filter(|density| *density != DENSITY) {
                    Some(density) => {
                        let text =
                            format!("{text} at {DENSITY} kg/m³, not at its density {density}: state <mass>");
                        self.log.bad(inertial, text);
                    }
                    None => self.log.kept(At::Link(plain(name)), inertial, text),
                }
            } else {
                link.inertial = mass.filter(|mass| *mass > 0.0).map(|mass| Inertial {
                    origin: Origin::from_pose(&(from_model * origin)),
                    mass,
                    inertia,
                });
            }
        }
        for child in &element.children {
            let touches = child.name == "collision";
            if !touches && child.name != "visual" {
                continue;
            }
            let origin = Origin::from_pose(&(from_model * self.placed(found, child, pose)));
            let picture = !touches && element.child("collision").is_some();
            let Some(geometry) = self.geometry(child, &found.around.file, name, picture) else { continue };
            let part = LinkShape { origin, geometry };
            if touches {
                let friction = self.number(child, &["surface", "friction", "ode", "mu"]);
                link.friction = link.friction.or(friction.filter(|mu| (0.0..100.0).contains(mu)));
                link.collisions.push(part);
            } else {
                link.visuals.push(part);
            }
        }
        for sensor in element.all("sensor") {
            self.log.lost(At::Link(plain(name)), sensor, "sensors are stated in hand.toml; it is left out");
        }
        link
    }

    /// Pose of a part of a link in the outermost model.
    fn placed(&mut self, found: &Found, part: &Element, link: Pose) -> Pose {
        let (pose, stated) = self.posed(part);
        let Some(frame) = stated.filter(|frame| !frame.is_empty()) else { return link * pose };
        let full = found.around.full(&frame);
        match full.map_or(Some(Pose::IDENTITY), |full| self.scope.pose(&full)) {
            Some(frame) => frame * pose,
            None => {
                self.log.bad(part, format!("its pose is relative to '{frame}', which is not there"));
                link * pose
            }
        }
    }

    fn joint(
        &mut self,
        found: &Found,
        name: &str,
        (parent, child): (&str, &str),
        (from, pose): (&Pose, &Pose),
        draft: &mut Draft,
    ) {
        let element = &found.element;
        let name = plain(name);
        let kind = element.get("type").unwrap_or_default();
        let mut joint = Joint::fixed(name.clone(), parent, child);
        joint.origin = Origin::from_pose(&(from.inverse() * *pose));
        match kind {
            "fixed" => {}
            "revolute" | "continuous" | "prismatic" => {
                self.axis(found, "axis", pose, &mut joint, draft);
                match kind {
                    "prismatic" => joint.kind = JointKind::Prismatic,
                    "continuous" => (joint.kind, joint.limits) = (JointKind::Continuous, None),
                    _ => {}
                }
            }
            "screw" => {
                let Some(lead) = self.lead(element) else {
                    self.log.bad(element, "is a screw without <screw_thread_pitch>; it is fixed");
                    draft.joints.push(joint);
                    return;
                };
                let between = format!("{name}_nut");
                joint.child.clone_from(&between);
                self.axis(found, "axis", pose, &mut joint, draft);
                let slide = Joint {
                    kind: JointKind::Prismatic,
                    axis: joint.axis,
                    ..Joint::fixed(format!("{name}_slide"), between.clone(), child)
                };
                let text =
                    format!("is a screw of {lead:.6} m/rad; taken are a hinge and a slide that follows it");
                self.log.kept(At::Joint(name.clone()), element, text);
                draft.couplings.push(Coupling {
                    joint: slide.name.clone(),
                    leader: name,
                    coefficients: vec![0.0, lead],
                });
                draft.links.push(Link { name: between, ..Link::default() });
                draft.joints.push(joint);
                draft.joints.push(slide);
                return;
            }
            "ball" => joint.kind = JointKind::Ball,
            "universal" | "revolute2" => {
                let between = format!("{name}_cross");
                let mut second = Joint::fixed(format!("{name}_2"), between.clone(), child);
                joint.child.clone_from(&between);
                self.axis(found, "axis", pose, &mut joint, draft);
                self.axis(found, "axis2", pose, &mut second, draft);
                let text =
                    format!("is of type {kind}; taken are two hinges with a link without mass between them");
                self.log.kept(At::Joint(name), element, text);
                draft.links.push(Link { name: between, ..Link::default() });
                draft.joints.push(joint);
                draft.joints.push(second);
                return;
            }
            other => {
                let valid =
                    "fixed, revolute, continuous, prismatic, ball, universal, revolute2, screw, gearbox";
                let text =
                    format!("is of type '{other}', which has no counterpart; it is fixed; valid: {valid}");
                self.log.bad(element, text);
            }
        }
        draft.joints.push(joint);
    }

    /// Axis, limits, dynamics and mimic of one degree of freedom.
    pub(super) fn axis(
        &mut self,
        found: &Found,
        tag: &str,
        pose: &Pose,
        joint: &mut Joint,
        draft: &mut Draft,
    ) {
        let element = &found.element;
        let Some(axis) = element.child(tag) else {
            self.log.bad(element, format!("has no <{tag}>; taken is z"));
            joint.kind = JointKind::Continuous;
            return;
        };
        let xyz = axis.child("xyz");
        let direction = xyz.and_then(|xyz| numbers(&xyz.text)).and_then(|x| <[f64; 3]>::try_from(x).ok());
        let direction = Vec3::from_array(direction.unwrap_or([0.0, 0.0, 1.0]));
        let around = &found.around;
        let in_model = match axis.child_text("use_parent_model_frame") {
            None => around.axes_in_model,
            stated => yes(stated),
        };
        let frame = xyz.and_then(|xyz| xyz.get("expressed_in")).filter(|frame| !frame.is_empty());
        let full = match frame {
            Some(frame) => around.full(frame),
            None if in_model => around.frame.clone(),
            None => {
                Some(joint_key(&around.full(element.get("name").unwrap_or_default()).unwrap_or_default()))
            }
        };
        let turned = match full.map_or(Some(Pose::IDENTITY), |full| self.scope.pose(&full)) {
            Some(frame) => frame.rotation,
            None => {
                let frame = frame.unwrap_or_default();
                self.log.bad(element, format!("its axis is expressed in '{frame}', which is not there"));
                pose.rotation
            }
        };
        let direction = pose.rotation.inverse() * (turned * direction);
        joint.axis = direction.to_array();
        let endless = |x: f64| x.abs() >= 1e12;
        let lower = self.number(axis, &["limit", "lower"]).filter(|x| !endless(*x));
        let upper = self.number(axis, &["limit", "upper"]).filter(|x| !endless(*x));
        if let (Some(only), None) | (None, Some(only)) = (lower, upper) {
            let text = format!(
                "has the limit {only} on one side only; a hand's joint has both or none: none is taken"
            );
            self.log.lost(At::Joint(joint.name.clone()), element, text);
        }
        joint.limits = lower.zip(upper).map(|(lower, upper)| [lower, upper]);
        joint.kind = if joint.limits.is_some() { JointKind::Revolute } else { JointKind::Continuous };
        let positive = |x: &f64| *x > 0.0 && *x < 1e12;
        joint.effort = self.number(axis, &["limit", "effort"]).filter(positive);
        joint.velocity = self.number(axis, &["limit", "velocity"]).filter(positive);
        joint.stated.damping = self.number(axis, &["dynamics", "damping"]).filter(|x| *x != 0.0);
        joint.stated.friction = self.number(axis, &["dynamics", "friction"]).filter(|x| *x != 0.0);
        joint.stated.stiffness = self.number(axis, &["dynamics", "spring_stiffness"]).filter(|x| *x != 0.0);
        if joint.stated.stiffness.is_some() {
            joint.stated.rest = self.number(axis, &["dynamics", "spring_reference"]);
        }
        if let Some(mimic) = axis.child("mimic") {
            let Some(leader) = mimic.get("joint") else {
                self.log.bad(element, "<mimic> names no joint");
                return;
            };
            let second = if mimic.get("axis") == Some("axis2") { "_2" } else { "" };
            let multiplier = self.number(mimic, &["multiplier"]).unwrap_or(1.0);
            let offset = self.number(mimic, &["offset"]).unwrap_or(0.0);
            let reference = self.number(mimic, &["reference"]).unwrap_or(0.0);
            draft.couplings.push(Coupling {
                joint: joint.name.clone(),
                leader: plain(&format!("{}{leader}{second}", around.prefix)),
                coefficients: vec![offset - multiplier * reference, multiplier],
            });
        }
    }
}

/// A full name as one that a hand can have.
pub(super) fn plain(name: &str) -> String {
    name.replace("::", "_")
}
