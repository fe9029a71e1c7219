//! The bodies and joints of a robot while its files are read.

use std::path::PathBuf;

use palmares_models::{Mat3, Pose, Vec3};

use super::super::element::{Element, Notes, parse};
use super::super::reading::Reading;
use super::text::attribute;
use crate::draft::{Geometry, JointKind};
use crate::numbers::numbers;

/// Files that name each other.
const DEEPEST: usize = 8;
/// Files that a robot names, each as often as it does.
const MOST_FILES: usize = 256;
/// Bodies, and joints.
pub(super) const MOST_BODIES: usize = 1024;

/// The bodies and joints so far.
#[derive(Debug, Default)]
pub(super) struct Model {
    /// The file that is being read, by its path in the source: names of files count from it.
    pub(super) folder: PathBuf,
    pub(super) bodies: Vec<Body>,
    pub(super) joints: Vec<Hinge>,
    /// Pairs of bodies that do not touch.
    pub(super) adjacent: Vec<[String; 2]>,
    /// Number of files so far.
    files: usize,
}

/// A rigid body.
#[derive(Debug)]
pub(super) struct Body {
    pub(super) name: String,
    /// In the frame of the robot.
    pub(super) pose: Pose,
    pub(super) shapes: Vec<Shape>,
    pub(super) mass: Option<Mass>,
}

/// A shape in the body's frame.
#[derive(Debug)]
pub(super) struct Shape {
    pub(super) pose: Pose,
    pub(super) geometry: Geometry,
    /// Whether it touches; others are pictures.
    pub(super) touches: bool,
}

/// Mass properties in the body's frame; an inertia of 0 is not stated.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mass {
    pub(super) mass: f64,
    pub(super) com: Vec3,
    pub(super) inertia: Mat3,
}

/// A joint with its place in the robot's frame.
#[derive(Debug)]
pub(super) struct Hinge {
    pub(super) name: String,
    pub(super) kind: JointKind,
    /// Numbers of the bodies; the second moves along the axis as the first sees it.
    pub(super) bodies: [usize; 2],
    pub(super) anchor: Vec3,
    pub(super) axis: Vec3,
    pub(super) limits: Option<[f64; 2]>,
    pub(super) velocity: Option<f64>,
    pub(super) effort: Option<f64>,
    /// Whether a motor moves it.
    pub(super) active: bool,
    /// The joint that it follows, with constant and multiplier.
    pub(super) follows: Option<(String, [f64; 2])>,
}

impl Model {
    /// Another file, whose root is read in place of this element's own.
    pub(super) fn file(
        &mut self,
        element: &Element,
        name: &str,
        depth: usize,
        reading: &mut Reading<'_>,
        read: impl FnOnce(&mut Model, &Element, &mut Reading<'_>),
    ) {
        let found = reading.source.resolve(&self.folder, name).and_then(|found| {
            self.files += 1;
            if depth >= DEEPEST || self.files > MOST_FILES {
                return Err(format!("more than {DEEPEST} files name each other, or {MOST_FILES} are named"));
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
    pub(super) fn unscaled(&self, element: &Element, reading: &mut Reading<'_>) {
        let scale = attribute(element, "scalegeometry").map(|text| numbers(text).unwrap_or_default());
        if scale.is_some_and(|list| list.iter().any(|x| *x != 1.0)) {
            reading.log.bad(element, "scalegeometry is not read: state the sizes themselves");
        }
    }

    pub(super) fn is_full(&self) -> bool {
        self.bodies.len().max(self.joints.len()) > MOST_BODIES
    }

    /// A body by its name, in which capitals do not count.
    pub(super) fn find(&self, name: &str) -> Option<usize> {
        self.bodies.iter().position(|body| body.name.eq_ignore_ascii_case(name))
    }
}
