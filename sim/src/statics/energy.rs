//! The minimum of the energy of a hand with pushes, weight and held points.
//!
//! All forces derive from an energy: springs, tendons at wound lengths, the springs of joint limits, weight,
//! pushes with a constant direction, and for each held point a stiff spring to its target whose force is
//! bounded. Newton's method finds its minimum. An unreachable target does no harm: the point comes as near as
//! the bound on the force allows.

use crate::actuation::elastic;
use crate::command::Push;
use crate::config::Config;
use crate::dynamics::tree::Kinematics;
use crate::statics::equilibrium::{NoEquilibrium, downhill, elastic_energy};
use crate::statics::loads::{torque_work, torques};
use crate::statics::rest::{Equilibrium, Method, NoPrediction, beyond_tendons, spend};
use nalgebra::{DMatrix, DVector};
use palmares_models::hand::Hand;
use palmares_models::{Pose, Vec3};

/// Stiffness of the spring that holds a point, N/m: at 1 N the point is 0.01 mm off.
pub(super) const STIFFNESS: f64 = 1e5;
/// Largest force that holds a point, N: more than the closing force of any hand here.
pub(super) const MAX_FORCE: f64 = 100.0;
/// Newton's method ends when the torques balance to this part of their magnitudes.
const BALANCE: f64 = 1e-11;
/// Largest accepted unbalanced part of them.
const BALANCED: f64 = 1e-7;
/// Largest computing of a search, in the unit of [`crate::bounds`]: a second or two. Hands within the default
/// limits need less, for any number of steps.
const MAX_WORK: u64 = 2_000_000_000;
/// Largest number of Newton steps, each with as many evaluations as twice the coordinates.
const STEPS: usize = 200;
/// Half the difference of two evaluations for a derivative, rad or m.
const DIFFERENCE: f64 = 1e-6;

/// A point of a link that is held at a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointConstraint {
    /// Index of the link.
    pub link: usize,
    /// Point in the link frame, m.
    pub point: Vec3,
    /// Target in the world frame, m.
    pub place: Vec3,
}

/// Reaction that holds a point at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reaction {
    /// Force on the link, in the world frame, N.
    pub force: Vec3,
    /// Distance of the point from its target, m.
    pub gap: f64,
}

/// Everything that acts on a hand except its springs and tendons.
pub(super) struct StaticsProblem<'a> {
    pub(super) config: &'a Config,
    pub(super) hand: &'a Hand,
    pub(super) base: Pose,
    pub(super) s_ref: &'a [f64],
    pub(super) pushes: &'a [Push],
    pub(super) holds: &'a [PointConstraint],
}

/// The equilibrium at wound lengths under pushes and weight, as the minimum of the energy.
pub(super) fn minimum(
    config: &Config,
    hand: &Hand,
    base: Pose,
    s_ref: &[f64],
    pushes: &[Push],
) -> Result<Equilibrium, NoPrediction> {
    let problem = StaticsProblem { config, hand, base, s_ref, pushes, holds: &[] };
    Ok(problem.equilibrium(problem.minimum()?))
}

impl PointConstraint {
    /// The holding force, as a push.
    pub fn as_push(&self, reaction: &Reaction) -> Push {
        Push { link: self.link, point: self.point, force: reaction.force }
    }
}

/// Energy of a spring with bounded force: a parabola, continued linearly beyond the bound.
fn spring_energy(gap: f64) -> f64 {
    let most = MAX_FORCE / STIFFNESS;
    if gap <= most { 0.5 * STIFFNESS * gap * gap } else { MAX_FORCE * (gap - 0.5 * most) }
}

