//! Joints that equalities bind: a follower's position is a polynomial of its leader's, a held joint has one position.

use super::frames::Frames;
use super::model::{JointKind, Law, Model};

/// Highest power of a leader in the position of a follower.
const DEGREE: usize = 8;
/// Longest row of joints that follow each other.
const MOST_LEADERS: usize = 64;

/// How a joint moves; positions count from the joints' references.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Motion {
    /// By itself.
    Own,
    /// Not at all.
    Held(f64),
    /// With its leader, which moves by itself: coefficients from the constant upwards.
    Follows(usize, Vec<f64>),
}

/// The motion of each joint of a document.
#[derive(Clone, Debug)]
pub(crate) struct Motions(Vec<Motion>);

impl Motions {
    /// The first equality of each joint counts, as in the hand.
    pub(crate) fn of(model: &Model, frames: &Frames) -> Motions {
        let mut first = vec![Motion::Own; model.joints.len()];
        let has = |j: usize| {
            let joint = &model.joints[j];
            frames.moves(joint.body) && matches!(joint.kind, JointKind::Hinge | JointKind::Slide)
        };
        for equality in &model.equalities {
            let Law::Joint(joint, leader, coefficients) = &equality.law else { continue };
            if first[*joint] != Motion::Own || !has(*joint) {
                continue;
            }
            first[*joint] = match leader {
                None => Motion::Held(coefficients[0]),
                Some(leader) if leader == joint || !has(*leader) => continue,
                Some(leader) => Motion::Follows(*leader, coefficients.to_vec()),
            };
        }
        Motions((0..first.len()).map(|joint| resolved(&first, joint)).collect())
    }

    /// The motion of a joint.
    pub(crate) fn joint(&self, joint: usize) -> &Motion {
        &self.0[joint]
    }

    /// Sets the positions of all joints that do not move by themselves.
    pub(crate) fn fill(&self, x: &mut [f64]) {
        for (joint, motion) in self.0.iter().enumerate() {
            match motion {
                Motion::Own => {}
                Motion::Held(at) => x[joint] = *at,
                Motion::Follows(leader, coefficients) => x[joint] = value(coefficients, x[*leader]),
            }
        }
    }

    /// The part of a joint's range that its followers leave, from its reference.
    pub(crate) fn range(&self, model: &Model, joint: usize) -> Option<[f64; 2]> {
        let of = |j: usize| model.joints[j].range.map(|range| range.map(|x| x - model.joints[j].reference));
        let mut range = of(joint);
        for (follower, motion) in self.0.iter().enumerate() {
            let Motion::Follows(leader, coefficients) = motion else { continue };
            let line = coefficients[1..].iter().enumerate().all(|(k, c)| (k == 0) == (*c != 0.0));
            let (true, true, Some(own)) = (*leader == joint, line, of(follower)) else { continue };
            let [a, b] = own.map(|x| (x - coefficients[0]) / coefficients[1]);
            let [low, high] = range.unwrap_or([f64::MIN, f64::MAX]);
            let [low, high] = [low.max(a.min(b)), high.min(a.max(b))];
            if low < high {
                range = Some([low, high]);
            }
        }
        range
    }
}

/// The motion through leaders that follow others.
fn resolved(first: &[Motion], joint: usize) -> Motion {
    let Motion::Follows(mut leader, mut law) = first[joint].clone() else { return first[joint].clone() };
    for _ in 0..MOST_LEADERS {
        match &first[leader] {
            Motion::Own => {
                let last = law.iter().rposition(|c| *c != 0.0).unwrap_or(0);
                law.truncate(last + 1);
                law.resize(law.len().max(2), 0.0);
                let moves = law[1..].iter().any(|c| *c != 0.0);
                return if moves { Motion::Follows(leader, law) } else { Motion::Held(law[0]) };
            }
            Motion::Held(at) => return Motion::Held(value(&law, *at)),
            Motion::Follows(next, inner) => {
                law = composed(&law, inner);
                leader = *next;
            }
        }
    }
    // A circle, or nearly one.
    Motion::Own
}

pub(crate) fn value(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// outer(inner(x)), without powers that a hand's polynomial does not have.
fn composed(outer: &[f64], inner: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; DEGREE + 1];
    for c in outer.iter().rev() {
        let mut next = vec![0.0; DEGREE + 1];
        for (i, a) in sum.iter().enumerate() {
            for (j, b) in inner.iter().enumerate().take_while(|(j, _)| i + j <= DEGREE) {
                next[i + j] += a * b;
            }
        }
        next[0] += c;
        sum = next;
    }
    sum
}
