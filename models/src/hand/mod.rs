//! The immutable description of a hand: a tree of links moved by few coordinates and fewer tendons.

pub mod closed_chain;
mod coordinate;
pub mod da_vinci;
pub mod describe;
mod drawn;
pub mod fingers;
mod friction;
mod kinematics;
mod length;
pub mod linkage;
pub(crate) mod load;
mod motor;
pub mod number;
pub mod path;
pub(crate) mod per_joint;
mod quantity;
pub mod sensors;
pub mod spring;
pub mod tendon;
pub mod uncertain;
mod validate;

pub use self::coordinate::{Coordinate, CoordinateNumbers, CoordinateSettings};
pub use self::linkage::{Linkage, LinkageNumbers};
pub use self::motor::{Motor, MotorNumbers, MotorSettings};
use self::number::{Bounds, Field, Number, Table, Visit};
pub use self::sensors::{Sensors, TactilePatch};
pub use self::spring::{Spring, SpringNumbers};
pub use self::tendon::{Guide, GuideNumbers, StatedTendon, Tendon, TendonNumbers};
pub use self::uncertain::Uncertain;
use crate::shape::Shape;
pub use crate::shape::inertia::Inertia;
use crate::{Pose, Vec3};

/// A compliant underactuated hand. Shared read-only by every world that simulates it.
#[derive(Clone, Debug)]
pub struct Hand {
    /// Identifier, unique in a catalogue: `softhand`.
    pub name: String,
    /// One sentence for display.
    pub description: String,
    /// Topologically sorted: a parent comes before its children, `links[0]` is the base.
    pub links: Vec<Link>,
    /// The independent joint coordinates q.
    pub coordinates: Vec<Coordinate>,
    /// The tendons; each pulls on several coordinates.
    pub tendons: Vec<Tendon>,
    /// Springs across several joints: the part of E off its diagonal.
    pub springs: Vec<Spring>,
    /// Pins that close chains of links.
    pub linkages: Vec<Linkage>,
    /// The motors, in the order of the action's `hand` field.
    pub motors: Vec<Motor>,
    /// Whether the exact gravity torque of the hand's own links is added (Rocchi & Hauser 2016, eq. 6), so
    /// that the free hand closes along the closed form in every orientation.
    pub gravity_compensation: bool,
    /// Pairs of links (lower index first) that never collide with each other, in addition to parent and
    /// child.
    pub no_collision: Vec<[usize; 2]>,
    /// Tactile patches.
    pub tactile: Vec<TactilePatch>,
    /// Properties of its sensors, and its optional sensors.
    pub sensors: Sensors,
    /// Soft shapes.
    pub pads: Vec<PadOn>,
    /// How it begins.
    pub start: Start,
    /// Its numbers that are known as ranges.
    pub uncertain: Vec<Uncertain>,
    /// Frame of the URDF's root link in the frame of `links[0]`, the base: see [`Hand::link_from_own`].
    pub base_from_root: Pose,
}

/// How a hand begins, before anything moves it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Start {
    /// σ of every motor; empty if all are 0.
    pub sigma: Vec<f64>,
    /// Every coordinate; empty if each is where its spring rests.
    pub q: Vec<f64>,
}

impl Start {
    /// σ of a motor.
    pub fn sigma_of(&self, motor: usize) -> f64 {
        self.sigma.get(motor).copied().unwrap_or(0.0)
    }
}

impl Hand {
    /// Frame of a URDF link in the frame of `links[link]`: that of the root if `[base]` places the base, else the same.
    pub fn link_from_own(&self, link: usize) -> Pose {
        if link == 0 { self.base_from_root } else { Pose::IDENTITY }
    }

    /// Index of the link of that name.
    pub fn link(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|l| l.name == name)
    }

    /// Index of the coordinate of that name.
    pub fn coordinate(&self, name: &str) -> Option<usize> {
        self.coordinates.iter().position(|c| c.name == name)
    }
}

/// A rigid body of the tree. Fixed URDF joints are merged away: every link but the base moves.
#[derive(Clone, Debug)]
pub struct Link {
    /// Name of the URDF link.
    pub name: String,
    /// Index of the parent link; `None` for the base.
    pub parent: Option<usize>,
    /// Joint to the parent; `None` for the base, which floats.
    pub joint: Option<Joint>,
    /// Mass properties in the link frame.
    pub inertia: Inertia,
    /// Collision geometry.
    pub geoms: Vec<Geom>,
}

/// One or two hinges in series that share one coordinate.
///
/// A plain joint is one hinge. A rolling (Hillberry) joint `T(θ) = Rot(θ/2)·Trans(2r)·Rot(θ/2)` is two, with
/// a massless coupler between them; its coordinate is the half angle θ/2.
#[derive(Clone, Debug)]
pub struct Joint {
    /// Name of the URDF joint that carries the coordinate.
    pub name: String,
    /// Index into [`Hand::coordinates`].
    pub coordinate: usize,
    /// From the parent outwards; one or two. The child's frame is the last hinge's moved frame.
    pub hinges: Vec<Hinge>,
}

/// An elementary motion `T(x) = parent_from_hinge · exp(axis · x)` with `x = ratio · q + offset`.
#[derive(Clone, Debug)]
pub struct Hinge {
    /// Pose of the hinge frame at x = 0 in the frame before it (parent link, or the previous hinge).
    pub parent_from_hinge: Pose,
    /// Unit axis in the hinge frame.
    pub axis: Vec3,
    /// Rotation about the axis, or translation along it.
    pub kind: HingeKind,
    /// dx/dq; a `<mimic>` joint's multiplier.
    pub ratio: f64,
    /// x at q = 0, rad or m.
    pub offset: f64,
}

/// Kind of an elementary motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HingeKind {
    /// Rotation about its axis.
    Revolute,
    /// Translation along its axis.
    Prismatic,
}

number::table! {
    /// A soft surface: pressed against something round, or round itself, it flattens, and resists spin about the
    /// normal.
    #[derive(Copy, PartialEq)]
    pub table Pad;
    /// Thickness of a layer on something hard, m; without it, the whole body is of one material (Hertz).
    thickness: Option<f64> = Number { unit: "m", bounds: Bounds::Positive, ..Number::OF_TABLE },
    /// Modulus, Pa: for a layer, pressure over strain in compression; for a body, `E/(1 − ν²)`.
    modulus: f64 = Number { unit: "Pa", bounds: Bounds::Positive, ..Number::REQUIRED },
}

impl Field for Pad {
    fn visit(&self, _: &Number, name: &str, each: &mut Visit<'_>) {
        Table::visit(self, &mut |number, field, value| each(number, &format!("{name}.{field}"), value));
    }
}

/// A soft shape.
#[derive(Clone, Copy, Debug)]
pub struct PadOn {
    /// Index in [`Hand::links`].
    pub link: usize,
    /// Index in [`Link::geoms`].
    pub geom: usize,
    /// Softness.
    pub pad: Pad,
}

/// A collision shape fixed to a link.
#[derive(Clone, Debug)]
pub struct Geom {
    /// Pose of the shape in the link frame.
    pub link_from_geom: Pose,
    /// The shape.
    pub shape: Shape,
    /// Coulomb friction coefficient of its surface.
    pub friction: f64,
}
