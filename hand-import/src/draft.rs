//! A hand between its source and Palmares: what a description states, in SI units, before anything that is missing is
//! guessed. A reader fills it; `complete/` and `write/` make a hand of it.

use std::collections::BTreeSet;
use std::path::PathBuf;

use palmares_models::hand::{CoordinateSettings, SpringNumbers, StatedTendon};
use palmares_models::{Mat3, Pose, Rotation, Vec3, rotation};

/// The statements of a description about one hand.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Draft {
    /// Name of the robot.
    pub name: String,
    /// One sentence, if the source has one.
    pub description: String,
    /// In the order of the source. Exactly one is no joint's child.
    pub links: Vec<Link>,
    /// In the order of the source.
    pub joints: Vec<Joint>,
    /// Joints that follow other joints.
    pub couplings: Vec<Coupling>,
    /// Cables, with their motors or without.
    pub tendons: Vec<Tendon>,
    /// Motors.
    pub actuators: Vec<Actuator>,
    /// Springs across several joints; a spring of one joint belongs to the [`Joint`].
    pub springs: Vec<Spring>,
    /// Points at which two links meet, in addition to the tree.
    pub loops: Vec<Loop>,
    /// Pairs of links that do not touch each other.
    pub exclusions: Vec<[String; 2]>,
    /// Coulomb coefficient between two surfaces of the hand's kind, if the source states it.
    pub friction: Option<f64>,
    /// How the hand begins.
    pub start: Start,
    /// The text of a `hand.toml` in the source. It is kept as it is, and nothing that it states is written again.
    pub settings: Option<String>,
}

/// Where joints and motors are at the start of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Start {
    /// Coordinate by name of the joint; others are where their springs rest.
    pub joints: Vec<(String, f64)>,
    /// σ by name of the motor; others are at 0, or where they hold their joint.
    pub motors: Vec<(String, f64)>,
}

/// A pose as URDF writes it; it maps the child's or the shape's coordinates to the link's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Origin {
    /// m
    pub xyz: [f64; 3],
    /// About the fixed axes x, y, z, rad.
    pub rpy: [f64; 3],
}

/// A rigid body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Link {
    /// Unique.
    pub name: String,
    /// `None` if the source states none.
    pub inertial: Option<Inertial>,
    /// Shapes that touch.
    pub collisions: Vec<LinkShape>,
    /// Shapes for pictures.
    pub visuals: Vec<LinkShape>,
    /// Whether it is a part that one can see: the source has a shape of it, even one that cannot be read. Its joint stays then.
    pub drawn: bool,
    /// Coulomb coefficient between two surfaces of this kind.
    pub friction: Option<f64>,
}

/// Mass properties of a link.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Inertial {
    /// Centre of mass and axes of the inertia.
    pub origin: Origin,
    /// kg
    pub mass: f64,
    /// ixx, ixy, ixz, iyy, iyz, izz about the centre of mass, kg·m².
    pub inertia: [f64; 6],
}

/// A shape at its place on a link.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkShape {
    /// In the link's frame.
    pub origin: Origin,
    /// The shape.
    pub geometry: Geometry,
}

/// A shape, centred on its origin; lengths run along z.
#[derive(Clone, Debug, PartialEq)]
pub enum Geometry {
    /// Full edge lengths, m.
    Box([f64; 3]),
    /// m
    Sphere {
        /// m
        radius: f64,
    },
    /// m
    Cylinder {
        /// m
        radius: f64,
        /// m
        length: f64,
    },
    /// A cylinder with half a ball at each end.
    Capsule {
        /// m
        radius: f64,
        /// Length of the cylinder between the balls, m.
        length: f64,
    },
    /// Half axes, m. It is written as a mesh.
    Ellipsoid([f64; 3]),
    /// Triangles.
    Mesh(Mesh),
}

