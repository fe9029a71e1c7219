//! `hand.toml`: what a URDF has no place for.

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::error::ModelError;
use crate::hand::tendon::DaVinciGeometry;
use crate::limits::Limits;
use crate::load::{InertiaPolicy, Report};
use crate::tactile::TactileSettings;

/// The file beside a URDF. All of it is optional.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Settings {
    /// Replaces the URDF's robot name.
    pub(crate) name: Option<String>,
    pub(crate) description: Option<String>,
    pub(crate) gravity_compensation: Option<bool>,
    /// Coulomb friction coefficient of every surface that [links] does not name.
    pub(crate) friction: Option<f64>,
    pub(crate) inertia: Option<InertiaPolicy>,
    /// By name of the URDF's actuator.
    #[serde(default)]
    pub(crate) motors: BTreeMap<String, MotorSettings>,
    /// By name of the URDF's transmission.
    #[serde(default)]
    pub(crate) tendons: BTreeMap<String, TendonSettings>,
    /// What holds for every coordinate that [coordinates] does not name.
    #[serde(default)]
    pub(crate) every_coordinate: CoordinateSettings,
    /// By name of the URDF's joint.
    #[serde(default)]
    pub(crate) coordinates: BTreeMap<String, CoordinateSettings>,
    /// By name of the URDF's link.
    #[serde(default)]
    pub(crate) links: BTreeMap<String, LinkSettings>,
    #[serde(default)]
    pub(crate) tactile: Vec<TactileSettings>,
}

impl Settings {
    /// Refuses numbers that are not finite or absurdly large, before anything is computed from them.
    pub(crate) fn check(&self, limits: &Limits, at: &Report) -> Result<(), ModelError> {
        let check = |table: &str, name: &str, what: &str, value: Option<f64>, limit: f64| {
            let element = || if name.is_empty() { table.to_owned() } else { format!("[{table}.{name}]") };
            value.map_or(Ok(()), |value| at.number(element, what, value, limit))
        };
        // Finite and not too large first, then the sign.
        let sign = |table: &str, name: &str, what: &str, value: Option<f64>, least: Least| {
            let element = if name.is_empty() { table.to_owned() } else { format!("[{table}.{name}]") };
            match value {
                Some(value) if !least.allows(value) => {
                    Err(at.bad(element, format!("has {what} {value}"), format!("{what} {}", least.words())))
                }
                _ => Ok(()),
            }
        };
        let positive = |table: &str, name: &str, what: &str, value: Option<f64>, most: f64| {
            check(table, name, what, value, most)?;
            sign(table, name, what, value, Least::Positive)
        };
        let not_negative = |table: &str, name: &str, what: &str, value: Option<f64>, most: f64| {
            check(table, name, what, value, most)?;
            sign(table, name, what, value, Least::Zero)
        };
        let most = limits.number;
        not_negative("settings", "", "friction", self.friction, most)?;
        for (name, m) in &self.motors {
            check("motors", name, "scaling", Some(m.scaling), most)?;
            sign("motors", name, "scaling", Some(m.scaling), Least::NotZero)?;
            check("motors", name, "offset", Some(m.offset), most)?;
            positive("motors", name, "speed_limit", Some(m.speed_limit), most)?;
        }
        for (name, t) in &self.tendons {
            positive("tendons", name, "stiffness", Some(t.stiffness), most)?;
            not_negative("tendons", name, "damping", Some(t.damping), most)?;
            positive("tendons", name, "force_limit", Some(t.force_limit), most)?;
            for (joint, g) in &t.da_vinci {
                let what = format!("da_vinci.{joint}");
                for x in [g.r0, g.r1, g.r2, g.a1, g.b1, g.l1, g.a2, g.b2] {
                    check("tendons", name, &what, Some(x), limits.length_m)?;
                }
            }
        }
        let every = [("every", &self.every_coordinate)];
        let coordinates = self.coordinates.iter().map(|(name, c)| (name.as_str(), c));
        for (name, c) in coordinates.chain(every) {
            not_negative("coordinates", name, "stiffness", c.stiffness, most)?;
            not_negative("coordinates", name, "damping", c.damping, most)?;
            check("coordinates", name, "rest", c.rest, most)?;
        }
        for (name, l) in &self.links {
            not_negative("links", name, "mass", l.mass, limits.mass_kg)?;
            not_negative("links", name, "rounding", l.rounding, limits.length_m)?;
            not_negative("links", name, "friction", l.friction, most)?;
        }
        for patches in &self.tactile {
            for x in patches.lengths() {
                check("tactile", &patches.name, "size or centers", Some(x), limits.length_m)?;
            }
        }
        Ok(())
    }

    /// The numbers it states, by table and field: `[links.palm]`, `friction`.
    pub(crate) fn stated(&self) -> BTreeMap<(String, &'static str), f64> {
        let mut stated = BTreeMap::new();
        let mut state = |table: String, field: &'static str, value: Option<f64>| {
            if let Some(value) = value {
                stated.insert((table, field), value);
            }
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
        for (name, m) in &self.motors {
            state(format!("[motors.{name}]"), "scaling", Some(m.scaling));
        }
        stated
    }
}

/// The least that a finite number may be.
#[derive(Clone, Copy)]
enum Least {
    Positive,
    Zero,
    NotZero,
}

impl Least {
    fn allows(self, value: f64) -> bool {
        match self {
            Least::Positive => value > 0.0,
            Least::Zero => value >= 0.0,
            Least::NotZero => value != 0.0,
        }
    }

    fn words(self) -> &'static str {
        match self {
            Least::Positive => "of more than 0",
            Least::Zero => "of at least 0",
            Least::NotZero => "other than 0",
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
    /// Pushes as well as it pulls.
    #[serde(default)]
    pub(crate) both_ways: bool,
    /// Joints it passes by a Da Vinci mechanism, by name of the URDF's joint.
    #[serde(default)]
    pub(crate) da_vinci: BTreeMap<String, DaVinciGeometry>,
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
    pub(crate) friction: Option<f64>,
}
