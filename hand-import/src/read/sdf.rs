//! SDF, the format of Gazebo: models of links and joints, each with a pose relative to a named frame.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use palmares_models::{Pose, Rotation, Vec3, rotation};

use crate::decision::{At, Log};
use crate::draft::{
    Actuator, Control, Coupling, Draft, Drive, Geometry, Inertial, Joint, JointKind, Link, Loop, Mesh,
    Origin, Part, Triangles,
};
use crate::error::ImportError;
use crate::read::element::{Element, Notes, parse};
use crate::read::reading::Reading;
use crate::source::Source;

/// Models inside each other, and frames relative to each other.
const MAX_DEPTH: usize = 32;

/// Reads the document of a reading.
pub(super) fn read(reading: &mut Reading<'_>) -> Result<Draft, ImportError> {
    let (source, path, log) = (reading.source, reading.path.as_path(), &mut reading.log);
    let shown = source.display(path);
    let text = source.text(path, "source")?;
    let root = parse(&shown, &text).map_err(|problem| ImportError::unreadable(&shown, problem))?;
    let worlds = root.all("world").flat_map(|world| &world.children);
    let all: Vec<&Element> =
        root.children.iter().chain(worlds).filter(|element| element.name == "model").collect();
    let joints = |model: &&&Element| model.all("joint").count() + model.all("model").count();
    let Some(&model) = all.iter().rev().max_by_key(joints) else {
        return Err(ImportError::unreadable(shown, "has no <model>"));
    };
    for other in all.iter().filter(|other| !std::ptr::eq(**other, model)) {
        log.lost(At::Hand, other, "is another model; it is left out");
    }
    let mut reader =
        Reader { source, log, scope: Scope::default(), links: BTreeSet::new(), parts: Vec::new() };
    reader.model(model, path, "", Pose::IDENTITY, 0);
    let mut draft = reader.draft();
    draft.name = model.get("name").unwrap_or("hand").to_owned();
    Ok(draft)
}

/// Everything that has a pose, by its full name.
#[derive(Default)]
struct Scope {
    frames: BTreeMap<String, Frame>,
}

/// A pose relative to another frame.
struct Frame {
    pose: Pose,
    /// Full name; `None`: the outermost model.
    relative_to: Option<String>,
}

impl Scope {
    /// What has that name. Older files have joints with the names of links, which come first.
    fn get(&self, name: &str) -> Option<&Frame> {
        self.frames.get(name).or_else(|| self.frames.get(&joint_key(name)))
    }

    /// Pose in the outermost model.
    fn pose(&self, name: &str) -> Option<Pose> {
        let mut pose = Pose::IDENTITY;
        let mut at = Some(name);
        for _ in 0..MAX_DEPTH {
            let Some(name) = at else { return Some(pose) };
            let frame = self.get(name)?;
            pose = frame.pose * pose;
            at = frame.relative_to.as_deref();
        }
        None
    }
}

/// A link or a joint with the names around it.
struct Found {
    element: Element,
    /// Prefix of names in its model: `finger::`.
    prefix: String,
    file: PathBuf,
}

struct Reader<'a> {
    source: &'a Source,
    log: &'a mut Log,
    scope: Scope,
    /// Full names of all links.
    links: BTreeSet<String>,
    parts: Vec<Found>,
}