impl Geometry {
    /// The shape at another size.
    pub(crate) fn scaled(self, factor: f64) -> Geometry {
        match self {
            Geometry::Box(size) => Geometry::Box(size.map(|x| x * factor)),
            Geometry::Sphere { radius } => Geometry::Sphere { radius: radius * factor },
            Geometry::Cylinder { radius, length } => {
                Geometry::Cylinder { radius: radius * factor, length: length * factor }
            }
            Geometry::Capsule { radius, length } => {
                Geometry::Capsule { radius: radius * factor, length: length * factor }
            }
            Geometry::Ellipsoid(radii) => Geometry::Ellipsoid(radii.map(|x| x * factor)),
            Geometry::Mesh(Mesh { triangles, scale }) => {
                Geometry::Mesh(Mesh { triangles, scale: scale.map(|x| x * factor) })
            }
        }
    }
}

/// Triangles and their size.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Origin of the triangles.
    pub triangles: Triangles,
    /// Metres per unit along each axis, before the file's own unit.
    pub scale: [f64; 3],
}

/// Origin of a mesh's triangles.
#[derive(Clone, Debug, PartialEq)]
pub enum Triangles {
    /// A file of the source, by its path in it.
    File(PathBuf),
    /// Corners in the description itself, under a name for the file that is written.
    Inline {
        /// Stem of the file.
        name: String,
        /// Three corners each.
        corners: Vec<[Vec3; 3]>,
    },
}

/// Degrees of freedom of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// None.
    Fixed,
    /// Turns between limits.
    Revolute,
    /// Turns without limits.
    Continuous,
    /// Slides.
    Prismatic,
    /// Turns about a point. It becomes three revolute joints about x, y and z.
    Ball,
}

/// A joint between two links.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Unique.
    pub name: String,
    /// Degrees of freedom.
    pub kind: JointKind,
    /// Name of the link nearer to the base.
    pub parent: String,
    /// Name of the other link. Its frame is the joint's frame.
    pub child: String,
    /// The child's frame in the parent's, at coordinate 0.
    pub origin: Origin,
    /// In the joint's frame; of any length above 0.
    pub axis: [f64; 3],
    /// Lowest and highest coordinate, rad or m.
    pub limits: Option<[f64; 2]>,
    /// Largest force of its motor, N·m or N.
    pub effort: Option<f64>,
    /// Largest speed, rad/s or m/s.
    pub velocity: Option<f64>,
    /// Inertia of the rotor at the joint, kg·m² or kg.
    pub armature: Option<f64>,
    /// Its own spring, damper and dry friction.
    pub stated: CoordinateSettings,
}

impl Joint {
    /// A fixed joint at the parent's frame.
    pub fn fixed(name: impl Into<String>, parent: impl Into<String>, child: impl Into<String>) -> Joint {
        Joint {
            name: name.into(),
            kind: JointKind::Fixed,
            parent: parent.into(),
            child: child.into(),
            origin: Origin::default(),
            axis: [0.0, 0.0, 1.0],
            limits: None,
            effort: None,
            velocity: None,
            armature: None,
            stated: CoordinateSettings::default(),
        }
    }
}

/// A joint that follows another: its coordinate is a polynomial of the leader's.
#[derive(Clone, Debug, PartialEq)]
pub struct Coupling {
    /// Name of the joint that follows.
    pub joint: String,
    /// Name of the joint that it follows.
    pub leader: String,
    /// From the constant upwards: `[offset, multiplier]` for a `<mimic>`.
    pub coefficients: Vec<f64>,
}

impl Coupling {
    /// Where a line takes the joint to positions within these limits.
    fn range_of_leader(&self, limits: [f64; 2]) -> Option<[f64; 2]> {
        let [constant, slope] = *self.coefficients.as_slice() else { return None };
        let [a, b] = limits.map(|x| (x - constant) / slope);
        (slope != 0.0).then_some([a.min(b), a.max(b)])
    }
}

/// A cable, or a drive that also pushes. Its length s(q) is the sum of its paths over joints.
#[derive(Clone, Debug, PartialEq)]
pub struct Tendon {
    /// Unique.
    pub name: String,
    /// Its paths by name of the joint.
    pub joints: Vec<(String, TendonPath)>,
    /// The motors that wind it, with their weights; none: a passive tendon.
    pub motors: Vec<(String, f64)>,
    /// Its numbers: `rest` is the length at which a passive tendon is slack.
    pub stated: StatedTendon,
}

impl Tendon {
    /// A tendon without joints and motors, of which nothing else is known.
    pub fn of(name: &str) -> Self {
        Tendon {
            name: name.to_owned(),
            joints: Vec::new(),
            motors: Vec::new(),
            stated: StatedTendon::default(),
        }
    }
}

