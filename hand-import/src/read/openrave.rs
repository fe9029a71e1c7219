//! OpenRAVE's XML of robots, as its `xmlreaders-core.cpp` reads it: bodies at their poses in one frame, and joints between them.

mod body;
mod equation;
mod joint;
mod tree;

use std::path::{Path, PathBuf};

use palmares_models::{Mat3, Pose, Rotation, Vec3};

use self::body::Body;
use self::joint::Hinge;
use super::element::{Element, Notes, parse};
use super::klampt::rotation::{columns, rotation};
use super::reading::Reading;
use crate::decision::At;
use crate::draft::Draft;
use crate::error::ImportError;
use crate::glance::Glance;
use crate::numbers::numbers;

/// Files that name each other.
const DEEPEST: usize = 8;

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
    let mut model = Model { folder: reading.path.clone(), ..Model::default() };
    model.part(&root, "", 0, reading);
    tree::links_and_joints(model, &mut draft, reading);
    Ok(draft)
}

/// The bodies and joints so far.
#[derive(Debug, Default)]
struct Model {
    /// The file that is being read, by its path in the source: names of files count from it.
    folder: PathBuf,
    bodies: Vec<Body>,
    joints: Vec<Hinge>,
    /// Pairs of bodies that do not touch.
    adjacent: Vec<[String; 2]>,
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

    /// Another file, whose root is read in place of this element's own.
    fn file(
        &mut self,
        element: &Element,
        name: &str,
        depth: usize,
        reading: &mut Reading<'_>,
        read: impl FnOnce(&mut Model, &Element, &mut Reading<'_>),
    ) {
        let found = reading.source.resolve(&self.folder, name).and_then(|found| {
            if depth >= DEEPEST {
                return Err(format!("more than {DEEPEST} files name each other"));
            }
            let text = reading.source.text(&found.path, "file").map_err(|error| error.to_string())?;
            let root = parse(&reading.source.display(&found.path), &text)?;
            Ok((found.path, root))
        });
        match found {
            Ok((path, root)) => {
                let before = std::mem::replace(&mut self.folder, path);
                read(self, &root, reading);
                self.folder = before;
            }
            Err(problem) => reading.log.bad(element, format!("file {problem}; it is left out")),
        }
    }

    /// A scale of the geometry has no place: it is a problem, unless it is 1.
    fn unscaled(&self, element: &Element, reading: &mut Reading<'_>) {
        let scale = attribute(element, "scalegeometry").map(|text| numbers(text).unwrap_or_default());
        if scale.is_some_and(|list| list.iter().any(|x| *x != 1.0)) {
            reading.log.bad(element, "scalegeometry is not read: state the sizes themselves");
        }
    }

    /// A body by its name, in which capitals do not count.
    fn find(&self, name: &str) -> Option<usize> {
        self.bodies.iter().position(|body| body.name.eq_ignore_ascii_case(name))
    }
}

fn is_tag(element: &Element, tag: &str) -> bool {
    element.name.eq_ignore_ascii_case(tag)
}

/// An attribute, in whose name capitals do not count.
fn attribute<'a>(element: &'a Element, name: &str) -> Option<&'a str> {
    let found = element.attributes.iter().find(|(key, _)| key.eq_ignore_ascii_case(name));
    found.map(|(_, value)| value.as_str())
}

/// The first child with this tag.
fn child<'a>(element: &'a Element, tag: &str) -> Option<&'a Element> {
    element.children.iter().find(|child| is_tag(child, tag))
}

/// The `N` numbers in an element's text; anything else is a problem.
fn list<const N: usize>(element: &Element, reading: &mut Reading<'_>) -> Option<[f64; N]> {
    let list = numbers(&element.text).and_then(|found| <[f64; N]>::try_from(found).ok());
    if list.is_none() {
        let shown: String = element.text.chars().take(40).collect();
        reading.log.bad(element, format!("is '{shown}'; valid: {N} finite numbers; not read"));
    }
    list
}

fn vector(element: &Element, reading: &mut Reading<'_>) -> Option<Vec3> {
    list(element, reading).map(Vec3::from_array)
}

/// The pose that the children of an element state: translations add up, and each rotation follows those before it.
fn pose(element: &Element, before: Pose, reading: &mut Reading<'_>) -> Pose {
    let Pose { mut translation, rotation: mut turned } = before;
    for child in &element.children {
        let turn = match child.name.to_ascii_lowercase().as_str() {
            "translation" => {
                translation += vector(child, reading).unwrap_or(Vec3::ZERO);
                None
            }
            "rotationmat" => list::<9>(child, reading).and_then(|rows| {
                let found = rotation(columns(&rows));
                if found.is_none() {
                    reading.log.bad(child, "is no rotation; not read");
                }
                found
            }),
            "rotationaxis" => list::<4>(child, reading).and_then(|[x, y, z, degrees]| {
                let axis = Vec3::new(x, y, z).try_normalize()?;
                Some(Rotation::from_axis_angle(axis, degrees.to_radians()))
            }),
            // The real part comes first.
            "quat" => list::<4>(child, reading)
                .filter(|q| q.iter().any(|x| *x != 0.0))
                .map(|[w, x, y, z]| Rotation::from_xyzw(x, y, z, w).normalize()),
            _ => None,
        };
        turned = turn.map_or(turned, |turn| turn * turned);
    }
    Pose::from_parts(translation, turned)
}

/// A matrix by its rows.
fn matrix(rows: [f64; 9]) -> Mat3 {
    let [x, y, z] = columns(&rows);
    Mat3::from_cols(x, y, z)
}

/// The path of a file as a name in decisions.
fn shown(path: &Path) -> String {
    path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}
