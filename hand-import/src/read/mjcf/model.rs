//! The content of an MJCF document with all defaults and conventions resolved: SI units, radians, poses.

use std::collections::BTreeMap;

use palmares_models::{Mat3, Pose, Vec3};

use super::actuator::ActuatorSpec;
use crate::read::element::Element;

/// A document. Indices refer to its lists.
#[derive(Clone, Debug, Default)]
pub(crate) struct Model {
    pub(crate) name: String,
    /// A parent comes before its children; the first is the world.
    pub(crate) bodies: Vec<Body>,
    pub(crate) joints: Vec<Joint>,
    pub(crate) geoms: Vec<Geom>,
    pub(crate) sites: Vec<Site>,
    pub(crate) tendons: Vec<Tendon>,
    pub(crate) actuators: Vec<Actuator>,
    pub(crate) equalities: Vec<Equality>,
    pub(crate) rows: Vec<Row>,
    /// Pairs of bodies.
    pub(crate) excludes: Vec<[usize; 2]>,
    /// Pairs of geoms that touch, whatever their masks say.
    pub(crate) pairs: Vec<[usize; 2]>,
    pub(crate) keys: Vec<Key>,
    /// `<custom>` texts by name.
    pub(crate) texts: BTreeMap<String, String>,
}

#[derive(Clone, Debug)]
pub(crate) struct Body {
    pub(crate) name: String,
    pub(crate) parent: usize,
    pub(crate) pose: Pose,
    pub(crate) joints: Vec<usize>,
    pub(crate) geoms: Vec<usize>,
    pub(crate) inertia: Mass,
    pub(crate) element: Option<Element>,
}

/// Mass properties in the body's frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Mass {
    /// kg
    pub(crate) mass: f64,
    pub(crate) com: Vec3,
    /// About the centre of mass, axes of the body, kg·m².
    pub(crate) about_com: Mat3,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum JointKind {
    Hinge,
    Slide,
    Ball,
    Free,
}

#[derive(Clone, Debug)]
pub(crate) struct Joint {
    pub(crate) name: String,
    pub(crate) body: usize,
    pub(crate) kind: JointKind,
    /// Anchor, in the body's frame.
    pub(crate) at: Vec3,
    pub(crate) axis: Vec3,
    /// Position in which the body is where the document puts it.
    pub(crate) reference: f64,
    pub(crate) range: Option<[f64; 2]>,
    pub(crate) stiffness: f64,
    pub(crate) rest: f64,
    pub(crate) damping: f64,
    pub(crate) armature: f64,
    pub(crate) friction: f64,
    /// Largest force of all actuators together.
    pub(crate) force_range: Option<[f64; 2]>,
    pub(crate) element: Element,
}

#[derive(Clone, Debug)]
pub(crate) enum GeomShape {
    Sphere(f64),
    /// Radius and half length.
    Capsule(f64, f64),
    Cylinder(f64, f64),
    Box(Vec3),
    Ellipsoid(Vec3),
    /// Triangles with places in the mesh's own frame.
    Mesh(usize),
    /// Fixed scenery: `plane`, `hfield`, `sdf`.
    Other(String),
}

#[derive(Clone, Debug)]
pub(crate) struct Geom {
    pub(crate) name: Option<String>,
    pub(crate) body: usize,
    pub(crate) pose: Pose,
    pub(crate) shape: GeomShape,
    pub(crate) collides: bool,
    /// `contype` and `conaffinity`: two geoms touch if a bit is in the first of one and the second of the other.
    pub(crate) masks: [u32; 2],
    pub(crate) group: i32,
    pub(crate) friction: f64,
    pub(crate) mass: Option<f64>,
    pub(crate) density: f64,
    /// Whether the mass is spread over the surface.
    pub(crate) shell: bool,
    pub(crate) element: Element,
}

#[derive(Clone, Debug)]
pub(crate) struct Site {
    pub(crate) name: String,
    pub(crate) body: usize,
    pub(crate) pose: Pose,
}

#[derive(Clone, Debug)]
pub(crate) struct Tendon {
    pub(crate) name: String,
    pub(crate) path: Path,
    pub(crate) stiffness: f64,
    /// Below the first length and above the second it pulls; `None`: the length at the start.
    pub(crate) spring_length: Option<[f64; 2]>,
    pub(crate) damping: f64,
    pub(crate) friction: f64,
    pub(crate) range: Option<[f64; 2]>,
    pub(crate) force_range: Option<[f64; 2]>,
    pub(crate) element: Element,
}

