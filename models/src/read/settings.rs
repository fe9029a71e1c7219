//! `hand.toml`: everything that a URDF cannot express.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::limits::Limits;
use super::options::InertiaPolicy;
use super::report::Report;
use super::servo_settings::{ServoJoints, ServoSettings};
use super::start_settings::{BaseSettings, StartSettings};
use super::uncertain::UncertainSettings;
use crate::hand::linkage::LinkageSettings;
use crate::hand::number::{Bounds, Number, Table, Unstated, table};
use crate::hand::spring::SpringSettings;
use crate::hand::tendon::TendonSettings;
use crate::hand::{CoordinateSettings, MotorSettings, Pad, Sensors};

/// The file next to a URDF. Every field is optional.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Settings {
    /// Replaces the URDF's robot name.
    pub(crate) name: Option<String>,
    pub(crate) description: Option<String>,
    pub(crate) gravity_compensation: Option<bool>,
    /// Coulomb friction coefficient of every surface that `[links]` does not name.
    pub(crate) friction: Option<f64>,
    pub(crate) inertia: Option<InertiaPolicy>,
    /// By name of the URDF's actuator.
    #[serde(default)]
    pub(crate) motors: BTreeMap<String, MotorSettings>,
    /// By name of the URDF's transmission.
    #[serde(default)]
    pub(crate) tendons: BTreeMap<String, TendonSettings>,
    /// Pairs of URDF links that never touch each other.
    #[serde(default, deserialize_with = "crate::exact::list")]
    pub(crate) no_collision: Vec<[String; 2]>,
    /// Springs across several joints.
    #[serde(default)]
    pub(crate) springs: BTreeMap<String, SpringSettings>,
    /// Pins that close chains of links.
    #[serde(default)]
    pub(crate) linkages: BTreeMap<String, LinkageSettings>,
    /// Values for every coordinate that `[coordinates]` does not name.
    #[serde(default)]
    pub(crate) every_coordinate: CoordinateSettings,
    /// By name of the URDF's joint.
    #[serde(default)]
    pub(crate) coordinates: BTreeMap<String, CoordinateSettings>,
    /// By name of the URDF's link.
    #[serde(default)]
    pub(crate) links: BTreeMap<String, LinkSettings>,
    /// Joints that a servo of their own drives.
    pub(crate) servo_joints: Option<ServoJoints>,
    /// Values for every servo that `[servos]` does not name.
    #[serde(default)]
    pub(crate) every_servo: ServoSettings,
    /// By name of the URDF's joint; each has a servo.
    #[serde(default)]
    pub(crate) servos: BTreeMap<String, ServoSettings>,
    #[serde(default)]
    pub(crate) base: BaseSettings,
    #[serde(default)]
    pub(crate) start: StartSettings,
    /// Numbers that are known as ranges, by the author's name for each.
    #[serde(default)]
    pub(crate) uncertain: BTreeMap<String, UncertainSettings>,
    #[serde(default)]
    pub(crate) tactile: Vec<TactileSettings>,
    #[serde(default)]
    pub(crate) sensors: Sensors,
}

impl Settings {
    /// Keeps an error for each number that is missing, not finite, absurdly large or out of its range. Returns whether all are valid:
    /// only then is the hand built. Links are read in either case, so that the same run checks their meshes; it ignores an invalid table
    /// of a link or of the base.
    pub(crate) fn check(&mut self, limits: &Limits, at: &Report) -> bool {
        let before = at.kept();
        let friction = Number { bounds: Bounds::NotNegative, ..Number::OF_TABLE };
        check_number("settings", &friction, "friction", self.friction, limits, at);
        fn all<T: Table>(kind: &str, tables: &BTreeMap<String, T>, limits: &Limits, at: &Report) {
            for (name, table) in tables {
                check(&format!("[{kind}.{name}]"), table, limits, at);
            }
        }
        all("motors", &self.motors, limits, at);
        all("tendons", &self.tendons, limits, at);
        all("springs", &self.springs, limits, at);
        all("linkages", &self.linkages, limits, at);
        all("coordinates", &self.coordinates, limits, at);
        check("[every_coordinate]", &self.every_coordinate, limits, at);
        at.keep(self.servo_joints.as_ref().map_or(Ok(()), |joints| joints.check(at)));
        all("servos", &self.servos, limits, at);
        check("[every_servo]", &self.every_servo, limits, at);
        if !check("[base]", &self.base, limits, at) {
            self.base = BaseSettings { link: self.base.link.take(), ..BaseSettings::default() };
        }
        check("[start]", &self.start, limits, at);
        for (name, link) in &mut self.links {
            if !check(&format!("[links.{name}]"), link, limits, at) {
                *link = LinkSettings::default();
            }
        }
        for patches in &self.tactile {
            check(&format!("tactile '{}'", patches.name), patches, limits, at);
        }
        let sensors = self.sensors.check();
        at.keep(sensors.map_err(|problem| at.bad("[sensors]", problem, "numbers in their ranges")));
        at.kept() == before
    }

    /// Whether a tendon or a spring acts on the joint of this name.
    pub(crate) fn names_joint(&self, joint: &str) -> bool {
        self.tendons.values().any(|tendon| tendon.names_joint(joint))
            || self.springs.values().any(|spring| spring.joints.contains_key(joint))
            || self.servos.contains_key(joint)
            || self
                .servo_joints
                .as_ref()
                .is_some_and(|listed| listed.names().iter().any(|name| name == joint))
    }

