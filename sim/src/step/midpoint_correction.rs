//! Second-order positions where nothing is stiff.
//!
//! Springs and contacts need the velocity at the end of a step; with it a body under even Coulomb braking
//! would fall short by v₀ h/2. Where contacts leave an object free, along a floor, rolling, or in the air, it
//! moves with the mean of the velocities before and after instead.

use crate::model::Owner;
use crate::solver::friction_cone::ConeHessian;
use crate::solver::problem::Problem;
use palmares_models::Vec3;

/// Displacements below this, m, are not corrected: a body at rest is not worth the search.
const MIN_M: f64 = 1e-9;

/// Largest distance, m, by which a body that turns about a contact may lift it off its tangent. A body that
/// pivots faster keeps the dissipation of the end velocity; otherwise the lift would add energy.
const PIVOT_M: f64 = 1e-5;

/// A direction is new if at least this part of it is independent of the others.
const NEW: f64 = 1e-6;

type ConstraintRow = [f64; 6];

/// Displacement that the mean velocity adds to that of the end velocity.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Correction {
    /// m
    pub linear: Vec3,
    /// rad
    pub angular: Vec3,
}

/// Orthonormal directions in which an object is constrained. Turns are measured by their displacement at the
/// radius of gyration.
#[derive(Default)]
struct Held {
    rows: [ConstraintRow; 6],
    count: usize,
}

impl Held {
    fn without(&self, mut x: ConstraintRow) -> ConstraintRow {
        for row in &self.rows[..self.count] {
            let part = dot(row, &x);
            for (x, row) in x.iter_mut().zip(row) {
                *x -= part * row;
            }
        }
        x
    }

    /// Adds a direction; false when no free direction is left.
    fn hold(&mut self, row: ConstraintRow) -> bool {
        let length = dot(&row, &row).sqrt();
        // Twice, so that they stay orthogonal to rounding.
        let rest = self.without(self.without(row));
        let new = dot(&rest, &rest).sqrt();
        if self.count < 6 && new > NEW * length {
            self.rows[self.count] = rest.map(|x| x / new);
            self.count += 1;
        }
        self.count < 6
    }
}

fn dot(a: &ConstraintRow, b: &ConstraintRow) -> f64 {
    let mut sum = 0.0;
    for k in 0..6 {
        sum += a[k] * b[k];
    }
    sum
}

/// The correction for the object in `slot` of the problem, which turns by `turn` in the step and whose
/// displacement with the end velocity falls short of that with the mean by `linear` and `angular`: only the
/// part that moves no contact along its normal, and no sticking one. An object that leans on a moving body,
/// or pivots about an edge, is not corrected.
pub(super) fn correction(
    problem: &Problem,
    slot: usize,
    turn: Vec3,
    linear: Vec3,
    angular: Vec3,
) -> Correction {
    let solved = &problem.objects[slot];
    let owner = Owner::Object(solved.object);
    let (i, m) = (solved.inertia, solved.mass);
    let gyration = ((i.x_axis.x + i.y_axis.y + i.z_axis.z) / (3.0 * m)).sqrt();
    let mut wanted = [0.0; 6];
    wanted[..3].copy_from_slice(&linear.to_array());
    wanted[3..].copy_from_slice(&(angular * gyration).to_array());
    if dot(&wanted, &wanted) < MIN_M * MIN_M {
        return Correction::default();
    }
    let mut held = Held::default();
    for pair in problem.pairs.iter().filter(|pair| pair.a == owner || pair.b == owner) {
        let on_furniture = pair.a == Owner::Static || pair.b == Owner::Static;
        // From A to B: away from the other body.
        let sign = if pair.b == owner { 1.0 } else { -1.0 };
        for point in &problem.points[pair.first..pair.end] {
            let arm = pair.origin + point.r - solved.center;
            let friction_arm = pair.origin + point.friction_r - solved.center;
            let row = |axis: Vec3, arm: Vec3| -> ConstraintRow {
                let moment = arm.cross(axis) / gyration;
                [axis.x, axis.y, axis.z, moment.x, moment.y, moment.z]
            };
            // A rolling body is above its contact.
            let pivots = || 0.5 * turn.length() * turn.cross(point.axes[2]).dot(arm).abs() > PIVOT_M;
            let normal = row(point.axes[2], arm);
            let free = match point.law.impulse(point.velocity).1 {
                // It would approach a body that it does not touch.
                ConeHessian::Open => sign * dot(&normal, &held.without(wanted)) >= 0.0 || held.hold(normal),
                _ if !on_furniture || pivots() => false,
                ConeHessian::Slip(..) => held.hold(normal),
                ConeHessian::Stick => {
                    held.hold(normal)
                        && held.hold(row(point.axes[0], friction_arm))
                        && held.hold(row(point.axes[1], friction_arm))
                }
            };
            if !free {
                return Correction::default();
            }
        }
    }
    let [x, y, z, a, b, c] = held.without(wanted);
    Correction { linear: Vec3::new(x, y, z), angular: Vec3::new(a, b, c) / gyration }
}

#[cfg(test)]
mod tests {
    use crate::{Command, Config, Model, State, World};
    use palmares_models::Pose;
    use palmares_models::object::Object;
    use palmares_models::shape::Shape;
    use std::sync::Arc;

    #[test]
    fn a_sliding_box_stops_where_coulomb_says_at_a_long_step() {
        let (mu, v, h) = (0.4, 1.0, 8e-3);
        let mut model = Model::new(Config::with_step(h), None).expect("no hand");
        model.add_ground(0.0, mu);
        let cube = Shape::Box { half_extents: [0.1, 0.1, 0.02], rounding: 0.0 };
        let object = Object::new("box", vec![(Pose::IDENTITY, cube)], 1.0, mu, 0.0).expect("sound");
        model.add_object(Arc::new(object)).expect("it fits");
        let mut state = State::at_rest(&model, Pose::IDENTITY, &[Pose::translation(0.0, 0.0, 0.02)]);
        state.v[0] = v;
        let mut world = World::new(Arc::new(model), state);
        let command = Command::stay(world.model(), Pose::IDENTITY);
        for _ in 0..(0.5 / h) as u32 {
            world.step(&command);
        }
        let (way, exact) = (world.state().objects[0].translation.x, v * v / (2.0 * mu * 9.81));
        // v h/2 is 4 mm.
        assert!((way - exact).abs() < 5e-4, "{way} for {exact}");
    }
}
