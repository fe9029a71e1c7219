//! `hand.toml`: everything that a URDF cannot express.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::limits::Limits;
use super::options::InertiaPolicy;
use super::per_joint::PerJoint;
use super::report::Report;
use super::servo_settings::{ServoJoints, ServoSettings};
use super::start_settings::{BaseSettings, StartSettings};
use super::uncertain::UncertainSettings;
use crate::hand::da_vinci::DaVinciGeometry;
use crate::hand::path::{EyeletPositions, Polynomial, TablePoints};
use crate::hand::{Motor, Pad, Sensors};

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
    /// Keeps an error for each number that is not finite, absurdly large or of the wrong sign. Nothing is computed from such a number: a
    /// plain one takes its place, so that names and other files can be checked in the same run.
    pub(crate) fn check(&mut self, limits: &Limits, at: &Report) {
        let check = |element: &str, what: &str, value: Option<f64>, most: f64, sign: Sign| -> bool {
            let Some(value) = value else { return true };
            let allowed = at.number(|| element.to_owned(), what, value, most).and_then(|()| {
                let valid = || format!("{what} {}", sign.words());
                let wrong = || at.bad(element, format!("has {what} {value}"), valid());
                if sign.allows(value) { Ok(()) } else { Err(wrong()) }
            });
            at.keep(allowed).is_some()
        };
        let most = limits.number;
        if !check("settings", "friction", self.friction, most, Sign::NotNegative) {
            self.friction = None;
        }
        for (name, m) in &mut self.motors {
            let table = format!("[motors.{name}]");
            let sound = [
                check(&table, "scaling", Some(m.scaling), most, Sign::NotZero),
                check(&table, "offset", Some(m.offset), most, Sign::Any),
                check(&table, "speed_limit", Some(m.speed_limit), most, Sign::Positive),
                check(&table, "stall_force", m.stall_force, most, Sign::Positive),
                check(&table, "power_limit", m.power_limit, most, Sign::Positive),
            ];
            if sound.contains(&false) {
                *m = MotorSettings::plain(1.0, 0.0, 1.0);
            }
        }
        for (name, t) in &mut self.tendons {
            let table = format!("[tendons.{name}]");
            let sound = [
                check(&table, "stiffness", Some(t.stiffness), most, Sign::Positive),
                check(&table, "damping", Some(t.damping), most, Sign::NotNegative),
                check(&table, "force_limit", Some(t.force_limit), most, Sign::Positive),
                check(&table, "rest", Some(t.rest), most, Sign::Any),
                check(&table, "hold_limit", t.hold_limit, most, Sign::Positive),
            ];
            if sound.contains(&false) {
                (t.stiffness, t.damping, t.force_limit, t.rest) = (1.0, 0.0, 1.0, 0.0);
                t.hold_limit = t.hold_limit.map(|_| 1.0);
            }
            for (motor, weight) in t.motors.iter_mut().flatten() {
                if !check(&table, &format!("motors.{motor}"), Some(*weight), most, Sign::NotZero) {
                    *weight = 1.0;
                }
            }
            for (joint, arm) in &mut t.joints {
                if !check(&table, &format!("joints.{joint}"), Some(*arm), most, Sign::NotZero) {
                    *arm = 1.0;
                }
            }
            for (field, value) in [("friction", &mut t.friction), ("wrap_angle", &mut t.wrap_angle)] {
                let numbers = value.iter_mut().flat_map(PerJoint::numbers);
                for (joint, x) in numbers {
                    let what = joint.map_or_else(|| field.to_owned(), |joint| format!("{field}.{joint}"));
                    if !check(&table, &what, Some(*x), most, Sign::NotNegative) {
                        *x = 0.0;
                    }
                }
            }
            let all = |kind: &str, joint: &str, numbers: &[f64], most: f64| {
                let what = format!("{kind}.{joint}");
                // One error for each path.
                numbers.iter().all(|x| check(&table, &what, Some(*x), most, Sign::Any))
            };
            for (joint, g) in &mut t.da_vinci {
                let numbers = [g.r0, g.r1, g.r2, g.a1, g.b1, g.l1, g.a2, g.b2];
                if !all("da_vinci", joint, &numbers, limits.length_m) {
                    *g = PLAIN_PULLEYS;
                }
            }
            for (joint, path) in &mut t.polynomial {
                if !all("polynomial", joint, &path.coefficients, most) {
                    path.coefficients = vec![1.0];
                }
            }
            for (joint, path) in &mut t.table {
                if !all("table", joint, &path.at, most) || !all("table", joint, &path.length, most) {
                    *path = TablePoints { at: vec![0.0, 1.0], length: vec![0.0, 1.0] };
                }
            }
            for (joint, path) in &mut t.eyelets {
                let numbers = [path.before, path.after];
                if !all("eyelets", joint, numbers.as_flattened(), limits.length_m) {
                    *path = EyeletPositions { before: [1.0, 0.0], after: [2.0, 0.0] };
                }
            }
        }
        for (name, s) in &mut self.springs {
            let table = format!("[springs.{name}]");
            let sound = [
                check(&table, "stiffness", Some(s.stiffness), most, Sign::Positive),
                check(&table, "damping", Some(s.damping), most, Sign::NotNegative),
                check(&table, "rest", Some(s.rest), most, Sign::Any),
            ];
            if sound.contains(&false) {
                (s.stiffness, s.damping, s.rest) = (1.0, 0.0, 0.0);
            }
            for (joint, arm) in &mut s.joints {
                if !check(&table, &format!("joints.{joint}"), Some(*arm), most, Sign::NotZero) {
                    *arm = 1.0;
                }
            }
        }
        for (name, pin) in &mut self.linkages {
            let table = format!("[linkages.{name}]");
            let mut points = pin.points.iter().flatten();
            let sound = [
                check(&table, "stiffness", Some(pin.stiffness), most, Sign::Positive),
                check(&table, "damping", Some(pin.damping), most, Sign::NotNegative),
                points.all(|x| check(&table, "points", Some(*x), limits.length_m, Sign::Any)),
            ];
            if sound.contains(&false) {
                (pin.points, pin.stiffness, pin.damping) = ([[0.0; 3]; 2], 1.0, 0.0);
            }
        }
        let every = [("[every_coordinate]".to_owned(), &mut self.every_coordinate)];
        let each = self.coordinates.iter_mut().map(|(name, c)| (format!("[coordinates.{name}]"), c));
        for (table, c) in each.chain(every) {
            let sound = [
                check(&table, "stiffness", c.stiffness, most, Sign::NotNegative),
                check(&table, "damping", c.damping, most, Sign::NotNegative),
                check(&table, "rest", c.rest, most, Sign::Any),
                check(&table, "friction", c.friction, most, Sign::NotNegative),
            ];
            if sound.contains(&false) {
                *c = CoordinateSettings::default();
            }
        }
        at.keep(self.servo_joints.as_ref().map_or(Ok(()), |joints| joints.check(at)));
        let every = [("[every_servo]".to_owned(), &mut self.every_servo)];
        let each = self.servos.iter_mut().map(|(name, s)| (format!("[servos.{name}]"), s));
        for (table, s) in each.chain(every) {
            let mut ends = s.range.into_iter().flatten();
            let difference = s.range.map(|[a, b]| b - a);
            let sound = [
                check(&table, "effort", s.effort, most, Sign::Positive),
                check(&table, "velocity", s.velocity, most, Sign::Positive),
                check(&table, "stiffness", s.stiffness, most, Sign::Positive),
                check(&table, "damping", s.damping, most, Sign::NotNegative),
                ends.all(|x| check(&table, "range", Some(x), most, Sign::Any))
                    && check(&table, "range, end minus begin,", difference, most, Sign::NotZero),
            ];
            if sound.contains(&false) {
                // A stated effort or velocity needs none of the URDF.
                *s = ServoSettings {
                    effort: s.effort.map(|_| 1.0),
                    velocity: s.velocity.map(|_| 1.0),
                    ..ServoSettings::default()
                };
            }
        }
        let base = &mut self.base;
        for (field, x) in base.numbers() {
            if !check("[base]", field, Some(x), limits.length_m, Sign::Any) {
                *base = BaseSettings { link: base.link.take(), ..BaseSettings::default() };
                break;
            }
        }
        let start = &mut self.start;
        if !check("[start]", "sigma", start.sigma, most, Sign::Part) {
            start.sigma = None;
        }
        for (motor, sigma) in &mut start.motors {
            if !check("[start]", &format!("motors.{motor}"), Some(*sigma), most, Sign::Part) {
                *sigma = 0.0;
            }
        }
        for (joint, q) in &mut start.joints {
            if !check("[start]", &format!("joints.{joint}"), Some(*q), most, Sign::Any) {
                // Within the limits of every joint.
                *q = f64::NAN;
            }
        }
        for (name, l) in &mut self.links {
            let table = format!("[links.{name}]");
            let pad = l.pad.map(|pad| (pad.thickness, Some(pad.modulus)));
            let (thickness, modulus) = pad.unwrap_or_default();
            let sound = [
                check(&table, "mass", l.mass, limits.mass_kg, Sign::NotNegative),
                check(&table, "rounding", l.rounding, limits.length_m, Sign::NotNegative),
                check(&table, "mesh_rounding", l.mesh_rounding, limits.length_m, Sign::NotNegative),
                check(&table, "friction", l.friction, most, Sign::NotNegative),
                check(&table, "pad.thickness", thickness, limits.length_m, Sign::Positive),
                check(&table, "pad.modulus", modulus, MAX_MODULUS, Sign::Positive),
            ];
            if sound.contains(&false) {
                *l = LinkSettings::default();
            }
        }
        for patches in &mut self.tactile {
            let element = format!("tactile '{}'", patches.name);
            let sound = |x| check(&element, "size or centers", Some(x), limits.length_m, Sign::Any);
            if !patches.lengths().all(sound) {
                patches.size = [1.0; 2];
                patches.centers.fill([0.0; 3]);
            }
        }
        let sensors = self.sensors.check();
        at.keep(sensors.map_err(|problem| at.bad("[sensors]", problem, "numbers in their ranges")));
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
        let mut state = |table: String, field: &'static str, value: Option<f64>| {
            stated.extend(value.map(|value| ((table, field), value)));
        };
        state("friction".to_owned(), "friction", self.friction);
        let every = ("[every_coordinate]".to_owned(), &self.every_coordinate);
        let each = self.coordinates.iter().map(|(name, c)| (format!("[coordinates.{name}]"), c));
        for (table, c) in each.chain([every]) {
            state(table.clone(), "stiffness", c.stiffness);
            state(table.clone(), "damping", c.damping);
            state(table.clone(), "rest", c.rest);
            state(table, "friction", c.friction);
        }
        for (name, l) in &self.links {
            state(format!("[links.{name}]"), "mass", l.mass);
            state(format!("[links.{name}]"), "friction", l.friction);
        }
        for (name, t) in &self.tendons {
            state(format!("[tendons.{name}]"), "stiffness", Some(t.stiffness));
        }
        for (name, s) in &self.servos {
            state(format!("[servos.{name}]"), "stiffness", s.stiffness);
        }
        for (name, m) in &self.motors {
            state(format!("[motors.{name}]"), "scaling", Some(m.scaling));
        }
        stated
    }
}

