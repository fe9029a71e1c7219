//! Description of a hand for users: the answer of `GET /v1/hands/{name}`.

use schemars::JsonSchema;
use serde::Serialize;

use super::da_vinci::DaVinciGeometry;
use super::number::is_zero;
use super::path::{EyeletPositions, Polynomial, TablePoints, TendonPath};
use super::tendon::{Tendon, TendonElement};
use super::uncertain::{HandQuantity, Range};
use super::{
    CoordinateNumbers, Guide, GuideNumbers, Hand, HingeKind, Linkage, LinkageNumbers, Motor, MotorNumbers,
    Sensors, Spring, SpringNumbers, Start, TactilePatch, TendonNumbers, Uncertain,
};
use crate::Pose;
use crate::shape::Shape;

/// A hand without solver details. Units are SI; poses are those at rest.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct HandDescription {
    /// Identifier.
    pub name: String,
    /// One sentence for display.
    pub description: String,
    /// Mass of all links, kg.
    pub mass: f64,
    /// Rigid bodies; the base first, parents before children.
    pub links: Vec<LinkDescription>,
    /// Independent joint coordinates q, in the order of every vector of joints.
    pub coordinates: Vec<CoordinateDescription>,
    /// Motors, in the order of the action's `hand` field.
    pub motors: Vec<MotorDescription>,
    /// Tendons.
    pub tendons: Vec<TendonDescription>,
    /// Springs across several joints.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub springs: Vec<SpringDescription>,
    /// Pins that close chains of links.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub linkages: Vec<LinkageDescription>,
    /// The fingers, by the names of their first links: the order of `telemetry.fingers`.
    pub fingers: Vec<String>,
    /// Tactile patches.
    pub tactile: Vec<PatchDescription>,
    /// Properties of its sensors, and its optional sensors.
    pub sensors: Sensors,
    /// Whether the hand's own weight is cancelled.
    pub gravity_compensation: bool,
    /// How a run begins, if a motor is not at 0 then or a joint not where its spring rests.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start: Option<StartDescription>,
    /// Its numbers that are known as ranges.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub uncertain: Vec<UncertainDescription>,
    /// Shape, unit and range of the hand's part of an action and of an observation.
    pub specs: Vec<SpecDescription>,
}

/// A number that is known as a range.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct UncertainDescription {
    /// Name.
    pub name: String,
    /// The quantity.
    pub of: HandQuantity,
    /// Links, joints, motors or tendons that have it; empty if these are all.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub on: Vec<String>,
    /// Range of a factor of the hand's own numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub factor: Option<[f64; 2]>,
    /// Range of the number itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<[f64; 2]>,
}

/// How a run begins.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct StartDescription {
    /// σ of every motor.
    pub sigma: Vec<f64>,
    /// Every coordinate, rad or m.
    pub joints: Vec<f64>,
}

/// A rigid body.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct LinkDescription {
    /// Name.
    pub name: String,
    /// Name of the parent link; absent for the base.
    pub parent: Option<String>,
    /// Name of the coordinate that moves it.
    pub coordinate: Option<String>,
    /// Its hinges from the parent outwards: one, or two for a rolling joint.
    pub hinges: Vec<HingeDescription>,
    /// kg
    pub mass: f64,
    /// Centre of mass in the link frame, m.
    pub com: [f64; 3],
    /// Pose in the base frame when the hand is at rest.
    pub base_from_link_at_rest: PoseDescription,
    /// Collision shapes.
    pub shapes: Vec<PlacedShape>,
}

/// An elementary motion `x = ratio · q + offset` about or along an axis.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct HingeDescription {
    /// `revolute` or `prismatic`.
    pub kind: &'static str,
    /// Frame of the hinge at x = 0 in the frame before it.
    pub origin: PoseDescription,
    /// Unit axis in that frame.
    pub axis: [f64; 3],
    /// dx/dq
    pub ratio: f64,
    /// rad or m
    pub offset: f64,
}