#[derive(Clone, Debug)]
pub(crate) enum Path {
    /// Joints with coefficients.
    Fixed(Vec<(usize, f64)>),
    /// In the order of the cable.
    Spatial(Vec<Way>),
}

/// A part of a spatial tendon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Way {
    Site(usize),
    /// A geom that it winds around, and the site on the side where it passes.
    Wrap(usize, Option<usize>),
    /// The lengths after it are divided by this.
    Pulley(f64),
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ActuatorTarget {
    Joint(usize),
    Tendon(usize),
}

#[derive(Clone, Debug)]
pub(crate) struct Actuator {
    pub(crate) name: String,
    pub(crate) target: ActuatorTarget,
    pub(crate) spec: ActuatorSpec,
    pub(crate) element: Element,
}

#[derive(Clone, Debug)]
pub(crate) struct Equality {
    pub(crate) name: String,
    pub(crate) law: Law,
    pub(crate) element: Element,
}

/// Joints that are bound together: a weighted sum of their positions, from their references, has one value.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    pub(crate) name: String,
    /// Joints with their weights.
    pub(crate) terms: Vec<(usize, f64)>,
    pub(crate) sum: f64,
    pub(crate) element: Element,
}

#[derive(Clone, Debug)]
pub(crate) enum Law {
    /// The first joint is a polynomial of the second, both from their references.
    Joint(usize, Option<usize>, [f64; 5]),
    /// Two bodies and the point in the frame of each.
    Connect([usize; 2], [Vec3; 2]),
    Weld([usize; 2], [Vec3; 2]),
}

/// A pose of all joints.
#[derive(Clone, Debug)]
pub(crate) struct Key {
    pub(crate) name: String,
    /// Position of each joint from its reference.
    pub(crate) x: Vec<f64>,
    /// Command of each actuator, if the key states them.
    pub(crate) commands: Option<Vec<f64>>,
}

impl Model {
    /// Pose of each body in the world; `x` is each joint's position from its reference.
    pub(crate) fn world_from_bodies(&self, x: &[f64]) -> Vec<Pose> {
        let mut poses: Vec<Pose> = Vec::with_capacity(self.bodies.len());
        for (index, body) in self.bodies.iter().enumerate() {
            let mut pose = if index == 0 { Pose::IDENTITY } else { poses[body.parent] * body.pose };
            for &j in &body.joints {
                pose *= self.joints[j].motion(x[j]);
            }
            poses.push(pose);
        }
        poses
    }

    /// Numbers by name in a text that an export of this project wrote: `a=0.01 b=-1`.
    pub(crate) fn stated(&self, name: &str) -> Option<Vec<(String, f64)>> {
        let entry = |word: &str| {
            let (name, number) = word.rsplit_once('=')?;
            Some((name.to_owned(), number.parse().ok()?))
        };
        self.texts.get(name)?.split_whitespace().map(entry).collect()
    }

    /// The masks of all geoms of a body together.
    pub(crate) fn masks(&self, body: usize) -> [u32; 2] {
        let masks = self.bodies[body].geoms.iter().map(|&g| self.geoms[g].masks);
        masks.fold([0, 0], |[a, b], [c, d]| [a | c, b | d])
    }

    /// Index of the body of that name.
    pub(crate) fn body(&self, name: &str) -> Option<usize> {
        self.bodies.iter().position(|body| body.name == name)
    }

    /// Index of the joint of that name.
    pub(crate) fn joint(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    /// Joints that move the body, from it to the world.
    pub(crate) fn chain(&self, body: usize) -> Vec<usize> {
        let mut chain = Vec::new();
        let mut at = body;
        while at != 0 {
            chain.extend(self.bodies[at].joints.iter().rev());
            at = self.bodies[at].parent;
        }
        chain
    }
}

impl Joint {
    /// Motion of the body in its own frame, at a position from the reference.
    pub(crate) fn motion(&self, x: f64) -> Pose {
        match self.kind {
            JointKind::Hinge => {
                let turn = Pose::from_parts(Vec3::ZERO, super::compiler::about(self.axis, x));
                Pose::from_translation(self.at) * turn * Pose::from_translation(-self.at)
            }
            JointKind::Slide => Pose::from_translation(self.axis * x),
            JointKind::Ball | JointKind::Free => Pose::IDENTITY,
        }
    }
}
