//! Inverse kinematics: where base and fingers are, for points of links to be at places.
//!
//! Levenberg (1944) and Marquardt (1963): each step solves `(JᵀJ + μ diag(JᵀJ)) δ = Jᵀ (p* − p)`, keeps what stays within its range, and
//! is taken if it brings the points nearer; μ shrinks after a step that does and grows after one that does not.

use crate::equilibrium::own_frame;
use nalgebra::{DMatrix, DVector};
use palmares_models::hand::Hand;
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::Config;
use palmares_sim::dynamics::tree::Kinematics;
use palmares_sim::statics::prediction::solve_loaded;
use palmares_sim::statics::rest::NoPrediction;

/// A point of a link, in the frame of its URDF link, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkPoint {
    /// Index of the link.
    pub link: usize,
    /// The point.
    pub point: Vec3,
}

/// The parts that move to bring the points to their places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Along {
    /// Every joint within its range: what fingers reach that are moved from outside.
    Joints,
    /// The motors, with the free hand at rest: what it reaches by itself.
    Motors,
}

/// A problem of inverse kinematics.
#[derive(Clone, Debug)]
pub struct Inverse {
    /// The points.
    pub points: Vec<LinkPoint>,
    /// The parts that move beside the base.
    pub along: Along,
    /// Whether the base moves.
    pub base_moves: bool,
}

/// Where base and fingers are.
#[derive(Clone, Debug, PartialEq)]
pub struct Reached {
    /// Pose of the base.
    pub base: Pose,
    /// Joint coordinates.
    pub q: Vec<f64>,
    /// σ of every motor; as at the start with [`Along::Joints`].
    pub sigma: Vec<f64>,
    /// Distance of each point from its place, m.
    pub gaps: Vec<f64>,
}

/// Most steps.
const STEPS: usize = 200;
/// It ends where a step changes the root mean square of the gaps by less, m.
const STILL_M: f64 = 1e-12;
/// Difference of coordinates, rad or m, and of σ, for derivatives.
const DIFFERENCE: f64 = 1e-6;
/// First, least and largest μ.
const DAMPING: [f64; 3] = [1e-3, 1e-12, 1e12];

impl Inverse {
    /// Brings the points as near to `places`, in the world, as it can from `base` and `sigma`.
    ///
    /// # Errors
    /// The hand has no equilibrium at a σ.
    pub fn solve(
        &self,
        config: &Config,
        hand: &Hand,
        places: &[Vec3],
        base: Pose,
        sigma: &[f64],
    ) -> Result<Reached, NoPrediction> {
        let rest = |base: Pose, sigma: &[f64]| Ok(solve_loaded(config, hand, base, sigma, &[])?.q);
        let mut now = Now { base, moved: sigma.to_vec(), q: rest(base, sigma)? };
        if self.along == Along::Joints {
            now.moved.clone_from(&now.q);
        }
        let ranges: Vec<[f64; 2]> = match self.along {
            Along::Joints => hand.coordinates.iter().map(|c| [c.lower, c.upper]).collect(),
            Along::Motors => vec![[0.0, 1.0]; sigma.len()],
        };
        let q_of = |base: Pose, moved: &[f64]| match self.along {
            Along::Joints => Ok(moved.to_vec()),
            Along::Motors => rest(base, moved),
        };
        let mut errors = self.errors(hand, places, &now);
        let mut damping = DAMPING[0];
        for _ in 0..STEPS {
            let jacobian = self.jacobian(hand, &now, &ranges, q_of)?;
            let (square, slope) = (jacobian.transpose() * &jacobian, jacobian.transpose() * &errors);
            let mut nearer = None;
            while nearer.is_none() && damping <= DAMPING[2] {
                let mut damped = square.clone();
                for k in 0..damped.nrows() {
                    // Columns of nothing stay where they are.
                    damped[(k, k)] += damping * square[(k, k)] + 1e-12;
                }
                let Some(step) = damped.cholesky().map(|factor| factor.solve(&slope)) else { break };
                let next = self.moved(&now, &step, &ranges, q_of)?;
                let after = self.errors(hand, places, &next);
                if after.norm_squared() < errors.norm_squared() {
                    nearer = Some((next, after));
                    damping = (0.2 * damping).max(DAMPING[1]);
                } else {
                    damping *= 5.0;
                }
            }
            let Some((next, after)) = nearer else { break };
            let count = places.len().max(1) as f64;
            let gain = (errors.norm() - after.norm()) / count.sqrt();
            (now, errors) = (next, after);
            if gain < STILL_M {
                break;
            }
        }
        let gaps = errors.as_slice().chunks(3).map(|e| Vec3::new(e[0], e[1], e[2]).length()).collect();
        let sigma = if self.along == Along::Motors { now.moved } else { sigma.to_vec() };
        Ok(Reached { base: now.base, q: now.q, sigma, gaps })
    }

    /// From each point to its place.
    fn errors(&self, hand: &Hand, places: &[Vec3], now: &Now) -> DVector<f64> {
        let points = self.points_at(hand, now.base, &now.q);
        let all = points.iter().zip(places).flat_map(|(point, place)| (*place - *point).to_array());
        DVector::from_iterator(3 * places.len(), all)
    }

    fn points_at(&self, hand: &Hand, base: Pose, q: &[f64]) -> Vec<Vec3> {
        let mut kin = Kinematics::default();
        kin.update(hand, base, q);
        let at = |it: &LinkPoint| own_frame(hand, &kin, it.link).transform_point(it.point);
        self.points.iter().map(at).collect()
    }