/// A position and an orientation.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PoseDescription {
    /// m
    pub position: [f64; 3],
    /// Unit quaternion.
    pub quat_xyzw: [f64; 4],
}

/// A shape fixed to a link.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PlacedShape {
    /// Pose in the link frame.
    #[serde(flatten)]
    pub pose: PoseDescription,
    /// The shape.
    pub shape: Shape,
    /// Coulomb friction coefficient.
    pub friction: f64,
}

/// An independent coordinate.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct CoordinateDescription {
    /// Name.
    pub name: String,
    /// Lower limit, rad or m; absent if unlimited.
    pub minimum: Option<f64>,
    /// Upper limit.
    pub maximum: Option<f64>,
    /// Its numbers.
    #[serde(flatten)]
    pub numbers: CoordinateNumbers,
}

/// A motor.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct MotorDescription {
    /// Name.
    pub name: String,
    /// Its numbers.
    #[serde(flatten)]
    pub numbers: MotorNumbers,
}

/// A tendon.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct TendonDescription {
    /// Name.
    pub name: String,
    /// Name of the motor that winds it; of several, the first; empty if there is none.
    pub motor: String,
    /// Weight of every motor that winds it, if these are not one motor of weight 1.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub motors: Vec<WeightDescription>,
    /// Wound length without the motors' part.
    #[serde(skip_serializing_if = "is_zero")]
    pub rest: f64,
    /// Its row of R at rest, one entry per coordinate.
    pub moment_arms: Vec<f64>,
    /// Elements whose moment arm depends on the configuration.
    pub elements: Vec<ElementDescription>,
    /// Its other numbers.
    #[serde(flatten)]
    pub numbers: TendonNumbers,
    /// Guides on which it rubs, from the motor outwards.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub guides: Vec<GuideDescription>,
}

/// A guide on which a tendon rubs.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct GuideDescription {
    /// Name of the coordinate at which it is.
    pub coordinate: String,
    /// Its numbers.
    #[serde(flatten)]
    pub numbers: GuideNumbers,
}

/// A part of a tendon whose moment arm depends on a coordinate.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ElementDescription {
    /// Name of the coordinate.
    pub coordinate: String,
    /// Path of the tendon over the joint.
    #[serde(flatten)]
    pub path: PathDescription,
}

/// Path of a tendon over a joint.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum PathDescription {
    /// Over two pulleys, one on either side of the joint.
    DaVinci(DaVinciGeometry),
    /// A polynomial of the coordinate.
    Polynomial(Polynomial),
    /// Measured lengths, and the natural cubic spline through them.
    Table(TablePoints),
    /// Straight from one eyelet to another.
    Eyelets(EyeletPositions),
}

/// Weight of a motor in a tendon's wound length.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct WeightDescription {
    /// Name of the motor.
    pub motor: String,
    /// Weight.
    pub weight: f64,
}

/// A spring across several joints.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SpringDescription {
    /// Name.
    pub name: String,
    /// Its row, one entry per coordinate.
    pub moment_arms: Vec<f64>,
    /// Its numbers.
    #[serde(flatten)]
    pub numbers: SpringNumbers,
}

/// A pin that closes a chain of links.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct LinkageDescription {
    /// Name.
    pub name: String,
    /// Names of the two links.
    pub links: [String; 2],
    /// The pin in the frame of each link, m.
    pub points: [[f64; 3]; 2],
    /// Its numbers.
    #[serde(flatten)]
    pub numbers: LinkageNumbers,
}

/// A tactile patch: a rectangle on a link, in the xy-plane of its frame, z outwards.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PatchDescription {
    /// Name.
    pub name: String,
    /// Name of its link.
    pub link: String,
    /// Its frame in the link frame: at the rectangle's centre.
    #[serde(flatten)]
    pub pose: PoseDescription,
    /// Extents along x and y, m.
    pub size: [f64; 2],
    /// Taxels along x and y, which divide it.
    pub taxels: [usize; 2],
}

