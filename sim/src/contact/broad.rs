//! Broad phase: which pairs of shapes are near enough to be looked at in every step.
//!
//! Every shape has a generous box. Only when a shape leaves its box is the list of near pairs made anew, so
//! that most steps test a few dozen pairs instead of all. The list is a superset of what touches; a step's
//! result does not depend on it.

use super::anchor::Pair;
use crate::model::{Model, Owner};
use palmares_models::{Mat3, Pose, Vec3};
use parry3d_f64::bounding_volume::Aabb;

/// How far the generous box reaches beyond the tight one, m: a hand at 1 m/s refreshes it every 20 ms.
const SLACK_M: f64 = 0.02;

/// The generous boxes.
#[derive(Clone, Default)]
pub struct BroadPhase {
    boxes: Vec<Aabb>,
    /// Pairs from the last list, while a new one is made.
    old: Vec<Pair>,
}

impl BroadPhase {
    /// Forces a new list on the next call of [`BroadPhase::update`].
    pub fn invalidate(&mut self) {
        self.boxes.clear();
    }

    /// Brings `pairs` up to date with the tight bounds of all shapes; false when they are still the same.
    pub fn update(&mut self, model: &Model, tight: &[Aabb], pairs: &mut Vec<Pair>) -> bool {
        let fits = self.boxes.len() == tight.len()
            && self.boxes.iter().zip(tight).all(|(outer, inner)| contains(outer, inner));
        if fits {
            return false;
        }
        if self.boxes.len() == tight.len() {
            for (outer, inner) in self.boxes.iter_mut().zip(tight) {
                if !contains(outer, inner) {
                    *outer = grown(inner, SLACK_M);
                }
            }
        } else {
            self.boxes = tight.iter().map(|inner| grown(inner, SLACK_M)).collect();
        }
        std::mem::swap(pairs, &mut self.old);
        pairs.clear();
        let colliders = model.colliders();
        let mut self_pairs = model.self_pairs().iter().peekable();
        let mut old = self.old.drain(..).peekable();
        for i in 0..colliders.len() {
            for j in i + 1..colliders.len() {
                if separation(&self.boxes[i], &self.boxes[j]) > 0.0 {
                    continue;
                }
                let key = (i as u32, j as u32);
                let possible = match (colliders[i].owner, colliders[j].owner) {
                    (Owner::Static, Owner::Static) => false,
                    (Owner::Object(a), Owner::Object(b)) => a != b,
                    (Owner::Link(_), Owner::Link(_)) => {
                        while self_pairs.next_if(|&&pair| pair < key).is_some() {}
                        self_pairs.next_if_eq(&&key).is_some()
                    }
                    _ => true,
                };
                if possible {
                    while old.next_if(|pair| pair.key < key).is_some() {}
                    pairs.push(old.next_if(|pair| pair.key == key).unwrap_or_else(|| Pair::new(key)));
                }
            }
        }
        true
    }
}

/// Bounds of a shape at a world pose, grown by `margin`.
#[inline]
pub fn tight_bounds(local: &Aabb, pose: &Pose, margin: f64) -> Aabb {
    let r = Mat3::from_quat(pose.rotation);
    let center = pose.translation + r * local.center();
    let half = local.half_extents();
    let reach =
        r.x_axis.abs() * half.x + r.y_axis.abs() * half.y + r.z_axis.abs() * half.z + Vec3::splat(margin);
    Aabb { mins: center - reach, maxs: center + reach }
}

/// How far two boxes are apart along the axis that parts them best; negative where they share a point.
#[inline]
pub fn separation(a: &Aabb, b: &Aabb) -> f64 {
    (a.mins - b.maxs).max(b.mins - a.maxs).max_element()
}

#[inline]
fn contains(outer: &Aabb, inner: &Aabb) -> bool {
    outer.mins.cmple(inner.mins).all() && outer.maxs.cmpge(inner.maxs).all()
}

fn grown(inner: &Aabb, by: f64) -> Aabb {
    Aabb { mins: inner.mins - Vec3::splat(by), maxs: inner.maxs + Vec3::splat(by) }
}