    /// Whether a pin is on the link of this name.
    pub(crate) fn names_pin_at(&self, link: &str) -> bool {
        self.linkages.values().any(|pin| pin.links.iter().any(|name| name == link))
    }

    /// Its numbers by table and field: `[links.palm]`, `friction`.
    pub(crate) fn stated(&self) -> BTreeMap<(String, &'static str), f64> {
        let mut stated = BTreeMap::new();
        stated.extend(self.friction.map(|friction| (("friction".to_owned(), "friction"), friction)));
        let mut state = |element: String, table: &dyn Table| {
            table.visit(&mut |number, _, value| {
                stated.extend(value.map(|value| ((element.clone(), number.name), value)));
            });
        };
        self.motors.iter().for_each(|(name, motor)| state(format!("[motors.{name}]"), motor));
        self.tendons.iter().for_each(|(name, tendon)| state(format!("[tendons.{name}]"), tendon));
        self.coordinates.iter().for_each(|(name, own)| state(format!("[coordinates.{name}]"), own));
        self.links.iter().for_each(|(name, link)| state(format!("[links.{name}]"), link));
        state("[every_coordinate]".to_owned(), &self.every_coordinate);
        stated
    }
}

/// Largest modulus, Pa: diamond has 1.2e12.
const MAX_MODULUS: f64 = 1e13;

/// Keeps an error for each invalid number of a table, but only for the first of a list. Returns whether all are valid.
fn check(element: &str, table: &impl Table, limits: &Limits, at: &Report) -> bool {
    let mut wrong: Vec<String> = Vec::new();
    table.visit(&mut |number, name, value| {
        if wrong.last().is_none_or(|last| last != name)
            && !check_number(element, number, name, value, limits, at)
        {
            wrong.push(name.to_owned());
        }
    });
    wrong.is_empty()
}

/// Keeps an error for an invalid number. Returns whether it is valid.
fn check_number(
    element: &str,
    number: &Number,
    name: &str,
    value: Option<f64>,
    limits: &Limits,
    at: &Report,
) -> bool {
    let valid = || format!("{name} {}", number.bounds.words());
    let most = match number.unit {
        "m" => limits.length_m,
        "kg" => limits.mass_kg,
        "Pa" => MAX_MODULUS,
        _ => limits.number,
    };
    let checked = match value {
        None if number.unstated == Unstated::Refused => {
            Err(at.bad(element, format!("missing field `{name}`"), valid()))
        }
        None => Ok(()),
        Some(value) => at.number(|| element.to_owned(), name, value, most).and_then(|()| {
            let wrong = || at.bad(element, format!("has {name} {value}"), valid());
            if number.bounds.allows(value) { Ok(()) } else { Err(wrong()) }
        }),
    };
    at.keep(checked).is_some()
}

table! {
    /// An entry of `[links]`.
    #[derive(Default)]
    pub(crate) table LinkSettings;
    /// kg; the inertia then comes from the geometry.
    mass: Option<f64> = Number { unit: "kg", bounds: Bounds::NotNegative, ..Number::OF_TABLE },
    /// Edge radius of the link's boxes, m; URDF boxes are sharp.
    rounding: Option<f64> = Number { unit: "m", bounds: Bounds::NotNegative, ..Number::OF_TABLE },
    /// Edge radius of the hulls of the link's meshes, m; 0 keeps their corners.
    mesh_rounding: Option<f64> = Number { unit: "m", bounds: Bounds::NotNegative, ..Number::OF_TABLE },
    /// Coulomb coefficient.
    friction: Option<f64> = Number { unit: "1", bounds: Bounds::NotNegative, ..Number::OF_TABLE },
    /// Softness of its surface.
    pad: Option<Pad> = Number::OF_TABLE,
}

table! {
    /// Tactile patches of one size on one flat surface.
    pub(crate) table TactileSettings;
    /// The patch's name; several patches get this name and their number, from 1 on.
    name: String = Number::OF_TABLE,
    /// URDF link whose frame the vectors are in.
    link: String = Number::OF_TABLE,
    /// Direction of the patches' first extent.
    #[serde(deserialize_with = "crate::exact::array")]
    along: [f64; 3] = Number::OF_TABLE,
    /// Direction out of the hand.
    #[serde(deserialize_with = "crate::exact::array")]
    normal: [f64; 3] = Number::OF_TABLE,
    /// Extents along `along` and across it, m.
    #[serde(deserialize_with = "crate::exact::array")]
    size: [f64; 2] = Number { unit: "m", ..Number::OF_TABLE },
    /// Centre of each patch, m.
    #[serde(deserialize_with = "crate::exact::list")]
    centers: Vec<[f64; 3]> = Number { unit: "m", ..Number::OF_TABLE },
    /// Number of taxels of each patch along its extents.
    #[serde(default = "one_taxel", deserialize_with = "crate::exact::array")]
    taxels: [usize; 2] = Number::OF_TABLE,
}

fn one_taxel() -> [usize; 2] {
    [1, 1]
}

impl TactileSettings {
    /// Total number of taxels of its patches.
    pub(crate) fn taxels(&self) -> usize {
        let [nx, ny] = self.taxels;
        self.centers.len().saturating_mul(nx).saturating_mul(ny)
    }
}
