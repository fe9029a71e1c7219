//! Links, joints and frames of a model and of those inside it.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use palmares_models::{Pose, Rotation, Vec3, rotation};

use super::scope::{Frame, MAX_DEPTH, Scope, joint_key};
use crate::decision::{At, Log};
use crate::read::element::{Element, Notes, parse};
use crate::read::numbers::numbers;
use crate::source::Source;

/// A link or a joint with the names around it.
pub(super) struct Found {
    pub(super) element: Element,
    /// Prefix of names in its model: `finger::`.
    pub(super) prefix: String,
    pub(super) file: PathBuf,
}

pub(super) struct Reader<'a> {
    pub(super) source: &'a Source,
    pub(super) log: &'a mut Log,
    pub(super) scope: Scope,
    /// Full names of all links.
    pub(super) links: BTreeSet<String>,
    pub(super) parts: Vec<Found>,
}

impl Reader<'_> {
    /// Collects links, joints and frames; the names of nested models come before theirs.
    pub(super) fn model(&mut self, model: &Element, file: &Path, prefix: &str, pose: Pose, depth: usize) {
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
    pub(super) fn include(&mut self, element: &Element, file: &Path, prefix: &str, depth: usize) {
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
    pub(super) fn configured(&mut self, file: &Path, folder: &str) -> Option<String> {
        let config = self.source.resolve(file, &format!("{folder}/model.config")).ok()?;
        let text = self.source.text(&config.path, "model.config").ok()?;
        let root = parse(&config.path, &text).ok()?;
        let name = root.all("sdf").last()?.text.clone();
        Some(format!("{folder}/{name}"))
    }

    /// The pose of an element, and the frame that it names.
    pub(super) fn posed(&mut self, element: &Element) -> (Pose, Option<String>) {
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

    pub(super) fn number(&mut self, element: &Element, path: &[&str]) -> Option<f64> {
        let found = path.iter().try_fold(element, |at, name| at.child(name))?;
        let number = found.text.parse().ok().filter(|x: &f64| x.is_finite());
        // Gazebo writes 1e+16 and inf for no limit.
        if number.is_none() && !found.text.contains("inf") {
            self.log.bad(element, format!("<{}> is '{}', no number", found.name, found.text));
        }
        number
    }
}