/// One field of an action or an observation.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SpecDescription {
    /// Path of the field in the message.
    pub name: &'static str,
    /// Length.
    pub shape: [usize; 1],
    /// Unit.
    pub unit: &'static str,
    /// Smallest value of each entry; absent if unbounded.
    pub minimum: Vec<Option<f64>>,
    /// Largest value of each entry.
    pub maximum: Vec<Option<f64>>,
}

fn pose(p: &Pose) -> PoseDescription {
    PoseDescription { position: p.translation.to_array(), quat_xyzw: p.rotation.to_array() }
}

fn bound(x: f64) -> Option<f64> {
    x.is_finite().then_some(x)
}

impl Hand {
    /// Description of the hand for users.
    pub fn describe(&self) -> HandDescription {
        let mut rest: Vec<f64> = self.coordinates.iter().map(|c| c.rest).collect();
        self.close_chains(&mut rest);
        let base_from_links = self.base_from_links(&rest);
        HandDescription {
            name: self.name.clone(),
            description: self.description.clone(),
            mass: self.links.iter().map(|l| l.inertia.mass).sum(),
            links: (0..self.links.len()).map(|i| self.describe_link(i, &base_from_links[i])).collect(),
            coordinates: self
                .coordinates
                .iter()
                .map(|c| CoordinateDescription {
                    name: c.name.clone(),
                    minimum: bound(c.lower),
                    maximum: bound(c.upper),
                    numbers: c.numbers,
                })
                .collect(),
            motors: self
                .motors
                .iter()
                .map(|Motor { name, numbers }| MotorDescription { name: name.clone(), numbers: *numbers })
                .collect(),
            tendons: self.describe_tendons(&rest),
            springs: self.describe_springs(),
            linkages: self.describe_linkages(),
            fingers: self.fingers().into_iter().map(|finger| finger.name).collect(),
            tactile: self.describe_tactile(),
            sensors: self.sensors.clone(),
            gravity_compensation: self.gravity_compensation,
            start: (self.start != Start::default()).then(|| StartDescription {
                sigma: (0..self.motors.len()).map(|m| self.start.sigma_of(m)).collect(),
                joints: self.beginning(),
            }),
            uncertain: self.describe_uncertain(),
            specs: self.specs(),
        }
    }

    fn describe_uncertain(&self) -> Vec<UncertainDescription> {
        let describe = |entry: &Uncertain| {
            let names = self.names_of(entry.of.owner());
            let listed = if entry.everywhere { &[][..] } else { &entry.on };
            let (factor, value) = match entry.range {
                Range::Factor(ends) => (Some(ends), None),
                Range::Value(ends) => (None, Some(ends)),
            };
            UncertainDescription {
                name: entry.name.clone(),
                of: entry.of,
                on: listed.iter().map(|k| names[*k].to_owned()).collect(),
                factor,
                value,
            }
        };
        self.uncertain.iter().map(describe).collect()
    }

    fn describe_link(&self, i: usize, base_from_link: &Pose) -> LinkDescription {
        let link = &self.links[i];
        let hinges = link.joint.iter().flat_map(|j| &j.hinges).map(|h| HingeDescription {
            kind: match h.kind {
                HingeKind::Revolute => "revolute",
                HingeKind::Prismatic => "prismatic",
            },
            origin: pose(&h.parent_from_hinge),
            axis: h.axis.to_array(),
            ratio: h.ratio,
            offset: h.offset,
        });
        let shapes = link.geoms.iter().map(|g| PlacedShape {
            pose: pose(&g.link_from_geom),
            shape: g.shape.clone(),
            friction: g.friction,
        });
        LinkDescription {
            name: link.name.clone(),
            parent: link.parent.map(|p| self.links[p].name.clone()),
            coordinate: link.joint.as_ref().map(|j| self.coordinates[j.coordinate].name.clone()),
            hinges: hinges.collect(),
            mass: link.inertia.mass,
            com: link.inertia.com.to_array(),
            base_from_link_at_rest: pose(base_from_link),
            shapes: shapes.collect(),
        }
    }

