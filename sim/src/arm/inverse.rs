//! Joints of an arm for a pose of its base.
//!
//! Levenberg (1944): each step solves `(J Jᵀ + μ I) y = e`, `δ = Jᵀ y`, the least motion towards the pose, among the joints that are not
//! held by an end of their range. μ shrinks after a step that comes nearer and grows after one that does not.

use crate::actuation::base::shortest_turn;
use nalgebra::{Matrix6, Vector6};
use palmares_models::arm::Arm;
use palmares_models::{Pose, Vec3};
use std::f64::consts::PI;

/// The joints, and how far from the pose the base is then.
#[derive(Clone, Debug, PartialEq)]
pub struct Reached {
    /// rad or m
    pub q: Vec<f64>,
    /// m
    pub gap_m: f64,
    /// rad
    pub gap_rad: f64,
}

impl Reached {
    /// Whether the base is at the pose.
    pub fn is_there(&self) -> bool {
        self.gap_m < THERE && self.gap_rad < THERE
    }
}

/// Gap, m and rad, of a pose that counts as reached.
const THERE: f64 = 1e-6;
/// Length by which an angle counts as much as a distance, m.
const LEVER_M: f64 = 0.3;
/// First, least and largest μ, m².
const DAMPING: [f64; 3] = [1e-6, 1e-14, 1e2];
/// Largest motion of a joint in a step, rad or m.
const STRIDE: f64 = 0.5;
/// Steps from each start of [`place`].
const STEPS: usize = 100;
/// Number of starts of [`place`] beside the first.
const STARTS: usize = 64;
/// Rest of the gap that is rounding, m.
const ROUNDING_M: f64 = 1e-13;

/// From the base to the pose: m, and rad times `lever_m`.
fn error(arm: &Arm, q: &[f64], to: Pose, lever_m: f64) -> Vector6<f64> {
    let at = arm.base_at(q);
    let way = (to.translation - at.translation).to_array();
    let turn = (shortest_turn(at.rotation, to.rotation) * lever_m).to_array();
    Vector6::new(way[0], way[1], way[2], turn[0], turn[1], turn[2])
}

/// Brings the base from the joints `from` as near to a pose as it can in at most `steps`.
pub fn reach(arm: &Arm, from: &[f64], to: Pose, steps: usize) -> Reached {
    approach(arm, from, to, steps, LEVER_M)
}

/// [`reach`] with another lever; with 0 the base may be turned in any way.
fn approach(arm: &Arm, from: &[f64], to: Pose, steps: usize, lever_m: f64) -> Reached {
    let mut q = arm.within(from);
    let mut gap = error(arm, &q, to, lever_m);
    let mut damping = DAMPING[0];
    for _ in 0..steps {
        if gap.norm() < ROUNDING_M {
            break;
        }
        let columns: Vec<Vector6<f64>> = arm
            .jacobian(&q)
            .into_iter()
            .map(|(v, w)| {
                let w = w * lever_m;
                Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z)
            })
            .collect();
        let mut nearer = None;
        while nearer.is_none() && damping <= DAMPING[2] {
            let next = stepped(arm, &q, &columns, &gap, damping);
            let after = error(arm, &next, to, lever_m);
            if after.norm() < gap.norm() {
                nearer = Some((next, after));
                damping = (0.1 * damping).max(DAMPING[1]);
            } else {
                damping *= 10.0;
            }
        }
        let Some((next, after)) = nearer else { break };
        (q, gap) = (next, after);
    }
    let turn = gap.fixed_rows::<3>(3).norm();
    Reached {
        q,
        gap_m: gap.fixed_rows::<3>(0).norm(),
        gap_rad: if lever_m > 0.0 { turn / lever_m } else { 0.0 },
    }
}

/// `q` after a step. Joints that the step would push beyond their range are held, and the others step without them.
fn stepped(arm: &Arm, q: &[f64], columns: &[Vector6<f64>], gap: &Vector6<f64>, damping: f64) -> Vec<f64> {
    let mut held = vec![false; q.len()];
    loop {
        let mut square = Matrix6::identity() * damping;
        for (column, _) in columns.iter().zip(&held).filter(|(_, held)| !**held) {
            square += column * column.transpose();
        }
        // Positive definite by μ.
        let Some(y) = square.cholesky().map(|factor| factor.solve(gap)) else { return q.to_vec() };
        let wanted: Vec<f64> = columns
            .iter()
            .zip(&held)
            .map(|(column, held)| if *held { 0.0 } else { column.dot(&y) })
            .collect();
        let longest = wanted.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let part = if longest > STRIDE { STRIDE / longest } else { 1.0 };
        let mut next = q.to_vec();
        let mut blocked = false;
        for (k, joint) in arm.joints.iter().enumerate() {
            next[k] = q[k] + part * wanted[k];
            if next[k] < joint.lower || next[k] > joint.upper {
                next[k] = next[k].clamp(joint.lower, joint.upper);
                if next[k] == q[k] && !held[k] {
                    (held[k], blocked) = (true, true);
                }
            }
        }
        if !blocked {
            return next;
        }
    }
}