impl Reader<'_> {
    /// Collects links, joints and frames; the names of nested models come before theirs.
    fn model(&mut self, model: &Element, file: &Path, prefix: &str, pose: Pose, depth: usize) {
        if depth > MAX_DEPTH {
            self.log.bad(model, format!("more than {MAX_DEPTH} models are inside each other"));
            return;
        }
        let around = prefix.strip_suffix("::").map(str::to_owned);
        if let Some(name) = &around {
            let outer = name.rsplit_once("::").map(|(outer, _)| outer.to_owned());
            self.scope.frames.insert(name.clone(), Frame { pose, relative_to: outer });
        }
        for child in &model.children {
            let name = format!("{prefix}{}", child.get("name").unwrap_or_default());
            match child.name.as_str() {
                "link" | "joint" | "frame" => {
                    let (pose, stated) = self.posed(child);
                    let default = match child.name.as_str() {
                        "joint" => child.child_text("child").map(|link| format!("{prefix}{link}")),
                        "frame" => child.get("attached_to").map(|frame| format!("{prefix}{frame}")),
                        _ => around.clone(),
                    };
                    let relative_to = match stated.as_deref() {
                        None | Some("") => default.or(around.clone()),
                        Some("__model__") => around.clone(),
                        Some(frame) => Some(format!("{prefix}{frame}")),
                    };
                    if child.name == "link" {
                        self.links.insert(name.clone());
                    }
                    let key = if child.name == "joint" { joint_key(&name) } else { name };
                    if self.scope.frames.insert(key, Frame { pose, relative_to }).is_some() {
                        self.log.bad(child, "has the name of another element");
                    }
                    if child.name != "frame" {
                        let (prefix, file) = (prefix.to_owned(), file.to_owned());
                        self.parts.push(Found { element: child.clone(), prefix, file });
                    }
                }
                "model" => {
                    let (pose, _) = self.posed(child);
                    self.model(child, file, &format!("{name}::"), pose, depth + 1);
                }
                "include" => self.include(child, file, prefix, depth),
                "plugin" => {
                    let (prefix, file) = (prefix.to_owned(), file.to_owned());
                    self.parts.push(Found { element: child.clone(), prefix, file });
                }
                "gripper" => {
                    self.log.lost(
                        At::Hand,
                        child,
                        "a Gazebo gripper glues objects to the hand; it is left out",
                    );
                }
                _ => {}
            }
        }
    }

    /// `<include><uri>model://name</uri></include>`: a model in a folder of the source.
    fn include(&mut self, element: &Element, file: &Path, prefix: &str, depth: usize) {
        let Some(uri) = element.child_text("uri") else {
            self.log.bad(element, "has no <uri>");
            return;
        };
        let plain = uri.trim_end_matches('/');
        let tries = if plain.ends_with(".sdf") {
            vec![plain.to_owned()]
        } else {
            self.configured(file, plain).into_iter().chain([format!("{plain}/model.sdf")]).collect()
        };
        let found = tries.iter().find_map(|name| self.source.resolve(file, name).ok());
        let Some(found) = found else {
            self.log.bad(element, format!("'{uri}' is not in the source: put its folder beside this one"));
            return;
        };
        let shown = self.source.display(&found.path);
        let text = self.source.text(&found.path, "source").map_err(|error| error.to_string());
        let root = match text.and_then(|text| parse(&shown, &text)) {
            Ok(root) => root,
            Err(problem) => {
                self.log.bad(element, format!("'{uri}': {problem}"));
                return;
            }
        };
        let Some(model) = root.child("model") else {
            self.log.bad(element, format!("'{uri}' has no <model>"));
            return;
        };
        let name = element.child_text("name").or(model.get("name")).unwrap_or_default();
        let holder = if element.child("pose").is_some() { element } else { model };
        let (pose, _) = self.posed(holder);
        self.log.kept(At::Hand, element, format!("'{uri}' is {}", found.path.display()));
        // `merge` puts the parts into this model, without a prefix.
        if element.get("merge") == Some("true") {
            self.model(model, &found.path, prefix, pose, depth + 1);
        } else {
            self.model(model, &found.path, &format!("{prefix}{name}::"), pose, depth + 1);
        }
    }

    /// The file that a model folder's `model.config` names.
    fn configured(&mut self, file: &Path, folder: &str) -> Option<String> {
        let config = self.source.resolve(file, &format!("{folder}/model.config")).ok()?;
        let text = self.source.text(&config.path, "model.config").ok()?;
        let root = parse(&config.path, &text).ok()?;
        let name = root.all("sdf").last()?.text.clone();
        Some(format!("{folder}/{name}"))
    }

    /// The pose of an element, and the frame that it names.
    fn posed(&mut self, element: &Element) -> (Pose, Option<String>) {
        let Some(pose) = element.child("pose") else { return (Pose::IDENTITY, None) };
        let relative_to = pose.get("relative_to").or(pose.get("frame")).map(str::to_owned);
        let numbers = numbers(&pose.text).unwrap_or_default();
        let place = match *numbers.as_slice() {
            [] if pose.text.is_empty() => Pose::IDENTITY,
            [x, y, z, qx, qy, qz, qw] => {
                let turn = Rotation::from_xyzw(qx, qy, qz, qw).normalize();
                Pose::from_parts(Vec3::new(x, y, z), turn)
            }
            [x, y, z, roll, pitch, yaw] => {
                let rpy = [roll, pitch, yaw];
                let rpy = if pose.get("degrees") == Some("true") { rpy.map(f64::to_radians) } else { rpy };
                Pose::from_parts(Vec3::new(x, y, z), rotation::from_rpy(rpy))
            }
            _ => {
                self.log.bad(element, format!("its pose is '{}'; valid: x y z roll pitch yaw", pose.text));
                Pose::IDENTITY
            }
        };
        (place, relative_to)
    }

    fn number(&mut self, element: &Element, path: &[&str]) -> Option<f64> {
        let found = path.iter().try_fold(element, |at, name| at.child(name))?;
        let number = found.text.parse().ok().filter(|x: &f64| x.is_finite());
        // Gazebo writes 1e+16 and inf for no limit.
        if number.is_none() && !found.text.contains("inf") {
            self.log.bad(element, format!("<{}> is '{}', no number", found.name, found.text));
        }
        number
    }

    fn draft(mut self) -> Draft {
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
    fn link_of(&self, name: &str) -> String {
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

    fn link(&mut self, found: &Found, name: &str, frame_from_link: Pose) -> Link {
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

    fn geometry(&mut self, element: &Element, file: &Path, link: &str) -> Option<Geometry> {
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
    fn axis(&mut self, found: &Found, tag: &str, pose: &Pose, joint: &mut Joint, draft: &mut Draft) {
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

    fn model_rotation(&self, around: Option<&str>) -> Rotation {
        around.and_then(|name| self.scope.pose(name)).unwrap_or(Pose::IDENTITY).rotation
    }

    /// A controller of a joint is a motor; other plugins are left out by name.
    fn plugin(&mut self, found: &Found, draft: &mut Draft) {
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
                name: joint.clone(),
                drive: Drive::Joint(joint),
                gear: 1.0,
                control: Some(if position { Control::Position } else { Control::Velocity }),
                gain: gain.filter(|_| position),
                damping: self.number(element, &["d_gain"]).filter(|gain| position && *gain > 0.0),
                force_limit: force,
                speed_limit: None,
                range: None,
            });
        }
    }
}

/// Name under which a joint's frame is found.
fn joint_key(name: &str) -> String {
    format!("{name}#joint")
}

/// A full name as one that a hand can have.
fn plain(name: &str) -> String {
    name.replace("::", "_")
}

fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split_whitespace().map(|word| word.parse().ok().filter(|x: &f64| x.is_finite())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decision::Kind;

    fn read(files: &[(&str, &str)]) -> (Draft, Log) {
        let entries =
            files.iter().map(|(name, text)| (PathBuf::from(name), text.as_bytes().to_vec())).collect();
        let source = Source::memory(Path::new("test"), entries).expect("small");
        let path = PathBuf::from("model.sdf");
        let mut reading = Reading { source: &source, path: path.clone(), log: Log::new(&path), mounted: 0 };
        let draft = super::read(&mut reading).expect("a hand");
        (draft, reading.log)
    }

    const GRIPPER: &str = r#"<sdf version="1.11"><world name="w"><model name="ball"><link name="b"/></model><model name="gripper">
        <pose>0 0 1 0 0 0</pose>
        <frame name="mount"><pose>0 0 0.1 0 0 1.5707963267948966</pose></frame>
        <link name="palm"><inertial><pose>0 0 0.02 0 0 0</pose><mass>0.3</mass><inertia><ixx>1e-4</ixx><iyy>2e-4</iyy><izz>3e-4</izz></inertia></inertial>
          <collision name="c"><geometry><box><size>0.1 0.05 0.04</size></box></geometry><surface><friction><ode><mu>0.7</mu></ode></friction></surface></collision></link>
        <link name="left"><pose relative_to="mount">0.02 0 0 0 0 0</pose><inertial><mass>0.02</mass></inertial>
          <collision name="c"><pose>0 0 0.03 0 0 0</pose><geometry><capsule><radius>0.008</radius><length>0.04</length></capsule></geometry></collision></link>
        <link name="right"><pose>0 -0.02 0.1 0 0 0</pose><inertial><mass>0.02</mass></inertial></link>
        <joint name="base" type="fixed"><parent>world</parent><child>palm</child></joint>
        <joint name="left" type="revolute"><pose>0 0 -0.01 0 0 0</pose><parent>palm</parent><child>left</child>
          <axis><xyz expressed_in="__model__">1 0 0</xyz><limit><lower>0</lower><upper>1.2</upper><effort>2</effort><velocity>-1</velocity></limit>
          <dynamics><damping>0.01</damping><spring_stiffness>0.2</spring_stiffness><spring_reference>-0.1</spring_reference></dynamics></axis></joint>
        <joint name="right" type="revolute"><parent>palm</parent><child>right</child>
          <axis><xyz>-1 0 0</xyz><limit><lower>-1.2</lower><upper>1e16</upper></limit>
          <mimic joint="left"><multiplier>2</multiplier><offset>0.3</offset><reference>0.1</reference></mimic></axis></joint>
        <gripper name="g"><palm_link>palm</palm_link></gripper>
        <plugin name="p" filename="libgazebo_grasp_fix.so"/>
        <plugin name="q" filename="gz-sim-joint-position-controller-system"><joint_name>left</joint_name><p_gain>30</p_gain><cmd_max>2</cmd_max></plugin>
        </model></world></sdf>"#;

    #[test]
    fn poses_axes_springs_and_mimics_of_a_gripper() {
        let (draft, log) = read(&[("model.sdf", GRIPPER)]);
        assert_eq!(draft.name, "gripper");
        let joint = |name: &str| draft.joints.iter().find(|joint| joint.name == name).expect("is there");
        let left = joint("left");
        // The joint is 1 cm below the link, which is 2 cm along the mount's x, the model's y.
        assert!((left.origin.pose().translation - Vec3::new(0.0, 0.02, 0.09)).length() < 1e-12, "{left:?}");
        let axis = left.origin.pose().rotation * Vec3::from_array(left.axis);
        assert!((axis - Vec3::X).length() < 1e-12, "{axis:?}");
        assert_eq!((left.limits, left.effort, left.velocity), (Some([0.0, 1.2]), Some(2.0), None));
        assert_eq!((left.damping, left.stiffness, left.rest), (Some(0.01), Some(0.2), Some(-0.1)));
        let link = draft.links.iter().find(|link| link.name == "left").expect("is there");
        assert!((link.collisions[0].origin.pose().translation - Vec3::Z * 0.04).length() < 1e-12);
        assert_eq!(joint("right").kind, JointKind::Continuous);
        let [offset, multiplier] = draft.couplings[0].coefficients[..] else {
            panic!("{:?}", draft.couplings)
        };
        assert!(multiplier == 2.0 && (offset - 0.1).abs() < 1e-12, "{offset}");
        assert_eq!(draft.links[0].friction, Some(0.7));
        assert_eq!((draft.actuators[0].gain, draft.actuators[0].force_limit), (Some(30.0), Some(2.0)));
        let dropped: Vec<&str> = log.of(Kind::Dropped).map(|d| d.element.as_str()).collect();
        assert_eq!(dropped, ["model 'ball'", "gripper 'g'", "joint 'base'", "plugin 'p'"]);
        assert!(log.of(Kind::Problem).next().is_none(), "{:?}", log.decisions);
    }

    #[test]
    fn an_included_model_brings_its_links_under_its_name() {
        let finger = r#"<sdf version="1.9"><model name="finger"><link name="a"/><link name="b"><pose>0 0 0.05 0 0 0</pose></link>
            <joint name="j" type="revolute"><parent>a</parent><child>b</child><axis><xyz>0 1 0</xyz></axis></joint></model></sdf>"#;
        let hand = r#"<sdf version="1.9"><model name="hand"><link name="palm"/>
            <include><uri>model://finger</uri><name>thumb</name><pose>0.1 0 0 0 0 1.5707963267948966</pose></include>
            <joint name="fix" type="fixed"><parent>palm</parent><child>thumb::a</child></joint></model></sdf>"#;
        let config = "<model><sdf version='1.9'>finger.sdf</sdf></model>";
        let (draft, log) =
            read(&[("model.sdf", hand), ("finger/model.config", config), ("finger/finger.sdf", finger)]);
        assert!(log.of(Kind::Problem).next().is_none(), "{:?}", log.decisions);
        let joint = draft.joints.iter().find(|joint| joint.name == "thumb_j").expect("is there");
        assert_eq!((joint.parent.as_str(), joint.child.as_str()), ("thumb_a", "thumb_b"));
        let fix = draft.joints.iter().find(|joint| joint.name == "fix").expect("is there");
        assert!((fix.origin.pose().translation - Vec3::X * 0.1).length() < 1e-12, "{fix:?}");
    }

    #[test]
    fn a_second_joint_to_a_link_is_a_pin() {
        let text = r#"<sdf version="1.9"><model name="bar"><link name="base"/><link name="a"><pose>0 0 0.1 0 0 0</pose></link>
            <link name="b"><pose>0 0.1 0 0 0 0</pose></link>
            <joint name="a" type="revolute"><parent>base</parent><child>a</child><axis><xyz>1 0 0</xyz></axis></joint>
            <joint name="b" type="revolute"><parent>base</parent><child>b</child><axis><xyz>1 0 0</xyz></axis></joint>
            <joint name="pin" type="revolute"><pose>0 0.02 0.05 0 0 0</pose><parent>a</parent><child>b</child><axis><xyz>1 0 0</xyz></axis></joint>
            </model></sdf>"#;
        let (draft, _) = read(&[("model.sdf", text)]);
        assert_eq!(draft.joints.len(), 2);
        let pin = &draft.loops[0];
        assert_eq!(pin.links, ["a", "b"]);
        for (point, wanted) in pin.points.iter().zip([[0.0, 0.12, -0.05], [0.0, 0.02, 0.05]]) {
            assert!((Vec3::from_array(*point) - Vec3::from_array(wanted)).length() < 1e-12, "{pin:?}");
        }
    }
}