impl StaticsProblem<'_> {
    pub(super) fn kinematics(&self, q: &[f64]) -> Kinematics {
        let mut kin = Kinematics::default();
        kin.update(self.hand, self.base, q);
        kin
    }

    /// An equilibrium at q.
    pub(super) fn equilibrium(&self, q: Vec<f64>) -> Equilibrium {
        let tension = self.tension(&q);
        let mut why: Vec<String> = self.limits(&q).collect();
        why.extend(beyond_tendons(self.hand, &tension));
        why.extend(
            self.holds.iter().map(|hold| format!("link '{}' is held", self.hand.links[hold.link].name)),
        );
        Equilibrium { q, tension, method: Method::Newton, beyond_closed_form: why }
    }

    pub(super) fn reactions(&self, kin: &Kinematics) -> Vec<Reaction> {
        let of = |hold: &PointConstraint| {
            let off = hold.place - kin.pose[hold.link].transform_point(hold.point);
            let gap = off.length();
            let stiffness = if gap * STIFFNESS > MAX_FORCE { MAX_FORCE / gap } else { STIFFNESS };
            Reaction { force: off * stiffness, gap }
        };
        self.holds.iter().map(of).collect()
    }

    /// Signed distance of each coordinate beyond a limit.
    fn excess(&self, q: &[f64]) -> Vec<f64> {
        let beyond = |(c, q): (&palmares_models::hand::Coordinate, &f64)| q - q.clamp(c.lower, c.upper);
        self.hand.coordinates.iter().zip(q).map(beyond).collect()
    }

    fn limits(&self, q: &[f64]) -> impl Iterator<Item = String> {
        let all = self.hand.coordinates.iter().zip(self.excess(q));
        all.filter(|(_, excess)| *excess != 0.0).map(|(c, excess)| {
            let (side, limit) = if excess < 0.0 { ("lower", c.lower) } else { ("upper", c.upper) };
            format!("joint '{}' is at its {side} limit {limit:.4}", c.name)
        })
    }

    pub(super) fn tension(&self, q: &[f64]) -> Vec<f64> {
        let of = |(t, s): (&palmares_models::hand::Tendon, &f64)| {
            (t.stiffness * (s - t.length(q))).clamp(t.least_force(), t.most_held())
        };
        self.hand.tendons.iter().zip(self.s_ref).map(of).collect()
    }

    fn energy(&self, q: &[f64]) -> f64 {
        let kin = self.kinematics(q);
        let mut energy = elastic_energy(self.hand, self.s_ref, q);
        energy += self.excess(q).iter().map(|x| 0.5 * self.config.limit_stiffness * x * x).sum::<f64>();
        for push in self.pushes {
            energy -= push.force.dot(kin.pose[push.link].transform_point(push.point) - kin.origin);
        }
        if !self.hand.gravity_compensation {
            for (link, pose) in self.hand.links.iter().zip(&kin.pose) {
                let at = pose.transform_point(link.inertia.com) - kin.origin;
                energy -= link.inertia.mass * self.config.gravity.dot(at);
            }
        }
        energy + self.reactions(&kin).iter().map(|reaction| spring_energy(reaction.gap)).sum::<f64>()
    }

    /// Derivative of the energy: the unbalanced torque on each coordinate; and the largest torque in it.
    pub(super) fn gradient(&self, q: &[f64]) -> (DVector<f64>, f64) {
        let n = q.len();
        let reactions = self.reactions(&self.kinematics(q));
        let holding = self.holds.iter().zip(&reactions).map(|(hold, reaction)| hold.as_push(reaction));
        let all: Vec<Push> = self.pushes.iter().copied().chain(holding).collect();
        let outer = torques(self.config, self.hand, self.base, q, &all);
        let excess = self.excess(q);
        let mut size = f64::MIN_POSITIVE;
        let mut gradient = DVector::zeros(n);
        let mut add = |gradient: &mut DVector<f64>, i: usize, torque: f64| {
            gradient[i] -= torque;
            size = size.max(torque.abs());
        };
        for (i, c) in self.hand.coordinates.iter().enumerate() {
            add(&mut gradient, i, outer[i]);
            add(&mut gradient, i, -c.stiffness * (q[i] - c.rest));
            add(&mut gradient, i, -self.config.limit_stiffness * excess[i]);
        }
        for (tendon, f) in self.hand.tendons.iter().zip(self.tension(q)) {
            tendon.gradient(q, |c, r| add(&mut gradient, c, f * r));
        }
        let mut coupled = vec![0.0; n];
        elastic::subtract_torques(self.hand, q, &mut coupled);
        coupled.iter().enumerate().for_each(|(i, torque)| add(&mut gradient, i, *torque));
        (gradient, size)
    }

    /// Second derivative of the energy, by differences of the first.
    fn hessian(&self, q: &[f64]) -> DMatrix<f64> {
        let n = q.len();
        let mut hessian = DMatrix::zeros(n, n);
        let mut moved = q.to_vec();
        for k in 0..n {
            let mut at = |x: f64| {
                moved[k] = x;
                self.gradient(&moved).0
            };
            let column = (at(q[k] + DIFFERENCE) - at(q[k] - DIFFERENCE)) / (2.0 * DIFFERENCE);
            moved[k] = q[k];
            hessian.set_column(k, &column);
        }
        let transposed = hessian.transpose();
        (hessian + transposed) * 0.5
    }

    /// The minimum of the energy downhill from the rest position of the springs.
    pub(super) fn minimum(&self) -> Result<Vec<f64>, NoPrediction> {
        let mut q = self.hand.open();
        let (mut gradient, mut size) = self.gradient(&q);
        let mut energy = self.energy(&q);
        let n = q.len() as u64;
        let evaluation =
            torque_work(self.hand, self.pushes.len() + self.holds.len()) + n * self.hand.tendons.len() as u64;
        let mut left = MAX_WORK;
        for _ in 0..STEPS {
            if gradient.amax() <= BALANCE * size {
                break;
            }
            spend(&mut left, (2 * n + 1) * evaluation)?;
            let (step, factors) = downhill(&self.hessian(&q), &gradient);
            spend(&mut left, factors * n * n * n / 6)?;
            let Some(step) = step else { break };
            let slope = gradient.dot(&step);
            let mut part = 1.0;
            let moved = loop {
                spend(&mut left, evaluation)?;
                let there: Vec<f64> = q.iter().zip(step.iter()).map(|(q, d)| q - part * d).collect();
                let next = self.energy(&there);
                // Near the minimum the energy is all rounding; the torques still decide.
                if next <= energy - 1e-4 * part * slope {
                    break Some((there, next));
                }
                if part == 1.0 && self.gradient(&there).0.amax() < 0.5 * gradient.amax() {
                    break Some((there, next));
                }
                part *= 0.5;
                if part < 1e-12 {
                    break None;
                }
            };
            let Some((there, next)) = moved else { break };
            (q, energy) = (there, next);
            (gradient, size) = self.gradient(&q);
        }
        let residual = gradient.amax();
        if residual <= BALANCED * size.max(1e-3) { Ok(q) } else { Err(NoEquilibrium { residual }.into()) }
    }
}
