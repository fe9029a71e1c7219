//! Tendons: the length s(q) that joints at coordinates q let motors wind in, and its gradient, the moment arms R(q).
//!
//! Because every arm is the derivative of one length, the tendon does no net work on a closed path of q.

use std::collections::BTreeMap;

use super::da_vinci::DaVinciGeometry;
use super::motor::Motor;
use super::number::{Bounds, Hashed, Number, numbers};
use super::path::{EyeletPositions, Polynomial, TablePoints, TendonPath};
use super::per_joint::PerJoint;

/// A cable: tension `f = clamp(K (s_ref − s) − b ṡ, 0, f_max)`, torque `τ = Rᵀ f`.
///
/// Motors wind `s_ref = rest + Σ wᵢ s_refᵢ`: one motor alone, or several through a differential (sum and difference of two motors at
/// the ends of one cable: weights ½ and ½, ½ and −½). Without a motor the cable has a fixed length.
///
/// A drive that pushes as well, `both_ways`, has its force clamped to ±f_max. A drive that no load turns back, such as a worm gear, holds
/// more: its motors stop where they pull with f_max, and it holds up to `hold_limit`. With `breakaway` a clutch lets go at f_max instead:
/// the motors go on, and this tendon stays locked until they come back.
///
/// Its length is `s(q) = Σ r_i q_i` plus the elements' part, and its row of R is the gradient ds/dq.
/// s and f are in units of the coordinate the moment arms refer to: with r dimensionless (URDF
/// `mechanicalReduction`) s is in rad and f in N·m; with r in metres s is in m and f in N.
#[derive(Clone, Debug)]
pub struct Tendon {
    /// Name, for messages.
    pub name: String,
    /// Motors that wind it: (index into [`Hand::motors`](super::Hand::motors), weight w), ascending by index.
    pub motors: Vec<(usize, f64)>,
    /// Constant part of its row of R: (coordinate index, moment arm), ascending by coordinate.
    pub moment_arms: Vec<(usize, f64)>,
    /// Parts of s that are not linear in q; each on a coordinate of its own.
    pub elements: Vec<TendonElement>,
    /// Guides that the cable passes, from the motor outwards: one for each of its coordinates. Empty if it rubs on none of them.
    pub guides: Vec<Guide>,
    /// Its numbers.
    pub numbers: TendonNumbers,
}

numbers! {
    /// The numbers of a tendon.
    numbers TendonNumbers of Tendon;
    /// Its numbers as far as they are stated.
    table StatedTendon;
    /// An entry of `[tendons]`.
    #[derive(Default)]
    settings TendonSettings {
        /// Motors that wind it, each with its weight, instead of the transmission's actuator.
        motors: Option<BTreeMap<String, f64>> = Number { bounds: Bounds::NotZero, ..Number::OF_TABLE },
        /// Its row of R by name of the URDF's joint, for a tendon without a transmission.
        #[serde(default)]
        joints: BTreeMap<String, f64> = Number { bounds: Bounds::NotZero, ..Number::OF_TABLE },
        /// Joints it passes by a Da Vinci mechanism, by name of the URDF's joint.
        #[serde(default)]
        da_vinci: BTreeMap<String, DaVinciGeometry> = Number { unit: "m", ..Number::OF_TABLE },
        /// Joints at which its length is a polynomial.
        #[serde(default)]
        polynomial: BTreeMap<String, Polynomial> = Number::OF_TABLE,
        /// Joints at which its length was measured.
        #[serde(default)]
        table: BTreeMap<String, TablePoints> = Number::OF_TABLE,
        /// Joints that it crosses straight, from eyelet to eyelet.
        #[serde(default)]
        eyelets: BTreeMap<String, EyeletPositions> = Number { unit: "m", ..Number::OF_TABLE },
        /// Joints in the order in which the cable passes them, from the motor outwards.
        routing: Option<Vec<String>> = Number::OF_TABLE,
        /// Friction of the cable at its guides.
        friction: Option<PerJoint> = GuideNumbers::ROWS[0],
        /// Angles by which it wraps around its guides.
        wrap_angle: Option<PerJoint> = GuideNumbers::ROWS[1],
    }
    /// Wound length without the motors' part.
    #[serde(skip_serializing)]
    rest: f64 = Number { unit: "unit of s", hashed: Hashed::ByPart, ..Number::ZERO },
    /// Whether it is a drive that pushes as well as pulls.
    both_ways: bool = Number::SWITCH,
    /// K
    stiffness: f64 = Number { unit: "f per s", bounds: Bounds::Positive, ..Number::REQUIRED },
    /// b
    damping: f64 = Number { unit: "f·s per s", bounds: Bounds::NotNegative, ..Number::ZERO },
    /// f_max
    force_limit: f64 = Number { unit: "unit of f", bounds: Bounds::Positive, ..Number::REQUIRED },
    /// Largest tension that it holds, if no load turns it back.
    #[serde(skip_serializing_if = "Option::is_none")]
    hold_limit: Option<f64> = Number { unit: "unit of f", bounds: Bounds::Positive, ..Number::optional("hold") },
    /// Whether a clutch lets go at f_max.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    breakaway: bool = Number::SWITCH,
}

/// The guide by which a cable comes to a joint. Where it slides, the tension beyond is `e^(−μφ)` times that before if the cable moves
/// towards the motor, and `e^(μφ)` times if it is pulled out (Euler, Eytelwein); in between it sticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guide {
    /// Index into [`Hand::coordinates`](super::Hand::coordinates) of the joint.
    pub coordinate: usize,
    /// Its numbers.
    pub numbers: GuideNumbers,
}

