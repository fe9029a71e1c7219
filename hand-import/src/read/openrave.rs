//! OpenRAVE's XML of robots, as its `xmlreaders-core.cpp` reads it: bodies at their poses in one frame, and joints between them.

mod body;
mod equation;
mod joint;
mod model;
mod text;
mod tree;

use self::model::{MOST_BODIES, Model};
use self::text::{attribute, is_tag};
use super::element::{Element, Notes, parse};
use super::reading::Reading;
use crate::decision::At;
use crate::draft::Draft;
use crate::error::ImportError;
use crate::glance::Glance;

/// A robot has a kinbody, or is one.
pub(super) fn is(file: &Glance<'_>) -> bool {
    matches!(&*file.root.to_ascii_lowercase(), "robot" | "kinbody")
        && file.text.to_ascii_lowercase().contains("<kinbody")
}

/// Reads a robot or a kinbody.
pub(super) fn read(reading: &mut Reading<'_>) -> Result<Draft, ImportError> {
    let root = parse(&reading.log.file, &reading.text);
    let root = root.map_err(|problem| ImportError::unreadable(&reading.log.file, problem))?;
    let stem = reading.path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let stem = stem.split('.').next().unwrap_or_default().to_owned();
    let inner = root.children.iter().find(|child| is_tag(child, "kinbody"));
    let name = attribute(&root, "name").or(inner.and_then(|inner| attribute(inner, "name")));
    let mut draft = Draft { name: name.map_or(stem, str::to_owned), ..Draft::default() };
    let mut model = Model::default();
    model.folder.clone_from(&reading.path);
    model.part(&root, "", 0, reading);
    if model.is_full() {
        let problem =
            format!("has more than {MOST_BODIES} bodies or joints; name the file of the hand alone");
        return Err(ImportError::unreadable(&reading.log.file, problem));
    }
    tree::links_and_joints(model, &mut draft, reading);
    Ok(draft)
}

impl Model {
    /// A `<Robot>` or `<KinBody>`, and the files that it names.
    fn part(&mut self, element: &Element, prefix: &str, depth: usize, reading: &mut Reading<'_>) {
        let own = attribute(element, "prefix").unwrap_or_default();
        let prefix = format!("{own}{prefix}");
        if let Some(file) = attribute(element, "file") {
            self.file(element, file, depth, reading, |model, root, reading| {
                model.part(root, &prefix, depth + 1, reading);
            });
        }
        self.unscaled(element, reading);
        for child in &element.children {
            if self.is_full() {
                return;
            }
            match child.name.to_ascii_lowercase().as_str() {
                "kinbody" | "robot" => self.part(child, &prefix, depth, reading),
                "body" => self.body(child, &prefix, depth, reading),
                "joint" => self.joint(child, &prefix, reading),
                "adjacent" => {
                    let pair: Vec<String> =
                        child.text.split_whitespace().map(|name| format!("{prefix}{name}")).collect();
                    match <[String; 2]>::try_from(pair) {
                        Ok(pair) => self.adjacent.push(pair),
                        Err(_) => reading.log.bad(child, "names no two bodies; it is left out"),
                    }
                }
                "translation" | "rotationmat" | "rotationaxis" | "quat" => {
                    reading.log.lost(At::Hand, child, "places the robot in a world");
                }
                "jointvalues" => {
                    reading.log.lost(
                        At::Hand,
                        child,
                        "is a pose of a world; [start] of hand.toml states the hand's",
                    );
                }
                "modelsdir" => self.folder = self.folder.with_file_name(&child.text).join("models.xml"),
                "mass" => {
                    reading.log.lost(At::Hand, child, "is one for all bodies; those of the bodies count")
                }
                _ => reading.log.lost(At::Hand, child, "is for OpenRAVE's own programs"),
            }
        }
    }
}