/// A coupling of joints that is no line between two: a stiff tendon that pulls both ways, and never moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tie {
    /// Whether its length is an angle of a turning joint, rad; otherwise m.
    pub(crate) turns: bool,
    /// The length that it keeps.
    pub(crate) rest: f64,
}

impl Tie {
    /// Stiffness, N·m/rad and N/m: 1 N·m bends it by 0.3°, 10 N by 0.2 mm.
    pub(crate) const STIFFNESS: (f64, f64) = (200.0, 5e4);
    /// Largest torque, N·m, and force, N: a third and half of what a hand may have.
    const FORCE: (f64, f64) = (10.0, 200.0);

    /// The tendon over these paths.
    pub(crate) fn tendon(&self, name: &str, joints: Vec<(String, TendonPath)>) -> Tendon {
        let of = |(turns, slides): (f64, f64)| Some(if self.turns { turns } else { slides });
        let stated = StatedTendon {
            stiffness: of(Tie::STIFFNESS),
            force_limit: of(Tie::FORCE),
            rest: Some(self.rest),
            both_ways: Some(true),
            ..StatedTendon::default()
        };
        Tendon { joints, stated, ..Tendon::of(name) }
    }
}

/// Length that a joint takes up of a tendon, as a function of its coordinate.
#[derive(Clone, Debug, PartialEq)]
pub enum TendonPath {
    /// A constant moment arm: the entry of R.
    Arm(f64),
    /// Coefficients from the constant upwards.
    Polynomial(Vec<f64>),
    /// Pairs of coordinate and length, ascending by coordinate.
    Table(Vec<[f64; 2]>),
}

/// The part that an actuator drives.
#[derive(Clone, Debug, PartialEq)]
pub enum Drive {
    /// A joint, by its name.
    Joint(String),
    /// A tendon, by its name.
    Tendon(String),
}

/// The quantity that an actuator's command sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// A position.
    Position,
    /// A speed.
    Velocity,
    /// A force.
    Force,
}

/// A motor.
#[derive(Clone, Debug, PartialEq)]
pub struct Actuator {
    /// Unique.
    pub name: String,
    /// The part that it drives.
    pub drive: Drive,
    /// Motor turns per unit of the joint or tendon: the reduction.
    pub gear: f64,
    /// The quantity that its command sets; `None` if the source does not state it.
    pub control: Option<Control>,
    /// Force per error of position.
    pub gain: Option<f64>,
    /// Force per error of speed.
    pub damping: Option<f64>,
    /// Largest force, at the joint or the tendon.
    pub force_limit: Option<f64>,
    /// Largest speed, at the joint or the tendon.
    pub speed_limit: Option<f64>,
    /// Lowest and highest command.
    pub range: Option<[f64; 2]>,
}

impl Actuator {
    /// A motor of which nothing is known but what it drives.
    pub fn of(name: &str, drive: Drive) -> Self {
        Actuator {
            name: name.to_owned(),
            drive,
            gear: 1.0,
            control: None,
            gain: None,
            damping: None,
            force_limit: None,
            speed_limit: None,
            range: None,
        }
    }
}

/// A spring on a sum of coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct Spring {
    /// Unique.
    pub name: String,
    /// Weights by name of the joint.
    pub joints: Vec<(String, f64)>,
    /// Its numbers.
    pub numbers: SpringNumbers,
}

/// A point that two links have in common.
#[derive(Clone, Debug, PartialEq)]
pub struct Loop {
    /// Unique.
    pub name: String,
    /// The links.
    pub links: [String; 2],
    /// The point in the frame of each, m.
    pub points: [[f64; 3]; 2],
    /// Whether the source also joins the links' orientations.
    pub welded: bool,
}

impl Draft {
    /// Notes which links are drawn; where a description draws none, all that have a mass count.
    pub(crate) fn note_drawn(&mut self) {
        let is_drawn = |link: &Link| !link.collisions.is_empty() || !link.visuals.is_empty();
        let any = self.links.iter().any(is_drawn);
        for link in &mut self.links {
            link.drawn = if any { is_drawn(link) } else { link.inertial.is_some_and(|it| it.mass > 0.0) };
        }
    }