    /// Change of the points with the base's place and turn, if it moves, then with what else moves.
    fn jacobian(
        &self,
        hand: &Hand,
        now: &Now,
        ranges: &[[f64; 2]],
        q_of: impl Fn(Pose, &[f64]) -> Result<Vec<f64>, NoPrediction>,
    ) -> Result<DMatrix<f64>, NoPrediction> {
        let first = if self.base_moves { 6 } else { 0 };
        let mut jacobian = DMatrix::zeros(3 * self.points.len(), first + now.moved.len());
        if self.base_moves {
            for (k, point) in self.points_at(hand, now.base, &now.q).iter().enumerate() {
                for (column, axis) in [Vec3::X, Vec3::Y, Vec3::Z].into_iter().enumerate() {
                    let turned = axis.cross(*point - now.base.translation);
                    for row in 0..3 {
                        jacobian[(3 * k + row, column)] = axis[row];
                        jacobian[(3 * k + row, 3 + column)] = turned[row];
                    }
                }
            }
        }
        for (k, [low, high]) in ranges.iter().enumerate() {
            let at = |difference: f64| -> Result<(f64, Vec<Vec3>), NoPrediction> {
                let mut moved = now.moved.clone();
                moved[k] = (moved[k] + difference).clamp(*low, *high);
                let q = q_of(now.base, &moved)?;
                Ok((moved[k], self.points_at(hand, now.base, &q)))
            };
            let ((before, from), (after, to)) = (at(-DIFFERENCE)?, at(DIFFERENCE)?);
            if after <= before {
                continue;
            }
            for (point, (from, to)) in from.iter().zip(&to).enumerate() {
                for row in 0..3 {
                    jacobian[(3 * point + row, first + k)] = (to[row] - from[row]) / (after - before);
                }
            }
        }
        Ok(jacobian)
    }

    fn moved(
        &self,
        now: &Now,
        step: &DVector<f64>,
        ranges: &[[f64; 2]],
        q_of: impl Fn(Pose, &[f64]) -> Result<Vec<f64>, NoPrediction>,
    ) -> Result<Now, NoPrediction> {
        let first = if self.base_moves { 6 } else { 0 };
        let mut base = now.base;
        if self.base_moves {
            base.translation += Vec3::new(step[0], step[1], step[2]);
            let turn = Rotation::from_scaled_axis(Vec3::new(step[3], step[4], step[5]));
            base.rotation = (turn * base.rotation).normalize();
        }
        let moved: Vec<f64> = now
            .moved
            .iter()
            .zip(ranges)
            .enumerate()
            .map(|(k, (x, [low, high]))| (x + step[first + k]).clamp(*low, *high))
            .collect();
        let q = q_of(base, &moved)?;
        Ok(Now { base, moved, q })
    }
}

/// An iterate: the base, what moves beside it, and the joint coordinates.
struct Now {
    base: Pose,
    moved: Vec<f64>,
    q: Vec<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    fn tips(hand: &Hand) -> Vec<LinkPoint> {
        let carries = |k: usize| hand.links.iter().any(|link| link.parent == Some(k));
        let ends = (0..hand.links.len()).filter(|k| !carries(*k));
        ends.map(|link| LinkPoint { link, point: Vec3::new(0.0, 0.005, 0.01) }).collect()
    }

    fn hands() -> Vec<Arc<Hand>> {
        ["softhand", "reflex", "yale_t42"].map(|name| Hand::builtin(name).expect("built in")).into()
    }

    #[test]
    fn the_motors_and_the_base_bring_the_tips_where_they_were() {
        let config = Config::default();
        for hand in hands() {
            let inverse = Inverse { points: tips(&hand), along: Along::Motors, base_moves: true };
            let there = Pose::from_parts(
                Vec3::new(0.2, -0.1, 0.4),
                Rotation::from_scaled_axis(Vec3::new(0.3, -0.2, 0.5)),
            );
            let sigma = vec![0.45; hand.motors.len()];
            let q = solve_loaded(&config, &hand, there, &sigma, &[]).expect("at rest").q;
            let places = inverse.points_at(&hand, there, &q);
            let start = vec![0.2; hand.motors.len()];
            let found = inverse.solve(&config, &hand, &places, Pose::IDENTITY, &start).expect("found");
            assert!(found.gaps.iter().all(|gap| *gap < 1e-6), "{}: {:?}", hand.name, found.gaps);
        }
    }

    #[test]
    fn joints_stay_in_their_ranges_and_what_is_out_of_reach_has_a_gap() {
        let config = Config::default();
        for hand in hands() {
            let inverse = Inverse { points: tips(&hand), along: Along::Joints, base_moves: false };
            let q: Vec<f64> =
                hand.coordinates.iter().map(|c| (c.rest + 0.3).clamp(c.lower, c.upper)).collect();
            let places = inverse.points_at(&hand, Pose::IDENTITY, &q);
            let start = vec![0.1; hand.motors.len()];
            let found = inverse.solve(&config, &hand, &places, Pose::IDENTITY, &start).expect("found");
            assert!(found.gaps.iter().all(|gap| *gap < 1e-6), "{}: {:?}", hand.name, found.gaps);
            let far: Vec<Vec3> = places.iter().map(|place| *place + Vec3::Z).collect();
            let found =
                inverse.solve(&config, &hand, &far, Pose::IDENTITY, &start).expect("as near as it can");
            assert!(found.gaps.iter().all(|gap| *gap > 0.5));
            for (q, c) in found.q.iter().zip(&hand.coordinates) {
                assert!((c.lower..=c.upper).contains(q));
            }
        }
    }
}
