//! `hand.toml`: everything that a URDF cannot express.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::limits::Limits;
use super::options::InertiaPolicy;
use super::report::Report;
use super::servo_settings::{ServoJoints, ServoSettings};
use super::start_settings::{BaseSettings, StartSettings};
use crate::error::ModelError;
use crate::hand::da_vinci::DaVinciGeometry;
use crate::hand::path::{EyeletPositions, Polynomial, TablePoints};
use crate::hand::{Pad, Sensors};

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
    #[serde(default)]
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
    #[serde(default)]
    pub(crate) tactile: Vec<TactileSettings>,
    #[serde(default)]
    pub(crate) sensors: Sensors,
}

impl Settings {
    /// Rejects numbers that are not finite, absurdly large or of the wrong sign, before anything is computed
    /// from them.
    pub(crate) fn check(&self, limits: &Limits, at: &Report) -> Result<(), ModelError> {
        let check = |table: &str, name: &str, what: &str, value: Option<f64>, most: f64, sign: Sign| {
            let Some(value) = value else { return Ok(()) };
            let element = || if name.is_empty() { table.to_owned() } else { format!("[{table}.{name}]") };
            let allowed = at.number(element, what, value, most).and_then(|()| {
                let wrong =
                    || at.bad(element(), format!("has {what} {value}"), format!("{what} {}", sign.words()));
                if sign.allows(value) { Ok(()) } else { Err(wrong()) }
            });
            // The other numbers are checked, too.
            at.keep(allowed);
            Ok::<(), ModelError>(())
        };
        let most = limits.number;
        check("settings", "", "friction", self.friction, most, Sign::NotNegative)?;
        for (name, m) in &self.motors {
            check("motors", name, "scaling", Some(m.scaling), most, Sign::NotZero)?;
            check("motors", name, "offset", Some(m.offset), most, Sign::Any)?;
            check("motors", name, "speed_limit", Some(m.speed_limit), most, Sign::Positive)?;
        }
        for (name, t) in &self.tendons {
            check("tendons", name, "stiffness", Some(t.stiffness), most, Sign::Positive)?;
            check("tendons", name, "damping", Some(t.damping), most, Sign::NotNegative)?;
            check("tendons", name, "force_limit", Some(t.force_limit), most, Sign::Positive)?;
            for (joint, g) in &t.da_vinci {
                let what = format!("da_vinci.{joint}");
                for x in [g.r0, g.r1, g.r2, g.a1, g.b1, g.l1, g.a2, g.b2] {
                    check("tendons", name, &what, Some(x), limits.length_m, Sign::Any)?;
                }
            }
            check("tendons", name, "rest", Some(t.rest), most, Sign::Any)?;
            check("tendons", name, "hold_limit", t.hold_limit, most, Sign::Positive)?;
            for (motor, weight) in t.motors.iter().flatten() {
                check("tendons", name, &format!("motors.{motor}"), Some(*weight), most, Sign::NotZero)?;
            }
            for (joint, arm) in &t.joints {
                check("tendons", name, &format!("joints.{joint}"), Some(*arm), most, Sign::NotZero)?;
            }
            for (joint, path) in &t.polynomial {
                for c in &path.coefficients {
                    check("tendons", name, &format!("polynomial.{joint}"), Some(*c), most, Sign::Any)?;
                }
            }
            for (joint, path) in &t.table {
                for x in path.at.iter().chain(&path.length) {
                    check("tendons", name, &format!("table.{joint}"), Some(*x), most, Sign::Any)?;
                }
            }
            for (joint, path) in &t.eyelets {
                for x in path.before.iter().chain(&path.after) {
                    check(
                        "tendons",
                        name,
                        &format!("eyelets.{joint}"),
                        Some(*x),
                        limits.length_m,
                        Sign::Any,
                    )?;
                }
            }
        }
        for (name, s) in &self.springs {
            check("springs", name, "stiffness", Some(s.stiffness), most, Sign::Positive)?;
            check("springs", name, "damping", Some(s.damping), most, Sign::NotNegative)?;
            check("springs", name, "rest", Some(s.rest), most, Sign::Any)?;
            for (joint, arm) in &s.joints {
                check("springs", name, &format!("joints.{joint}"), Some(*arm), most, Sign::NotZero)?;
            }
        }
        for (name, pin) in &self.linkages {
            check("linkages", name, "stiffness", Some(pin.stiffness), most, Sign::Positive)?;
            check("linkages", name, "damping", Some(pin.damping), most, Sign::NotNegative)?;
            for x in pin.points.iter().flatten() {
                check("linkages", name, "points", Some(*x), limits.length_m, Sign::Any)?;
            }
        }
        let every = [("every", &self.every_coordinate)];
        let coordinates = self.coordinates.iter().map(|(name, c)| (name.as_str(), c));
        for (name, c) in coordinates.chain(every) {
            check("coordinates", name, "stiffness", c.stiffness, most, Sign::NotNegative)?;
            check("coordinates", name, "damping", c.damping, most, Sign::NotNegative)?;
            check("coordinates", name, "rest", c.rest, most, Sign::Any)?;
        }
        at.keep(self.servo_joints.as_ref().map_or(Ok(()), |joints| joints.check(at)));
        let servos = self.servos.iter().map(|(name, s)| (name.as_str(), s));
        for (name, s) in servos.chain([("every", &self.every_servo)]) {
            check("servos", name, "effort", s.effort, most, Sign::Positive)?;
            check("servos", name, "velocity", s.velocity, most, Sign::Positive)?;
            check("servos", name, "stiffness", s.stiffness, most, Sign::Positive)?;
            check("servos", name, "damping", s.damping, most, Sign::NotNegative)?;
            for x in s.range.into_iter().flatten() {
                check("servos", name, "range", Some(x), most, Sign::Any)?;
            }
            check(
                "servos",
                name,
                "range, end minus begin,",
                s.range.map(|[a, b]| b - a),
                most,
                Sign::NotZero,
            )?;
        }
        for x in self.base.numbers() {
            check("[base]", "", "a number", Some(x), limits.length_m, Sign::Any)?;
        }
        let starts =
            self.start.motors.values().chain(self.start.joints.values()).copied().chain(self.start.sigma);
        for x in starts {
            check("[start]", "", "a number", Some(x), most, Sign::Any)?;
        }
        for (name, l) in &self.links {
            check("links", name, "mass", l.mass, limits.mass_kg, Sign::NotNegative)?;
            check("links", name, "rounding", l.rounding, limits.length_m, Sign::NotNegative)?;
            check("links", name, "mesh_rounding", l.mesh_rounding, limits.length_m, Sign::NotNegative)?;
            check("links", name, "friction", l.friction, most, Sign::NotNegative)?;
            if let Some(Pad { thickness, modulus }) = l.pad {
                check("links", name, "pad.thickness", thickness, limits.length_m, Sign::Positive)?;
                check("links", name, "pad.modulus", Some(modulus), MAX_MODULUS, Sign::Positive)?;
            }
        }
        for patches in &self.tactile {
            for x in patches.lengths() {
                check("tactile", &patches.name, "size or centers", Some(x), limits.length_m, Sign::Any)?;
            }
        }
        self.sensors.check().map_err(|problem| at.bad("[sensors]", problem, "numbers in their ranges"))?;
        Ok(())
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
        state("settings".to_owned(), "friction", self.friction);
        let every = ("[every_coordinate]".to_owned(), &self.every_coordinate);
        let each = self.coordinates.iter().map(|(name, c)| (format!("[coordinates.{name}]"), c));
        for (table, c) in each.chain([every]) {
            state(table.clone(), "stiffness", c.stiffness);
            state(table.clone(), "damping", c.damping);
            state(table, "rest", c.rest);
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

/// Largest modulus, Pa: diamond has 1.2e12.
const MAX_MODULUS: f64 = 1e13;

/// Valid range of a field.
#[derive(Clone, Copy)]
enum Sign {
    Any,
    Positive,
    NotNegative,
    NotZero,
}

impl Sign {
    fn allows(self, value: f64) -> bool {
        match self {
            Sign::Any => true,
            Sign::Positive => value > 0.0,
            Sign::NotNegative => value >= 0.0,
            Sign::NotZero => value != 0.0,
        }
    }

    fn words(self) -> &'static str {
        match self {
            Sign::Any => "",
            Sign::Positive => "of more than 0",
            Sign::NotNegative => "of at least 0",
            Sign::NotZero => "other than 0",
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
}

impl TendonSettings {
    /// Whether it states moment arms of its own.
    pub(crate) fn has_arms(&self) -> bool {
        let paths = self.da_vinci.len() + self.polynomial.len() + self.table.len() + self.eyelets.len();
        paths + self.joints.len() > 0
    }

    fn names_joint(&self, joint: &str) -> bool {
        self.joints.contains_key(joint)
            || self.da_vinci.contains_key(joint)
            || self.polynomial.contains_key(joint)
            || self.table.contains_key(joint)
            || self.eyelets.contains_key(joint)
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
    pub(crate) links: [String; 2],
    /// Position of the pin in each link's frame, m.
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
    pub(crate) along: [f64; 3],
    /// Direction out of the hand.
    pub(crate) normal: [f64; 3],
    /// Extents along `along` and across it, m.
    pub(crate) size: [f64; 2],
    /// Centre of each patch, m.
    pub(crate) centers: Vec<[f64; 3]>,
    /// Number of taxels of each patch along its extents.
    #[serde(default = "one_taxel")]
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