numbers! {
    /// The numbers of a guide.
    numbers GuideNumbers of Guide;
    /// Its numbers as far as they are stated.
    table StatedGuide;
    /// Coefficient of friction μ.
    friction: f64 = Number { unit: "1", bounds: Bounds::NotNegative, ..Number::ZERO },
    /// Angle φ by which the tendon wraps around it, rad.
    wrap_angle: f64 = Number { unit: "rad", bounds: Bounds::NotNegative, ..Number::ZERO },
}

impl Guide {
    /// The guide at a coordinate.
    pub fn new(coordinate: usize, friction: f64, wrap_angle: f64) -> Self {
        Guide { coordinate, numbers: GuideNumbers { friction, wrap_angle } }
    }

    /// Exponent μφ.
    pub fn exponent(&self) -> f64 {
        self.friction * self.wrap_angle
    }
}

/// Largest sum of μφ along a cable: with it, a motor pulls 148 times as strongly as the last joint is pulled.
pub const MAX_EXPONENT: f64 = 5.0;

/// A part of a tendon's length that is not linear in its coordinate.
#[derive(Clone, Debug)]
pub struct TendonElement {
    /// Index into [`Hand::coordinates`](super::Hand::coordinates) of the coordinate it depends on.
    pub coordinate: usize,
    /// Its path.
    pub path: TendonPath,
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

    /// Whether it acts on the joint of this name.
    pub(crate) fn names_joint(&self, joint: &str) -> bool {
        self.joints.contains_key(joint) || self.paths().any(|(_, name)| name == joint)
    }
}

impl Tendon {
    /// A contradiction between its numbers: the problem, and what is valid.
    pub(crate) fn contradiction(&self) -> Option<(String, String)> {
        let TendonNumbers { force_limit, hold_limit, breakaway, .. } = self.numbers;
        let (problem, valid) = match hold_limit {
            Some(hold) if self.motors.is_empty() => {
                (format!("has hold_limit {hold}, but no motor that it holds"), "hold_limit with motors")
            }
            Some(hold) if hold < force_limit => {
                let valid = format!("at least its force_limit, {force_limit}");
                return Some((format!("has hold_limit {hold}"), valid));
            }
            None if breakaway => (
                "has breakaway, but no hold_limit".to_owned(),
                "breakaway with hold_limit, which keeps it locked",
            ),
            _ => return None,
        };
        Some((problem, valid.to_owned()))
    }

    /// s_ref at motor positions σ.
    pub fn wound(&self, motors: &[Motor], sigma: impl Fn(usize) -> f64) -> f64 {
        // The usual tendon keeps its bits: no sum, no sign of a zero.
        if let [(motor, weight)] = self.motors[..]
            && weight == 1.0
            && self.rest == 0.0
        {
            return motors[motor].wound(sigma(motor));
        }
        let of = |&(motor, weight): &(usize, f64)| weight * motors[motor].wound(sigma(motor));
        self.motors.iter().fold(self.rest, |sum, entry| sum + of(entry))
    }

    /// Part of this tendon's force that a motor carries: its weight; 0 for other motors.
    pub fn weight(&self, motor: usize) -> f64 {
        self.motors.iter().find(|entry| entry.0 == motor).map_or(0.0, |entry| entry.1)
    }

    /// Smallest force: 0 for a cable; the negative limit for a drive.
    pub fn least_force(&self) -> f64 {
        if self.both_ways { -self.most_held() } else { 0.0 }
    }

    /// Largest force that it can have: the hold limit, or f_max.
    pub fn most_held(&self) -> f64 {
        self.hold_limit.unwrap_or(self.force_limit)
    }

    /// s(q), in the tendon's unit.
    pub fn length(&self, q: &[f64]) -> f64 {
        let mut s: f64 = self.moment_arms.iter().map(|&(c, r)| r * q[c]).sum();
        for element in &self.elements {
            s += element.path.length(q[element.coordinate]).value;
        }
        s
    }

    /// Its row of R(q): calls `entry` with pairs of coordinate and moment arm. A coordinate may occur twice:
    /// its arms add up.
    pub fn gradient(&self, q: &[f64], mut entry: impl FnMut(usize, f64)) {
        for &(c, r) in &self.moment_arms {
            entry(c, r);
        }
        for element in &self.elements {
            entry(element.coordinate, element.path.length(q[element.coordinate]).slope);
        }
    }

    /// Coordinates it acts on, ascending: those where its row of R can differ from zero.
    pub fn coordinates(&self) -> Vec<usize> {
        let linear = self.moment_arms.iter().map(|&(c, _)| c);
        let mut all: Vec<usize> = linear.chain(self.elements.iter().map(|e| e.coordinate)).collect();
        all.sort_unstable();
        all.dedup();
        all
    }
}

impl Tendon {
    /// Multiplies the part of its length that a coordinate makes.
    pub(super) fn scale_arms(&mut self, coordinate: usize, factor: f64) {
        for (c, arm) in &mut self.moment_arms {
            if *c == coordinate {
                *arm *= factor;
            }
        }
        for element in self.elements.iter_mut().filter(|element| element.coordinate == coordinate) {
            element.path = element.path.scaled(factor);
        }
    }
}
