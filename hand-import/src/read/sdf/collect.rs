//! Links, joints and frames of a model and of those inside it.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use palmares_models::{Pose, Rotation, Vec3, rotation};

use super::scope::{Frame, MAX_DEPTH, Scope, joint_key};
use crate::decision::{At, Log};
use crate::numbers::numbers;
use crate::read::element::{Element, Notes, parse};
use crate::source::Source;

/// A link, a joint or a plugin with the names around it.
pub(super) struct Found {
    pub(super) element: Element,
    pub(super) around: Around,
}

/// The model that an element is in.
#[derive(Clone)]
pub(super) struct Around {
    pub(super) file: PathBuf,
    /// Prefix of names in it: `finger::`.
    pub(super) prefix: String,
    /// Full name of its frame; `None`: the outermost model.
    pub(super) frame: Option<String>,
    /// Whether axes are in the model's frame, as up to SDF 1.4.
    pub(super) axes_in_model: bool,
    pub(super) depth: usize,
}

impl Around {
    /// The outermost model of a file.
    pub(super) fn outermost(file: &Path, root: &Element) -> Around {
        Around {
            file: file.to_owned(),
            prefix: String::new(),
            frame: None,
            axes_in_model: axes_in_model(root),
            depth: 0,
        }
    }

    /// Full name of what this model calls `name`; `None`: the outermost model.
    pub(super) fn full(&self, name: &str) -> Option<String> {
        if name == "__model__" { self.frame.clone() } else { Some(format!("{}{name}", self.prefix)) }
    }
}

/// Until SDF 1.4 an axis is in the frame of its model, since then in that of its joint.
fn axes_in_model(root: &Element) -> bool {
    let minor = root.get("version").and_then(|version| version.strip_prefix("1."));
    minor.and_then(|minor| minor.parse::<u32>().ok()).is_some_and(|minor| minor < 5)
}

/// Whether an attribute or a text says yes.
pub(super) fn yes(text: Option<&str>) -> bool {
    matches!(text, Some("1" | "true" | "True"))
}

/// Files that models include, all together.
const MAX_INCLUDES: usize = 256;

pub(super) struct Reader<'a> {
    pub(super) source: &'a Source,
    pub(super) log: &'a mut Log,
    pub(super) scope: Scope,
    /// Full names of all links.
    pub(super) links: BTreeSet<String>,
    pub(super) parts: Vec<Found>,
    pub(super) included: usize,
    /// The first model that is not in the source, in words.
    pub(super) missing: Option<String>,
}

