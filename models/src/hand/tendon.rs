//! Tendons: the length s(q) that joints at coordinates q let motors wind in, and its gradient, the moment arms R(q).
//!
//! Because every arm is the derivative of one length, the tendon does no net work on a closed path of q.

use super::motor::Motor;
use super::path::TendonPath;

/// A cable: tension `f = clamp(K (s_ref − s) − b ṡ, 0, f_max)`, torque `τ = Rᵀ f`.
///
/// Motors wind `s_ref = rest + Σ wᵢ s_refᵢ`: one motor alone, or several through a differential (sum and difference of two motors at
/// the ends of one cable: weights ½ and ½, ½ and −½). Without a motor the cable has a fixed length.
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
    /// s_ref without the motors' part.
    pub rest: f64,
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
    /// Largest tension f_max that the motors pull with.
    pub force_limit: f64,
    /// Largest tension that it holds, for a drive that no load turns back, such as a worm gear: more than f_max. Its motors stop
    /// where they pull with f_max, and the drive holds the place.
    pub hold_limit: Option<f64>,
    /// Whether a clutch lets go at f_max instead, for a drive with a hold limit: the motors go on, and this tendon stays locked until
    /// they come back.
    pub breakaway: bool,
    /// Guides that the cable passes, from the motor outwards: one for each of its coordinates. Empty if it rubs on none of them.
    pub guides: Vec<Guide>,
}

/// The guide by which a cable comes to a joint. Where it slides, the tension beyond is `e^(−μφ)` times that before if the cable moves
/// towards the motor, and `e^(μφ)` times if it is pulled out (Euler, Eytelwein); in between it sticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guide {
    /// Index into [`Hand::coordinates`](super::Hand::coordinates) of the joint.
    pub coordinate: usize,
    /// Coefficient of friction μ between cable and guide.
    pub friction: f64,
    /// Angle φ by which the cable wraps around the guide, rad.
    pub wrap_angle: f64,
}

impl Guide {
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

impl Tendon {
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