/// Joints that bring the base to a pose: from `guess`, and if that ends elsewhere from places all over the ranges. The nearest one if none
/// is at the pose.
pub fn place(arm: &Arm, guess: &[f64], to: Pose) -> Reached {
    search(arm, guess, to, LEVER_M)
}

/// Distance between a point and the nearest place to which the arm can bring the base, turned in any way, m.
pub fn distance(arm: &Arm, guess: &[f64], point: Vec3) -> f64 {
    search(arm, guess, Pose::from_translation(point), 0.0).gap_m
}

fn search(arm: &Arm, guess: &[f64], to: Pose, lever_m: f64) -> Reached {
    let mut best = approach(arm, guess, to, STEPS, lever_m);
    for k in 1..=STARTS {
        if best.is_there() {
            break;
        }
        let start: Vec<f64> = arm
            .joints
            .iter()
            .enumerate()
            .map(|(axis, joint)| {
                let (low, high) = (joint.lower.max(-PI), joint.upper.min(PI));
                let (low, high) =
                    if joint.turns && low < high { (low, high) } else { (joint.lower, joint.upper) };
                low + (high - low) * halton(k, PRIMES[axis % PRIMES.len()])
            })
            .collect();
        let found = approach(arm, &start, to, STEPS, lever_m);
        if found.gap_m + LEVER_M * found.gap_rad < best.gap_m + LEVER_M * best.gap_rad {
            best = found;
        }
    }
    best
}

/// Bases of the Halton sequence.
const PRIMES: [usize; 16] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53];

/// Number k of the Halton (1960) sequence of a base, 0 to 1: numbers that fill the range evenly.
fn halton(mut k: usize, base: usize) -> f64 {
    let (mut part, mut sum) = (1.0, 0.0);
    while k > 0 {
        part /= base as f64;
        sum += part * (k % base) as f64;
        k /= base;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use palmares_models::arm::ArmJoint;

    /// Three links of 0.4, 0.3 and 0.1 m in a plane, as in a textbook.
    fn planar() -> Arm {
        let joint = |name: &str, x: f64, most: f64| ArmJoint {
            name: name.into(),
            turns: true,
            before: Pose::translation(x, 0.0, 0.0),
            axis: Vec3::Z,
            lower: -most,
            upper: most,
            speed: 2.0,
        };
        let joints = vec![joint("a", 0.0, 3.0), joint("b", 0.4, 2.5), joint("c", 0.3, 2.0)];
        let world_from_root = Pose::IDENTITY;
        Arm {
            name: "planar".into(),
            world_from_root,
            joints,
            last_from_base: Pose::translation(0.1, 0.0, 0.0),
        }
    }

    #[test]
    fn the_base_of_a_planar_arm_is_where_trigonometry_has_it() {
        let at = planar().base_at(&[0.3, -0.5, 0.9]).translation;
        let x = 0.4 * 0.3_f64.cos() + 0.3 * (-0.2_f64).cos() + 0.1 * 0.7_f64.cos();
        let y = 0.4 * 0.3_f64.sin() + 0.3 * (-0.2_f64).sin() + 0.1 * 0.7_f64.sin();
        assert!((at - Vec3::new(x, y, 0.0)).length() < 1e-15);
    }

    #[test]
    fn the_jacobian_is_the_derivative() {
        let (arm, q, h) = (planar(), [0.3, -0.5, 0.9], 1e-6);
        for (k, (linear, angular)) in arm.jacobian(&q).into_iter().enumerate() {
            let moved = |by: f64| {
                let mut q = q;
                q[k] += by;
                arm.base_at(&q)
            };
            let (before, after) = (moved(-h), moved(h));
            assert!(((after.translation - before.translation) / (2.0 * h) - linear).length() < 1e-9);
            assert!((shortest_turn(before.rotation, after.rotation) / (2.0 * h) - angular).length() < 1e-9);
        }
    }

    #[test]
    fn poses_of_joints_are_reached_and_farther_ones_as_near_as_possible() {
        let arm = planar();
        for wanted in [[0.3, -0.5, 0.9], [-2.0, 1.9, -1.0], [2.9, -2.4, 1.9]] {
            let to = arm.base_at(&wanted);
            let found = place(&arm, &[0.0, 0.1, 0.0], to);
            assert!(found.is_there(), "{found:?}");
            assert!((arm.base_at(&found.q).translation - to.translation).length() < 1e-9);
        }
        let far = place(&arm, &[0.0, 0.1, 0.0], Pose::translation(1.0, 0.0, 0.0));
        assert!(!far.is_there());
        assert!((far.gap_m - 0.2).abs() < 1e-3 && far.gap_rad < 1e-3, "{far:?}");
    }

    #[test]
    fn no_joint_leaves_its_range() {
        let arm = planar();
        for k in 0..200 {
            let angle = 0.1 * f64::from(k);
            let to = Pose::translation(0.5 * angle.cos(), 0.9 * angle.sin(), 0.0);
            let found = reach(&arm, &[0.1, 0.2, 0.3], to, 50);
            assert_eq!(arm.within(&found.q), found.q);
        }
    }
}