impl Reader<'_> {
    /// Collects links, joints and frames; the names of nested models come before theirs.
    pub(super) fn model(&mut self, model: &Element, around: &Around) {
        if around.depth > MAX_DEPTH {
            self.log.bad(model, format!("more than {MAX_DEPTH} models are inside each other"));
            return;
        }
        let prefix = &around.prefix;
        let own = around.frame.clone().unwrap_or_default();
        let first = || model.child("link").or_else(|| model.child("model"))?.get("name");
        if let Some(link) = model.get("canonical_link").filter(|link| !link.is_empty()).or_else(first) {
            self.scope.canonical.entry(own.clone()).or_insert_with(|| format!("{prefix}{link}"));
        }
        for child in &model.children {
            let name = format!("{prefix}{}", child.get("name").unwrap_or_default());
            match child.name.as_str() {
                "link" | "joint" | "frame" => {
                    let (pose, stated) = self.posed(child);
                    let attached = match child.name.as_str() {
                        "joint" => child.child_text("child").and_then(|link| around.full(link)),
                        "frame" => match child.get("attached_to") {
                            None | Some("") => around.frame.clone(),
                            Some(frame) => around.full(frame),
                        },
                        _ => around.frame.clone(),
                    };
                    let relative_to = match stated.as_deref() {
                        None | Some("") => attached.clone(),
                        Some(frame) => around.full(frame),
                    };
                    if child.name == "link" {
                        self.links.insert(name.clone());
                    }
                    let key = if child.name == "joint" { joint_key(&name) } else { name };
                    let attached_to = attached.unwrap_or_default();
                    if self.scope.frames.insert(key, Frame { pose, relative_to, attached_to }).is_some() {
                        self.log.bad(child, "has the name of another element");
                    }
                    if child.name != "frame" {
                        self.parts.push(Found { element: child.clone(), around: around.clone() });
                    }
                }
                "model" => {
                    let inside = Around {
                        prefix: format!("{name}::"),
                        frame: Some(name),
                        depth: around.depth + 1,
                        ..around.clone()
                    };
                    self.nested(child, child, child.get("placement_frame"), &inside, around);
                }
                "include" => self.include(child, around),
                "plugin" => self.parts.push(Found { element: child.clone(), around: around.clone() }),
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

    /// A model in another one. `holder` has its pose, which is that of its frame `placed` if there is one.
    fn nested(
        &mut self,
        model: &Element,
        holder: &Element,
        placed: Option<&str>,
        inside: &Around,
        around: &Around,
    ) {
        let own = inside.frame.clone().unwrap_or_default();
        let (pose, stated) = self.posed(holder);
        let relative_to = match stated.as_deref() {
            None | Some("") => around.frame.clone(),
            Some(frame) => around.full(frame),
        };
        let frame = Frame { pose, relative_to, attached_to: own.clone() };
        self.scope.frames.insert(own.clone(), frame);
        self.model(model, inside);
        let Some(placed) = placed.filter(|placed| !placed.is_empty()) else { return };
        let there = inside.full(placed).and_then(|name| self.scope.pose_in(&name, Some(&own)));
        match (there, self.scope.frames.get_mut(&own)) {
            (Some(there), Some(frame)) => frame.pose = pose * there.inverse(),
            _ => self.log.bad(holder, format!("its placement frame '{placed}' is not in the model")),
        }
    }

    /// `<include><uri>model://name</uri></include>`: a model in a folder of the source.
    fn include(&mut self, element: &Element, around: &Around) {
        let Some((root, path)) = self.included(element, &around.file) else { return };
        let Some(model) = root.child("model") else { return };
        let name = element.child_text("name").or(model.get("name")).unwrap_or_default();
        let holder = if element.child("pose").is_some() { element } else { model };
        let placed = element.child_text("placement_frame").or(model.get("placement_frame"));
        // `merge` puts the parts into this model, without a prefix.
        let (prefix, frame) = if yes(element.get("merge")) {
            (around.prefix.clone(), format!("{}_merged__{name}__model__", around.prefix))
        } else {
            (format!("{}{name}::", around.prefix), format!("{}{name}", around.prefix))
        };
        let axes_in_model = axes_in_model(&root);
        let inside =
            Around { file: path, prefix, frame: Some(frame), axes_in_model, depth: around.depth + 1 };
        self.nested(model, holder, placed, &inside, around);
    }

    /// The file that an `<include>` names, which has a model, or `None` with a problem in the log.
    pub(super) fn included(&mut self, element: &Element, file: &Path) -> Option<(Element, PathBuf)> {
        let Some(uri) = element.child_text("uri") else {
            self.log.bad(element, "has no <uri>");
            return None;
        };
        self.included += 1;
        if self.included > MAX_INCLUDES {
            self.log.bad(element, format!("is one of more than {MAX_INCLUDES}; it is left out"));
            return None;
        }
        let plain = uri.trim_end_matches('/');
        let tries = if plain.ends_with(".sdf") {
            vec![plain.to_owned()]
        } else {
            self.configured(file, plain).into_iter().chain([format!("{plain}/model.sdf")]).collect()
        };
        let mut resolved = tries.iter().filter_map(|name| self.source.resolve(file, name).ok());
        let found = resolved.find(|found| self.is_in(&found.path, plain));
        let Some(found) = found else {
            let source = self.source.root().display();
            let text = format!("'{uri}' is not in {source}; name the folder that holds it as the source");
            self.log.bad(element, &text);
            self.missing.get_or_insert(text);
            return None;
        };
        if found.path == *file {
            self.log.bad(element, format!("'{uri}' is the file that includes it"));
            return None;
        }
        let shown = self.source.display(&found.path);
        let text = self.source.text(&found.path, "source").map_err(|error| error.to_string());
        let root = text.and_then(|text| parse(&shown, &text));
        let problem = match root {
            Ok(root) if root.child("model").is_some() => {
                self.log.kept(At::Hand, element, format!("'{uri}' is {}", found.path.display()));
                return Some((root, found.path));
            }
            Ok(_) => format!("'{uri}' has no <model>"),
            Err(problem) => format!("'{uri}': {problem}"),
        };
        self.log.bad(element, problem);
        None
    }

    /// Whether a joint is on a link that is not there.
    pub(super) fn has_loose_joint(&self) -> bool {
        let joints = self.parts.iter().filter(|part| part.element.name == "joint");
        let ends = joints.flat_map(|joint| {
            let link = |tag: &str| joint.element.child_text(tag).filter(|link| *link != "world");
            ["parent", "child"].map(|tag| joint.around.full(link(tag)?))
        });
        let ends: Vec<String> = ends.flatten().collect();
        ends.iter().any(|end| {
            let link = self.link_of(end);
            !self.links.contains(&link)
        })
    }

    /// Whether a file is in the folder that a URI names: each model has a file of the same name.
    fn is_in(&self, path: &Path, uri: &str) -> bool {
        let wanted = uri.rsplit('/').find(|part| !part.ends_with(".sdf")).unwrap_or_default();
        let root = self.source.root();
        let folder = root.join(path.parent().unwrap_or(Path::new("")));
        let plain = uri.ends_with(".sdf") && !uri.starts_with("model://");
        let named =
            folder.file_name().is_some_and(|name| name.to_string_lossy().eq_ignore_ascii_case(wanted));
        plain || named || self.source.packages().any(|(name, at)| name == wanted && folder == at)
    }

    /// The file that a model folder's `model.config` names.
    pub(super) fn configured(&mut self, file: &Path, folder: &str) -> Option<String> {
        let config = self.source.resolve(file, &format!("{folder}/model.config")).ok()?;
        if !self.is_in(&config.path, folder) {
            return None;
        }
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
                let rpy = if yes(pose.get("degrees")) { rpy.map(f64::to_radians) } else { rpy };
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
