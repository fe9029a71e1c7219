//! Reference for a disc on its rim: its equations of motion with an exact contact, by the classical Runge–Kutta method.
//!
//! With the arm r from the centre of mass to the lowest point of the rim, which moves over the body, a disc that rolls has `v + ω × r =
//! 0`. The derivative of this, Newton's and Euler's laws give ω̇ and the contact's force F:
//!
//! `(I − m [r]²) ω̇ = r × m (−ω × ṙ − g) − ω × I ω`, `F = m (−ω̇ × r − ω × ṙ − g)`
//!
//! Without friction `n·(v + ω × r) = 0` and F is along the normal n, which is z.

use palmares_models::{Mat3, Rotation, Vec3};

/// Time of a step of the reference, s: the energy of the scenes here is then kept to 1e-6.
const STEP_S: f64 = 1e-4;

/// Displacement for ṙ, s.
const DIFFERENCE_S: f64 = 1e-6;

/// A cylinder on its rim.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RollingDisc {
    /// m
    pub radius: f64,
    /// m
    pub half_length: f64,
    /// kg
    pub mass: f64,
    /// m/s²
    pub gravity: Vec3,
    /// Whether it rolls; else it slides without friction.
    pub rolls: bool,
}

/// Axis and angular velocity.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turning {
    pub axis: Vec3,
    pub angular: Vec3,
}

/// The course of a disc.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Course {
    /// At its end.
    pub end: Turning,
    /// Least normal force, as a part of the weight, and largest ratio of friction to it.
    pub least_force: f64,
    pub friction: f64,
}

impl Turning {
    /// Leans by an angle, rad, about x, and turns about its own axis and about the vertical, rad/s.
    pub(crate) fn leaning(lean: f64, spin: f64, vertical: f64) -> Self {
        let axis = Rotation::from_rotation_x(lean) * Vec3::Z;
        Turning { axis, angular: axis * spin + Vec3::Z * vertical }
    }

    fn after(self, (axis, angular): (Vec3, Vec3), time_s: f64) -> Self {
        Turning { axis: self.axis + axis * time_s, angular: self.angular + angular * time_s }
    }
}

impl RollingDisc {
    /// From the centre of mass to the lowest point of the rim.
    pub(crate) fn arm(&self, axis: Vec3) -> Vec3 {
        let down = (axis * axis.z - Vec3::Z).normalize();
        down * self.radius - axis * (self.half_length * axis.z.signum())
    }

    fn inertia(&self, axis: Vec3) -> Mat3 {
        let along = 0.5 * self.mass * self.radius.powi(2);
        let across = self.mass * (3.0 * self.radius.powi(2) + 4.0 * self.half_length.powi(2)) / 12.0;
        let outer = Mat3::from_cols(axis * axis.x, axis * axis.y, axis * axis.z);
        Mat3::from_diagonal(Vec3::splat(across)) + outer * (along - across)
    }

    /// Derivatives of axis and angular velocity, and the force of the contact, N.
    fn rates(&self, Turning { axis, angular }: Turning) -> (Vec3, Vec3, Vec3) {
        let (mass, inertia, arm) = (self.mass, self.inertia(axis), self.arm(axis));
        let moves = angular.cross(axis);
        let arm_at = |time_s: f64| self.arm((axis + moves * time_s).normalize());
        let arm_moves = (arm_at(DIFFERENCE_S) - arm_at(-DIFFERENCE_S)) / (2.0 * DIFFERENCE_S);
        let gyroscopic = angular.cross(inertia * angular);
        if self.rolls {
            let cross = Mat3::from_cols(Vec3::X.cross(arm), Vec3::Y.cross(arm), Vec3::Z.cross(arm)) * -1.0;
            let torque = arm.cross(-angular.cross(arm_moves) - self.gravity) * mass - gyroscopic;
            let change = (inertia - cross * cross * mass).inverse() * torque;
            let force = (-change.cross(arm) - angular.cross(arm_moves) - self.gravity) * mass;
            return (moves, change, force);
        }
        let inverse = inertia.inverse();
        let free = inverse * -gyroscopic;
        let approach = (self.gravity + free.cross(arm) + angular.cross(arm_moves)).z;
        let yielding = 1.0 / mass + (inverse * arm.cross(Vec3::Z)).cross(arm).z;
        let force = Vec3::Z * (-approach / yielding);
        (moves, free + inverse * arm.cross(force), force)
    }

    /// Its course in a time, s.
    pub(crate) fn course(&self, start: Turning, time_s: f64) -> Course {
        let count = (time_s / STEP_S).ceil();
        let h = time_s / count;
        let weight = self.mass * self.gravity.length();
        let mut course = Course { end: start, least_force: f64::INFINITY, friction: 0.0 };
        for _ in 0..count as u32 {
            let now = course.end;
            let (a1, w1, force) = self.rates(now);
            let (a2, w2, _) = self.rates(now.after((a1, w1), 0.5 * h));
            let (a3, w3, _) = self.rates(now.after((a2, w2), 0.5 * h));
            let (a4, w4, _) = self.rates(now.after((a3, w3), h));
            let mean = |[k1, k2, k3, k4]: [Vec3; 4]| (k1 + (k2 + k3) * 2.0 + k4) / 6.0;
            course.end = now.after((mean([a1, a2, a3, a4]), mean([w1, w2, w3, w4])), h);
            course.end.axis = course.end.axis.normalize();
            course.least_force = course.least_force.min(force.z / weight);
            course.friction = course.friction.max(force.truncate().length() / force.z);
        }
        course
    }

    /// Its energy on a level plane, J.
    #[cfg(test)]
    fn energy(&self, Turning { axis, angular }: Turning) -> f64 {
        let arm = self.arm(axis);
        let velocity = -angular.cross(arm);
        let kinetic = self.mass * velocity.length_squared() + angular.dot(self.inertia(axis) * angular);
        0.5 * kinetic + self.mass * self.gravity.length() * -arm.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disc_that_rolls_keeps_its_energy_and_leans_as_much_in_steady_motion() {
        let gravity = Vec3::new(0.0, 0.0, -9.81);
        let disc = RollingDisc { radius: 0.04, half_length: 0.003, mass: 0.05, gravity, rolls: true };
        let start = Turning::leaning(1.1, 25.0, 4.0);
        let end = disc.course(start, 1.0).end;
        assert!((disc.energy(end) / disc.energy(start) - 1.0).abs() < 1e-6);
        // Euler's disc turns about the diameter through its contact, where Ω² sin α = 4 g/a.
        let thin = RollingDisc { half_length: 0.0, ..disc };
        let lean: f64 = 0.5;
        let vertical = (4.0 * 9.81 / (thin.radius * libm::sin(lean))).sqrt();
        let steady = Turning::leaning(lean, -vertical * libm::cos(lean), vertical);
        let course = thin.course(steady, 1.0);
        assert!((course.end.axis.z / steady.axis.z - 1.0).abs() < 1e-6, "{}", course.end.axis);
    }
}
