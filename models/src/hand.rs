//! The immutable description of a hand: a tree of links moved by few coordinates and fewer tendons.

use crate::shape::Shape;
use crate::tactile::TactilePatch;
use crate::tendon::TendonElement;
use crate::{Mat3, Pose, Vec3};

/// A compliant underactuated hand. Shared read-only by every world that simulates it.
#[derive(Clone, Debug)]
pub struct Hand {
    /// Identifier, unique in a catalogue: `softhand`.
    pub name: String,
    /// One sentence for people.
    pub description: String,
    /// Topologically sorted: a parent stands before its children, `links[0]` is the base.
    pub links: Vec<Link>,
    /// The independent joint coordinates q.
    pub coordinates: Vec<Coordinate>,
    /// The tendons; each pulls on several coordinates.
    pub tendons: Vec<Tendon>,
    /// The motors, in the order of the action's `hand` field.
    pub motors: Vec<Motor>,
    /// Whether the exact gravity torque of the hand's own links is added (Rocchi & Hauser 2016, eq. 6), so
    /// that the free hand closes along the closed form in every orientation.
    pub gravity_compensation: bool,
    /// Pairs of links (lower index first) that never collide with each other, beside parent and child.
    pub no_collision: Vec<[usize; 2]>,
    /// Where the hand can feel touch.
    pub tactile: Vec<TactilePatch>,
}

/// A rigid body of the tree. Fixed URDF joints are merged away: every link but the base moves.
#[derive(Clone, Debug)]
pub struct Link {
    /// Name of the URDF link.
    pub name: String,
    /// Index of the parent link; `None` for the base.
    pub parent: Option<usize>,
    /// How the link moves against its parent; `None` for the base, which floats.
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

/// What an elementary motion does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HingeKind {
    /// Turns about its axis.
    Revolute,
    /// Slides along its axis.
    Prismatic,
}

/// An independent coordinate q with its spring, damper and limits.
#[derive(Clone, Debug)]
pub struct Coordinate {
    /// Name of the joint it stands for.
    pub name: String,
    /// Lower limit, rad (m for a prismatic joint).
    pub lower: f64,
    /// Upper limit, rad (m).
    pub upper: f64,
    /// Elastic stiffness E, N·m/rad; 0 for none.
    pub stiffness: f64,
    /// Viscous damping D, N·m·s/rad.
    pub damping: f64,
    /// Where the spring is at rest, rad.
    pub rest: f64,
}

/// A cable: tension `f = clamp(K (s_ref − s) − b ṡ, 0, f_max)`, torque `τ = Rᵀ f`.
///
/// Its length is `s(q) = Σ r_i q_i` plus the elements' part, and its row of R is the gradient ds/dq.
/// s and f are in units of the coordinate the moment arms refer to: with r dimensionless (URDF
/// `mechanicalReduction`) s is in rad and f in N·m; with r in metres s is in m and f in N.
#[derive(Clone, Debug)]
pub struct Tendon {
    /// Name, for messages.
    pub name: String,
    /// Index into [`Hand::motors`] of the motor that winds it.
    pub motor: usize,
    /// Constant part of its row of R: (coordinate index, moment arm), ascending by coordinate.
    pub moment_arms: Vec<(usize, f64)>,
    /// Parts of s that are not linear in q; each on a coordinate of its own.
    pub elements: Vec<TendonElement>,
    /// Whether it is no cable but a drive that pushes as well: `f` then is clamped to ±f_max.
    pub both_ways: bool,
    /// Stiffness K of cable and motor servo in series.
    pub stiffness: f64,
    /// Damping b of the cable.
    pub damping: f64,
    /// Largest tension f_max.
    pub force_limit: f64,
}

/// A motor: the command σ in [0, 1] maps to `s_ref = scaling · (σ − offset)`.
#[derive(Clone, Debug)]
pub struct Motor {
    /// Name, for messages.
    pub name: String,
    /// s at σ − offset = 1.
    pub scaling: f64,
    /// σ at which s_ref is 0.
    pub offset: f64,
    /// Largest |dσ/dt|, 1/s.
    pub speed_limit: f64,
}

/// Mass properties of a link.
#[derive(Clone, Copy, Debug)]
pub struct Inertia {
    /// kg.
    pub mass: f64,
    /// Centre of mass in the link frame, m.
    pub com: Vec3,
    /// Rotational inertia about the centre of mass, in link axes, kg·m².
    pub about_com: Mat3,
}

/// A collision shape fixed to a link.
#[derive(Clone, Debug)]
pub struct Geom {
    /// Where the shape sits.
    pub link_from_geom: Pose,
    /// The shape.
    pub shape: Shape,
    /// Coulomb friction coefficient of its surface.
    pub friction: f64,
}
