//! Closed chains of links: the gap of a pin at some coordinates, with its derivatives, and the coordinates that close it.

use super::{Hand, HingeKind, Linkage};
use crate::{Pose, Vec3};
use nalgebra::{DMatrix, DVector};

/// A pin at some coordinates, in the base frame.
#[derive(Clone, Debug, Default)]
pub struct Gap {
    /// Second point minus first, m.
    pub gap: Vec3,
    /// ∂gap/∂q: (coordinate, derivative), ascending by coordinate.
    pub gradient: Vec<(usize, Vec3)>,
    /// Hinges that move the gap, from the base outwards; those of the second link have sign 1.
    hinges: [Vec<MovingHinge>; 2],
}

/// A hinge at some coordinates.
#[derive(Clone, Copy, Debug)]
struct MovingHinge {
    coordinate: usize,
    /// Angular velocity at unit speed of the coordinate: zero for a slide.
    turn: Vec3,
    /// Velocity of the pin at unit speed of the coordinate.
    velocity: Vec3,
}

impl Linkage {
    /// The pin at coordinates q.
    pub fn at(&self, hand: &Hand, q: &[f64]) -> Gap {
        let mut gap = Gap::default();
        let mut ends = [Vec3::ZERO; 2];
        for (side, end) in ends.iter_mut().enumerate() {
            let mut chain = Vec::new();
            let mut next = Some(self.links[side]);
            while let Some(link) = next {
                chain.push(link);
                next = hand.links[link].parent;
            }
            let mut pose = Pose::IDENTITY;
            let mut hinges: Vec<(MovingHinge, Vec3)> = Vec::new();
            for &link in chain.iter().rev() {
                let Some(joint) = &hand.links[link].joint else { continue };
                for hinge in &joint.hinges {
                    let frame = pose * hinge.parent_from_hinge;
                    let axis = frame.rotation * hinge.axis * hinge.ratio;
                    let (turn, velocity) = match hinge.kind {
                        HingeKind::Revolute => (axis, Vec3::ZERO),
                        HingeKind::Prismatic => (Vec3::ZERO, axis),
                    };
                    let moving = MovingHinge { coordinate: joint.coordinate, turn, velocity };
                    hinges.push((moving, frame.translation));
                    pose *= hinge.pose(q[joint.coordinate]);
                }
            }
            *end = pose.transform_point(self.points[side]);
            gap.hinges[side].extend(hinges.into_iter().map(|(mut hinge, origin)| {
                hinge.velocity += hinge.turn.cross(*end - origin);
                hinge
            }));
        }
        gap.gap = ends[1] - ends[0];
        for (hinges, sign) in gap.hinges.iter().zip([-1.0, 1.0]) {
            for hinge in hinges {
                let change = hinge.velocity * sign;
                match gap.gradient.binary_search_by_key(&hinge.coordinate, |entry| entry.0) {
                    Ok(i) => gap.gradient[i].1 += change,
                    Err(i) => gap.gradient.insert(i, (hinge.coordinate, change)),
                }
            }
        }
        gap
    }
}

/// Steps in which [`Hand::close_chains`] closes a chain.
const CLOSING_STEPS: usize = 100;
/// Gap of a closed pin, m.
const CLOSED_M: f64 = 1e-12;

impl Hand {
    /// Moves q within its limits until all pins are closed, by the shortest way (Gauss and Newton); as far as possible if they cannot
    /// be closed.
    pub fn close_chains(&self, q: &mut [f64]) {
        self.close_chains_by(q, |_| 1.0);
    }

    /// The same, where a coordinate moves in proportion to its mobility: one with a small mobility moves only where the others
    /// cannot close the pins.
    pub fn close_chains_by(&self, q: &mut [f64], mobility: impl Fn(usize) -> f64) {
        let rows = 3 * self.linkages.len();
        for _ in 0..if rows == 0 { 0 } else { CLOSING_STEPS } {
            let gaps: Vec<Gap> = self.linkages.iter().map(|pin| pin.at(self, q)).collect();
            if gaps.iter().all(|gap| gap.gap.length() < CLOSED_M) {
                return;
            }
            let mut jacobian = DMatrix::<f64>::zeros(rows, q.len());
            let mut gap = DVector::zeros(rows);
            for (k, at) in gaps.iter().enumerate() {
                for (axis, x) in at.gap.to_array().into_iter().enumerate() {
                    gap[3 * k + axis] = x;
                }
                for (c, change) in &at.gradient {
                    let root = mobility(*c).sqrt();
                    for (axis, x) in change.to_array().into_iter().enumerate() {
                        jacobian[(3 * k + axis, *c)] = x * root;
                    }
                }
            }
            let mut square = &jacobian * jacobian.transpose();
            // A hinge's pin has no motion along its axis: the matrix is singular without this.
            let damping = 1e-9 * square.diagonal().max();
            (0..rows).for_each(|i| square[(i, i)] += damping);
            let Some(factor) = square.cholesky() else { return };
            let step = jacobian.tr_mul(&factor.solve(&gap));
            for (i, c) in self.coordinates.iter().enumerate() {
                q[i] = (q[i] - step[i] * mobility(i).sqrt()).clamp(c.lower, c.upper);
            }
        }
    }

