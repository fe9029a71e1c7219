//! Free bodies and the points at which they could meet, for a sequence of impacts.

use palmares_models::{Mat3, Vec3};

/// Index that marks furniture among the bodies.
pub const FIXED: usize = usize::MAX;

/// A load in a step below this part of an impact's impulse is rounding.
const NO_LOAD: f64 = 1e-6;

/// Surfaces that approach at a gap of at most this, m, meet at once. Rounding makes the gaps of mirror bodies differ by 1e-16 m at
/// first, and every later blow of a course multiplies the difference. A nanometre is a thousandth of what a body of a few grams sinks
/// into its support.
const TIE_M: f64 = 1e-9;

/// A free body.
#[derive(Clone, Copy, Debug)]
pub struct ImpactBody {
    /// Centre of mass in the world, m.
    pub center: Vec3,
    /// 1/kg
    pub inverse_mass: f64,
    /// Inverse of the inertia in world axes, 1/(kg m²).
    pub inverse_inertia: Mat3,
    /// Velocities at the start of the step: linear in m/s, angular in rad/s.
    pub start: [Vec3; 2],
    /// Velocities now, without gravity's contribution since the start.
    pub(super) now: [Vec3; 2],
    /// Times of the first and the last hit, s.
    pub(super) hit: Option<(f64, f64)>,
    /// Displacement until the last hit, without gravity, m.
    pub(super) way: Vec3,
    /// Whether the present impact strikes it.
    pub(super) struck: bool,
    /// A body that the present impact couples with it, or itself: the links of a union-find.
    pub(super) with: usize,
}

impl ImpactBody {
    /// A body that has not been hit.
    pub fn new(center: Vec3, inverse_mass: f64, inverse_inertia: Mat3, start: [Vec3; 2]) -> Self {
        ImpactBody {
            center,
            inverse_mass,
            inverse_inertia,
            start,
            now: start,
            hit: None,
            way: Vec3::ZERO,
            struck: false,
            with: 0,
        }
    }

    /// Time of the first hit, and the detour, m: the displacement, less that of a body that moves with the start
    /// velocity until the first hit, and with the end velocity after it.
    pub fn detour(&self) -> Option<(f64, Vec3)> {
        let (first, last) = self.hit?;
        Some((first, self.way - self.start[0] * first - self.now[0] * (last - first)))
    }

    pub(super) fn advance(&mut self, time: f64) {
        let (first, last) = self.hit.unwrap_or((time, 0.0));
        self.way += self.now[0] * (time - last);
        self.hit = Some((first, time));
    }
}

/// A contact point at which two bodies could meet.
#[derive(Clone, Copy, Debug)]
pub struct ImpactCandidate {
    /// Bodies A and B, or [`FIXED`].
    pub bodies: [usize; 2],
    /// Unit normal from A to B.
    pub normal: Vec3,
    /// From the bodies' centres of mass to the point, m.
    pub arms: [Vec3; 2],
    /// Gap, m.
    pub gap: f64,
    /// Gravity on B against A, m/s².
    pub gravity: Vec3,
    /// Coefficient of restitution.
    pub restitution: f64,
    /// Impulse of the last step, N s.
    pub load: f64,
    /// The caller's index of the point.
    pub place: usize,
    /// Change of the bodies' angular velocities per impulse.
    pub(super) turns: [Vec3; 2],
    /// Change of the normal velocity per impulse, 1/kg.
    pub(super) inverse_effective_mass: f64,
    /// Impulse up to now, N s.
    pub impulse: f64,
    /// Sum of its parts times their times.
    pub(super) timed: f64,
    /// Whether the point takes part in the next impact of its bodies.
    pub(super) due: bool,
    /// Whether it would if the step were longer.
    pub(super) misses: bool,
    /// Time from which its surfaces are as near as those that meet, s; infinite if they do not approach.
    pub(super) near: f64,
}

/// The next meeting of the surfaces at a point, if nothing else happens.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meets {
    /// Its time, at most the end of the step, s.
    pub time: f64,
    /// Whether it is within the step.
    pub within: bool,
    /// Time from which the gap is at most [`TIE_M`], s.
    pub near: f64,
}

impl ImpactCandidate {
    /// A point that has not been hit.
    pub fn new(bodies: [usize; 2], normal: Vec3, arms: [Vec3; 2], gap: f64, place: usize) -> Self {
        ImpactCandidate {
            bodies,
            normal,
            arms,
            gap,
            gravity: Vec3::ZERO,
            restitution: 0.0,
            load: 0.0,
            place,
            turns: [Vec3::ZERO; 2],
            inverse_effective_mass: 0.0,
            impulse: 0.0,
            timed: 0.0,
            due: false,
            misses: false,
            near: f64::INFINITY,
        }
    }

    /// Time of the hit, s: the mean over its impulses.
    pub fn hit(&self) -> Option<f64> {
        (self.impulse > 0.0).then(|| self.timed / self.impulse)
    }

    /// Whether its surfaces approach at the end, fast enough to rebound, but do not meet in the step.
    pub fn misses(&self) -> bool {
        self.misses
    }

    pub(super) fn key(&self) -> (usize, usize, usize) {
        let [a, b] = self.bodies;
        (a.min(b), a.max(b), self.place)
    }

    /// Normal velocity now, including gravity up to `time`.
    pub(super) fn velocity(&self, bodies: &[ImpactBody], time: f64) -> f64 {
        self.normal.dot(self.relative(bodies, |body| body.now) + self.gravity * time)
    }

    pub(super) fn relative(&self, bodies: &[ImpactBody], of: impl Fn(&ImpactBody) -> [Vec3; 2]) -> Vec3 {
        let at = |side: usize| {
            bodies.get(self.bodies[side]).map_or(Vec3::ZERO, |body| {
                let [linear, angular] = of(body);
                linear + angular.cross(self.arms[side])
            })
        };
        at(1) - at(0)
    }

    /// The next meeting of its surfaces, if they approach fast enough to rebound.
    pub(super) fn meets(&self, bodies: &[ImpactBody], time: f64, h: f64, least: f64) -> Option<Meets> {
        let (velocity, rest) = (self.velocity(bodies, time), h - time);
        if velocity >= -least || self.load * self.inverse_effective_mass > -velocity * NO_LOAD {
            return None;
        }
        let within = self.gap + rest * (velocity + rest * self.gravity.dot(self.normal)) < 0.0;
        let near = time + (self.gap - TIE_M).max(0.0) / -velocity;
        Some(Meets { time: (time + self.gap.max(0.0) / -velocity).min(h), within, near })
    }

    pub(super) fn push(&self, bodies: &mut [ImpactBody], impulse: f64) {
        for (side, sign) in [(0, -impulse), (1, impulse)] {
            if let Some(body) = bodies.get_mut(self.bodies[side]) {
                body.now[0] += self.normal * (sign * body.inverse_mass);
                body.now[1] += self.turns[side] * sign;
            }
        }
    }
}