/// Takes the place of pulleys with an invalid number.
const PLAIN_PULLEYS: DaVinciGeometry =
    DaVinciGeometry { r0: 1.0, r1: 0.0, r2: 0.0, a1: 0.0, b1: 0.0, l1: 2.0, a2: 1.0, b2: 0.0 };

/// Largest modulus, Pa: diamond has 1.2e12.
const MAX_MODULUS: f64 = 1e13;

/// Valid range of a field.
#[derive(Clone, Copy)]
enum Sign {
    Any,
    Positive,
    NotNegative,
    NotZero,
    /// From 0 to 1.
    Part,
}

impl Sign {
    fn allows(self, value: f64) -> bool {
        match self {
            Sign::Any => true,
            Sign::Positive => value > 0.0,
            Sign::NotNegative => value >= 0.0,
            Sign::NotZero => value != 0.0,
            Sign::Part => (0.0..=1.0).contains(&value),
        }
    }

    fn words(self) -> &'static str {
        match self {
            Sign::Any => "",
            Sign::Positive => "of more than 0",
            Sign::NotNegative => "of at least 0",
            Sign::NotZero => "other than 0",
            Sign::Part => "from 0 to 1",
        }
    }
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MotorSettings {
    pub(crate) scaling: f64,
    #[serde(default)]
    pub(crate) offset: f64,
    /// 1/s
    pub(crate) speed_limit: f64,
    /// Load at which it stands still.
    pub(crate) stall_force: Option<f64>,
    /// W
    pub(crate) power_limit: Option<f64>,
}