    /// Coordinates that a pin constrains, ascending: those that move one of its links without the other.
    pub fn linked_coordinates(&self) -> Vec<usize> {
        let moving = |mut link: usize| {
            let mut all = Vec::new();
            while let (Some(parent), Some(joint)) = (self.links[link].parent, &self.links[link].joint) {
                all.push((link, joint.coordinate));
                link = parent;
            }
            all
        };
        let mut linked: Vec<usize> = Vec::new();
        for pin in &self.linkages {
            let [a, b] = pin.links.map(moving);
            linked.extend(a.iter().filter(|one| !b.contains(one)).map(|one| one.1));
            linked.extend(b.iter().filter(|one| !a.contains(one)).map(|one| one.1));
        }
        linked.sort_unstable();
        linked.dedup();
        linked
    }
}

impl Gap {
    /// Second derivative of `along · gap`: calls `add` with (row, column, value), for both halves of the symmetric matrix.
    pub fn curvature(&self, along: Vec3, mut add: impl FnMut(usize, usize, f64)) {
        for (hinges, sign) in self.hinges.iter().zip([-1.0, 1.0]) {
            for (i, near) in hinges.iter().enumerate() {
                // The near hinge turns the velocity that the far one gives to the pin.
                for (j, far) in hinges.iter().enumerate().skip(i) {
                    let value = sign * along.dot(near.turn.cross(far.velocity));
                    add(near.coordinate, far.coordinate, value);
                    if i != j {
                        add(far.coordinate, near.coordinate, value);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::LinkageNumbers;
    use super::*;

    /// A pin between fingertips of a built-in hand: nonsense as a mechanism, and a chain of every kind of joint.
    fn pins() -> Vec<(Hand, Linkage)> {
        let pin = |name: &str| {
            let hand = Hand::clone(&Hand::builtin(name).expect("it is built in"));
            let last = hand.links.len() - 1;
            let points = [Vec3::new(0.01, -0.02, 0.03), Vec3::new(-0.005, 0.004, 0.02)];
            let numbers = LinkageNumbers { stiffness: 1e6, damping: 0.0 };
            let pin = Linkage { name: "pin".into(), links: [last, last / 2], points, numbers };
            (hand, pin)
        };
        ["softhand", "reflex", "pinch"].map(pin).into()
    }

    #[test]
    fn gradient_and_curvature_are_those_of_the_gap() {
        for (hand, pin) in pins() {
            let n = hand.coordinates.len();
            let q: Vec<f64> = (0..n).map(|i| 0.1 + 0.07 * (i as f64 * 1.7).sin()).collect();
            let (h, along) = (1e-6, Vec3::new(0.3, -0.5, 0.8));
            let at = |k: usize, by: f64| {
                let mut q = q.clone();
                q[k] += by;
                pin.at(&hand, &q)
            };
            let dense = |gap: &Gap| {
                let mut dense = vec![Vec3::ZERO; n];
                gap.gradient.iter().for_each(|&(c, change)| dense[c] += change);
                dense
            };
            let here = pin.at(&hand, &q);
            let mut curvature = vec![0.0; n * n];
            here.curvature(along, |i, j, x| curvature[i * n + j] += x);
            for k in 0..n {
                let (before, after) = (at(k, -h), at(k, h));
                let slope = (after.gap - before.gap) / (2.0 * h);
                assert!((dense(&here)[k] - slope).length() < 1e-9, "{}: {k}", hand.name);
                for (j, (after, before)) in dense(&after).iter().zip(dense(&before)).enumerate() {
                    let second = along.dot(*after - before) / (2.0 * h);
                    assert!((curvature[j * n + k] - second).abs() < 1e-8, "{}: {j} {k}", hand.name);
                }
            }
            let poses = hand.base_from_links(&q);
            let [a, b] = [0, 1].map(|i| poses[pin.links[i]].transform_point(pin.points[i]));
            assert!((here.gap - (b - a)).length() < 1e-15);
        }
    }
}