    /// The link at the top of those that fixed joints join with this one.
    pub(crate) fn body_of<'a>(&'a self, link: &'a str) -> &'a str {
        let mut at = link;
        for _ in 0..self.joints.len() {
            match self.joints.iter().find(|joint| joint.child == at) {
                Some(joint) if joint.kind == JointKind::Fixed => at = &joint.parent,
                _ => break,
            }
        }
        at
    }

    /// Whether two links are one body, or one joint apart.
    pub fn are_neighbours(&self, [a, b]: &[String; 2]) -> bool {
        let above = |body: &str| {
            self.joints.iter().find(|joint| joint.child == body).map(|joint| self.body_of(&joint.parent))
        };
        let (a, b) = (self.body_of(a), self.body_of(b));
        a == b || above(a) == Some(b) || above(b) == Some(a)
    }

    /// Where a joint can move: within its own limits and those of all that follow it.
    pub(crate) fn range_with_followers(&self, joint: &str) -> Option<[f64; 2]> {
        let mut range = self.joints.iter().find(|other| other.name == joint)?.limits;
        for coupling in self.couplings.iter().filter(|coupling| coupling.leader == joint) {
            let Some(own) = self.range_with_followers(&coupling.joint) else { continue };
            let Some([low, high]) = coupling.range_of_leader(own) else { continue };
            let [a, b] = range.unwrap_or([f64::MIN, f64::MAX]);
            // Limits that contradict each other leave the leader its own.
            if a.max(low) < b.min(high) {
                range = Some([a.max(low), b.min(high)]);
            }
        }
        range
    }

    /// Whether a joint only moves links that nobody has drawn, such as the stand-in of a motor.
    pub fn moves_nothing(&self, joint: &Joint) -> bool {
        let mut open = vec![joint.child.as_str()];
        let mut visited = BTreeSet::new();
        while let Some(link) = open.pop() {
            if self.links.iter().any(|other| other.name == link && other.drawn) {
                return false;
            }
            if visited.insert(link) {
                let below = self.joints.iter().filter(|other| other.parent == link);
                open.extend(below.map(|other| other.child.as_str()));
            }
        }
        true
    }
}

impl Origin {
    /// An origin without rotation.
    pub fn at(xyz: [f64; 3]) -> Origin {
        Origin { xyz, rpy: [0.0; 3] }
    }

    /// The pose as URDF writes it.
    pub fn from_pose(pose: &Pose) -> Origin {
        Origin { xyz: pose.translation.to_array(), rpy: rpy(&pose.rotation) }
    }

    /// As a pose.
    pub fn pose(&self) -> Pose {
        Pose::from_parts(Vec3::from_array(self.xyz), rotation::from_rpy(self.rpy))
    }
}

/// Roll, pitch and yaw about the fixed axes x, y, z.
pub fn rpy(rotation: &Rotation) -> [f64; 3] {
    let m = Mat3::from_quat(*rotation);
    let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
    let cos_pitch = (y.z * y.z + z.z * z.z).sqrt();
    let roll = f64::atan2(y.z, z.z);
    let (sin, cos) = roll.sin_cos();
    // From the rotation without its roll, so that roll and yaw also fit together at a pitch of ±π/2.
    let yaw = f64::atan2(sin * z.x - cos * y.x, cos * y.y - sin * z.y);
    [roll, f64::atan2(-x.z, cos_pitch), yaw]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rotation_survives_the_way_through_roll_pitch_and_yaw() {
        let half = std::f64::consts::FRAC_PI_2;
        for rpy in [
            [0.3, -0.4, 2.0],
            [-3.0, 1.5, -1.0],
            [0.7, half, -0.2],
            [0.7, -half, 0.9],
            [1.0, half - 1e-9, 0.5],
            [half, 0.0, -half],
            [0.0; 3],
        ] {
            let origin = Origin { xyz: [0.0; 3], rpy };
            let again = Origin::from_pose(&origin.pose()).pose();
            for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
                let off = (origin.pose().rotation * axis - again.rotation * axis).length();
                assert!(off < 1e-14, "{rpy:?}: {off}");
            }
        }
    }
}
