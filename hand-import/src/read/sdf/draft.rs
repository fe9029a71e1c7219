//! From collected links and joints to a [`Draft`].

use std::collections::BTreeMap;
use std::path::Path;

use palmares_models::{Pose, Rotation, Vec3};

use super::collect::{Found, Reader};
use super::scope::{Frame, MAX_DEPTH, joint_key};
use crate::decision::At;
use crate::draft::{
    Actuator, Control, Coupling, Draft, Drive, Geometry, Inertial, Joint, JointKind, Link, Loop, Mesh,
    Origin, Part, Triangles,
};
use crate::read::element::{Element, Notes};
use crate::read::numbers::numbers;

impl Reader<'_> {
    pub(super) fn draft(mut self) -> Draft {
        let parts = std::mem::take(&mut self.parts);
        let mut draft = Draft::default();
        let links: Vec<&Found> = parts.iter().filter(|part| part.element.name == "link").collect();
        let joints: Vec<&Found> = parts.iter().filter(|part| part.element.name == "joint").collect();
        // Frame of each link: that of the joint that leads to it.
        let mut led: BTreeMap<String, Pose> = BTreeMap::new();
        let mut tree = Vec::new();
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
            let full = |name: &str| format!("{}{name}", joint.prefix);
            let (parent, child) = (self.link_of(&full(&parent)), self.link_of(&full(&child)));
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
        for link in links {
            let name = format!("{}{}", link.prefix, link.element.get("name").unwrap_or_default());
            let Some(pose) = self.scope.pose(&name) else {
                self.log.bad(&link.element, "its pose is relative to a frame that is not there");
                continue;
            };
            let frame = led.get(&name).copied().unwrap_or(pose);
            let mapped = self.link(link, &name, frame.inverse() * pose);
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

    /// The link that a joint's end means: a frame is attached to one.
    pub(super) fn link_of(&self, name: &str) -> String {
        let mut at = name.to_owned();
        for _ in 0..MAX_DEPTH {
            match self.scope.get(&at) {
                Some(Frame { relative_to: Some(next), .. }) if !self.links.contains(&at) => {
                    at.clone_from(next)
                }
                _ => break,
            }
        }
        at
    }

    /// A second joint that leads to one link closes a chain.
    pub(super) fn close(
        &mut self,
        element: &Element,
        parent: &str,
        child: &str,
        pose: Pose,
        draft: &mut Draft,
    ) {
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

    pub(super) fn link(&mut self, found: &Found, name: &str, frame_from_link: Pose) -> Link {
        let element = &found.element;
        let mut link = Link { name: name.to_owned(), ..Link::default() };
        if let Some(inertial) = element.child("inertial") {
            let (pose, _) = self.posed(inertial);
            let mass = self.number(inertial, &["mass"]);
            if inertial.get("auto") == Some("true") {
                self.log.bad(inertial, "auto: SDF leaves the mass to the density of its shapes; state it");
            }
            let mut moment = |name: &str| self.number(inertial, &["inertia", name]).unwrap_or(0.0);
            let names = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"];
            let inertia = names.map(&mut moment);
            link.inertial = mass.filter(|mass| *mass > 0.0).map(|mass| Inertial {
                origin: Origin::from_pose(&(frame_from_link * pose)),
                mass,
                inertia,
            });
        }
        for child in &element.children {
            let touches = child.name == "collision";
            if !touches && child.name != "visual" {
                continue;
            }
            let (pose, _) = self.posed(child);
            let Some(geometry) = self.geometry(child, &found.file, name) else { continue };
            let part = Part { origin: Origin::from_pose(&(frame_from_link * pose)), geometry };
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

    pub(super) fn geometry(&mut self, element: &Element, file: &Path, link: &str) -> Option<Geometry> {
        let geometry = element.child("geometry")?;
        let shape = geometry.children.first()?;
        let length = |reader: &mut Self, name: &str| {
            reader.number(shape, &[name]).unwrap_or_else(|| {
                reader.log.bad(element, format!("<{}> has no {name}", shape.name));
                0.0
            })
        };
        let list = |text: Option<&str>| text.and_then(numbers).and_then(|x| <[f64; 3]>::try_from(x).ok());
        Some(match shape.name.as_str() {
            "box" => Geometry::Box(list(shape.child_text("size"))?),
            "sphere" => Geometry::Sphere { radius: length(self, "radius") },
            "cylinder" => {
                Geometry::Cylinder { radius: length(self, "radius"), length: length(self, "length") }
            }
            "capsule" => Geometry::Capsule { radius: length(self, "radius"), length: length(self, "length") },
            "ellipsoid" => Geometry::Ellipsoid(list(shape.child_text("radii"))?),
            "mesh" => {
                let at = At::Link(plain(link));
                let uri = shape.child_text("uri").unwrap_or_default();
                if shape.child("submesh").is_some() {
                    self.log.lost(at.clone(), element, "<submesh>: the whole mesh is taken");
                }
                let scale = list(shape.child_text("scale")).unwrap_or([1.0; 3]);
                match self.source.resolve(file, uri) {
                    Ok(found) => {
                        if let Some(note) = found.note {
                            self.log.chose(at, element, note);
                        }
                        Geometry::Mesh(Mesh { triangles: Triangles::File(found.path), scale })
                    }
                    Err(problem) => {
                        self.log.bad(element, format!("mesh {problem}; the shape is left out"));
                        return None;
                    }
                }
            }
            "empty" => return None,
            other => {
                self.log.lost(
                    At::Link(plain(link)),
                    element,
                    format!("a {other} has no counterpart; it is left out"),
                );
                return None;
            }
        })
    }

    pub(super) fn joint(
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
                if kind == "prismatic" {
                    joint.kind = JointKind::Prismatic;
                }
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
                self.log.bad(element, format!("is of type '{other}', which has no counterpart; it is fixed"));
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
        let in_model =
            axis.child_text("use_parent_model_frame").is_some_and(|text| ["1", "true"].contains(&text));
        let around = found.prefix.strip_suffix("::");
        let turned = match xyz.and_then(|xyz| xyz.get("expressed_in")) {
            Some("__model__") => self.model_rotation(around),
            Some(frame) if !frame.is_empty() => {
                let full = format!("{}{frame}", found.prefix);
                match self.scope.pose(&full) {
                    Some(frame) => frame.rotation,
                    None => {
                        self.log
                            .bad(element, format!("its axis is expressed in '{frame}', which is not there"));
                        pose.rotation
                    }
                }
            }
            _ if in_model => self.model_rotation(around),
            _ => pose.rotation,
        };
        let direction = pose.rotation.inverse() * (turned * direction);
        joint.axis = direction.to_array();
        let endless = |x: f64| x.abs() >= 1e12;
        let lower = self.number(axis, &["limit", "lower"]).filter(|x| !endless(*x));
        let upper = self.number(axis, &["limit", "upper"]).filter(|x| !endless(*x));
        joint.limits = lower.zip(upper).map(|(lower, upper)| [lower, upper]);
        joint.kind = if joint.limits.is_some() { JointKind::Revolute } else { JointKind::Continuous };
        let positive = |x: &f64| *x > 0.0 && *x < 1e12;
        joint.effort = self.number(axis, &["limit", "effort"]).filter(positive);
        joint.velocity = self.number(axis, &["limit", "velocity"]).filter(positive);
        joint.damping = self.number(axis, &["dynamics", "damping"]).filter(|x| *x != 0.0);
        joint.friction = self.number(axis, &["dynamics", "friction"]).filter(|x| *x != 0.0);
        joint.stiffness = self.number(axis, &["dynamics", "spring_stiffness"]).filter(|x| *x != 0.0);
        if joint.stiffness.is_some() {
            joint.rest = self.number(axis, &["dynamics", "spring_reference"]);
        }
        if let Some(mimic) = axis.child("mimic") {
            let Some(leader) = mimic.get("joint") else {
                self.log.bad(element, "<mimic> names no joint");
                return;
            };
            let multiplier = self.number(mimic, &["multiplier"]).unwrap_or(1.0);
            let offset = self.number(mimic, &["offset"]).unwrap_or(0.0);
            let reference = self.number(mimic, &["reference"]).unwrap_or(0.0);
            draft.couplings.push(Coupling {
                joint: joint.name.clone(),
                leader: plain(&format!("{}{leader}", found.prefix)),
                coefficients: vec![offset - multiplier * reference, multiplier],
            });
        }
    }

    pub(super) fn model_rotation(&self, around: Option<&str>) -> Rotation {
        around.and_then(|name| self.scope.pose(name)).unwrap_or(Pose::IDENTITY).rotation
    }

    /// A controller of a joint is a motor; other plugins are left out by name.
    pub(super) fn plugin(&mut self, found: &Found, draft: &mut Draft) {
        let element = &found.element;
        let file = element.get("filename").unwrap_or_default().to_lowercase().replace(['-', '_'], "");
        let position = file.contains("jointpositioncontroller");
        let speed = !position && file.contains("jointcontroller");
        if !position && !speed {
            let name = element.get("filename").unwrap_or("without a file");
            self.log.lost(At::Hand, element, format!("plugin {name} is a program; it is left out"));
            return;
        }
        let joints: Vec<String> = element.all("joint_name").map(|name| name.text.clone()).collect();
        for name in joints {
            let joint = plain(&format!("{}{name}", found.prefix));
            let gain = self.number(element, &["p_gain"]).filter(|gain| *gain > 0.0);
            let force = self.number(element, &["cmd_max"]).filter(|force| *force > 0.0);
            self.log.kept(At::Motor(joint.clone()), element, format!("drives joint '{joint}'"));
            draft.actuators.push(Actuator {
                control: Some(if position { Control::Position } else { Control::Velocity }),
                gain: gain.filter(|_| position),
                damping: self.number(element, &["d_gain"]).filter(|gain| position && *gain > 0.0),
                force_limit: force,
                ..Actuator::of(&joint, Drive::Joint(joint.clone()))
            });
        }
    }
}

/// A full name as one that a hand can have.
fn plain(name: &str) -> String {
    name.replace("::", "_")
}