    fn describe_tactile(&self) -> Vec<PatchDescription> {
        let describe = |patch: &TactilePatch| PatchDescription {
            name: patch.name.clone(),
            link: self.links[patch.link].name.clone(),
            pose: pose(&patch.link_from_patch),
            size: patch.half_size.map(|x| 2.0 * x),
            taxels: patch.taxels,
        };
        self.tactile.iter().map(describe).collect()
    }

    fn describe_tendons(&self, rest: &[f64]) -> Vec<TendonDescription> {
        let element = |e: &TendonElement| ElementDescription {
            coordinate: self.coordinates[e.coordinate].name.clone(),
            path: match &e.path {
                TendonPath::DaVinci(mechanism) => PathDescription::DaVinci(*mechanism.geometry()),
                TendonPath::Polynomial(polynomial) => PathDescription::Polynomial(polynomial.clone()),
                TendonPath::Table(table) => PathDescription::Table(table.points().clone()),
                TendonPath::Eyelets(eyelets) => PathDescription::Eyelets(*eyelets.positions()),
            },
        };
        let weight = |&(motor, weight): &(usize, f64)| WeightDescription {
            motor: self.motors[motor].name.clone(),
            weight,
        };
        let guide = |guide: &Guide| GuideDescription {
            coordinate: self.coordinates[guide.coordinate].name.clone(),
            numbers: guide.numbers,
        };
        let describe = |(t, row): (&Tendon, Vec<f64>)| TendonDescription {
            name: t.name.clone(),
            motor: t.motors.first().map_or(String::new(), |(motor, _)| self.motors[*motor].name.clone()),
            motors: match t.motors[..] {
                [(_, 1.0)] => Vec::new(),
                _ => t.motors.iter().map(weight).collect(),
            },
            rest: t.rest,
            moment_arms: row,
            elements: t.elements.iter().map(element).collect(),
            numbers: t.numbers,
            guides: t.guides.iter().map(guide).collect(),
        };
        self.tendons.iter().zip(self.moment_arms(rest)).map(describe).collect()
    }

    fn describe_springs(&self) -> Vec<SpringDescription> {
        let row = |arms: &[(usize, f64)]| {
            let mut row = vec![0.0; self.coordinates.len()];
            arms.iter().for_each(|&(c, r)| row[c] += r);
            row
        };
        let describe = |spring: &Spring| SpringDescription {
            name: spring.name.clone(),
            moment_arms: row(&spring.arms),
            numbers: spring.numbers,
        };
        self.springs.iter().map(describe).collect()
    }

    fn describe_linkages(&self) -> Vec<LinkageDescription> {
        let describe = |pin: &Linkage| LinkageDescription {
            name: pin.name.clone(),
            links: pin.links.map(|link| self.links[link].name.clone()),
            points: pin.points.map(|point| point.to_array()),
            numbers: pin.numbers,
        };
        self.linkages.iter().map(describe).collect()
    }

    fn specs(&self) -> Vec<SpecDescription> {
        let (motors, joints) = (self.motors.len(), self.coordinates.len());
        vec![
            SpecDescription {
                name: "action.hand",
                shape: [motors],
                unit: "1",
                minimum: vec![Some(0.0); motors],
                maximum: vec![Some(1.0); motors],
            },
            SpecDescription {
                name: "hand.joints.position",
                shape: [joints],
                unit: "rad",
                minimum: self.coordinates.iter().map(|c| bound(c.lower)).collect(),
                maximum: self.coordinates.iter().map(|c| bound(c.upper)).collect(),
            },
        ]
    }
}