impl MotorSettings {
    /// A motor that no load slows.
    pub(crate) const fn plain(scaling: f64, offset: f64, speed_limit: f64) -> Self {
        MotorSettings { scaling, offset, speed_limit, stall_force: None, power_limit: None }
    }

    /// The motor of that name.
    pub(crate) fn motor(&self, name: &str) -> Motor {
        let MotorSettings { scaling, offset, speed_limit, stall_force, power_limit } = *self;
        Motor { name: name.to_owned(), scaling, offset, speed_limit, stall_force, power_limit }
    }
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TendonSettings {
    pub(crate) stiffness: f64,
    #[serde(default)]
    pub(crate) damping: f64,
    pub(crate) force_limit: f64,
    /// Whether it pushes as well as pulls.
    #[serde(default)]
    pub(crate) both_ways: bool,
    /// Largest tension that it holds where no load turns it back.
    pub(crate) hold_limit: Option<f64>,
    /// Whether a clutch lets go at the force limit.
    #[serde(default)]
    pub(crate) breakaway: bool,
    /// Motors that wind it, each with its weight, instead of the transmission's actuator.
    pub(crate) motors: Option<BTreeMap<String, f64>>,
    /// Wound length without the motors' part.
    #[serde(default)]
    pub(crate) rest: f64,
    /// Its row of R by name of the URDF's joint, for a tendon without a transmission.
    #[serde(default)]
    pub(crate) joints: BTreeMap<String, f64>,
    /// Joints it passes by a Da Vinci mechanism, by name of the URDF's joint.
    #[serde(default)]
    pub(crate) da_vinci: BTreeMap<String, DaVinciGeometry>,
    /// Joints at which its length is a polynomial.
    #[serde(default)]
    pub(crate) polynomial: BTreeMap<String, Polynomial>,
    /// Joints at which its length was measured.
    #[serde(default)]
    pub(crate) table: BTreeMap<String, TablePoints>,
    /// Joints that it crosses straight, from eyelet to eyelet.
    #[serde(default)]
    pub(crate) eyelets: BTreeMap<String, EyeletPositions>,
    /// Joints in the order in which the cable passes them, from the motor outwards.
    pub(crate) routing: Option<Vec<String>>,
    /// Friction of the cable at its guides, and the angles, rad, by which it wraps around them.
    pub(crate) friction: Option<PerJoint>,
    pub(crate) wrap_angle: Option<PerJoint>,
}

impl TendonSettings {
    /// Its paths that are not linear: their kind, and the joint that they cross.
    pub(crate) fn paths(&self) -> impl Iterator<Item = (&'static str, &String)> {
        let da_vinci = self.da_vinci.keys().map(|joint| ("da_vinci", joint));
        let polynomial = self.polynomial.keys().map(|joint| ("polynomial", joint));
        let table = self.table.keys().map(|joint| ("table", joint));
        let eyelets = self.eyelets.keys().map(|joint| ("eyelets", joint));
        da_vinci.chain(polynomial).chain(table).chain(eyelets)
    }

    /// Whether it states moment arms of its own.
    pub(crate) fn has_arms(&self) -> bool {
        !self.joints.is_empty() || self.paths().next().is_some()
    }

    fn names_joint(&self, joint: &str) -> bool {
        self.joints.contains_key(joint) || self.paths().any(|(_, name)| name == joint)
    }
}

/// A spring across several joints.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SpringSettings {
    /// Its row by name of the URDF's joint.
    pub(crate) joints: BTreeMap<String, f64>,
    pub(crate) stiffness: f64,
    #[serde(default)]
    pub(crate) damping: f64,
    #[serde(default)]
    pub(crate) rest: f64,
}

/// A pin between two links.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LinkageSettings {
    /// Names of URDF links.
    #[serde(deserialize_with = "crate::exact::array")]
    pub(crate) links: [String; 2],
    /// Position of the pin in each link's frame, m.
    #[serde(deserialize_with = "crate::exact::arrays")]
    pub(crate) points: [[f64; 3]; 2],
    /// N/m
    #[serde(default = "pin_stiffness")]
    pub(crate) stiffness: f64,
    /// N·s/m
    #[serde(default)]
    pub(crate) damping: f64,
}

/// A pin of 1e6 N/m gives way by 0.1 mm at 100 N.
fn pin_stiffness() -> f64 {
    1e6
}

/// Overrides of what the URDF says.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CoordinateSettings {
    /// N·m/rad
    pub(crate) stiffness: Option<f64>,
    /// N·m·s/rad
    pub(crate) damping: Option<f64>,
    /// rad
    pub(crate) rest: Option<f64>,
    /// Dry friction, N·m or N.
    pub(crate) friction: Option<f64>,
}

#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LinkSettings {
    /// kg; the inertia then comes from the geometry.
    pub(crate) mass: Option<f64>,
    /// Edge radius of the link's boxes, m; URDF boxes are sharp.
    pub(crate) rounding: Option<f64>,
    /// Edge radius of the hulls of the link's meshes, m; 0 keeps their corners.
    pub(crate) mesh_rounding: Option<f64>,
    pub(crate) friction: Option<f64>,
    /// Softness of its surface.
    pub(crate) pad: Option<Pad>,
}

/// Tactile patches of one size on one flat surface.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TactileSettings {
    /// The patch's name; several patches get this name and their number, from 1 on.
    pub(crate) name: String,
    /// URDF link whose frame the vectors are in.
    pub(crate) link: String,
    /// Direction of the patches' first extent.
    #[serde(deserialize_with = "crate::exact::array")]
    pub(crate) along: [f64; 3],
    /// Direction out of the hand.
    #[serde(deserialize_with = "crate::exact::array")]
    pub(crate) normal: [f64; 3],
    /// Extents along `along` and across it, m.
    #[serde(deserialize_with = "crate::exact::array")]
    pub(crate) size: [f64; 2],
    /// Centre of each patch, m.
    #[serde(deserialize_with = "crate::exact::list")]
    pub(crate) centers: Vec<[f64; 3]>,
    /// Number of taxels of each patch along its extents.
    #[serde(default = "one_taxel", deserialize_with = "crate::exact::array")]
    pub(crate) taxels: [usize; 2],
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

    /// Every length in it.
    fn lengths(&self) -> impl Iterator<Item = f64> {
        self.size.iter().copied().chain(self.centers.iter().flatten().copied())
    }
}
