//! Broad phase: which pairs of shapes are near enough to be looked at in every step.
//!
//! Every shape has a generous box. Only when a shape leaves its box is the list of near pairs made anew, so
//! that most steps test a few dozen pairs instead of all. The list is a superset of what touches; a step's
//! result does not depend on it.

use crate::model::{Model, Owner};
use palmares_models::{Mat3, Pose, Vec3};
use parry3d_f64::bounding_volume::Aabb;

/// How far the generous box reaches beyond the tight one, m: a hand at 1 m/s refreshes it every 20 ms.
const SLACK_M: f64 = 0.02;

/// When a list is made, boxes are renewed that leave less than this, m: links that move together then leave theirs together,
/// and a list serves for longer.
const SPENT_M: f64 = 0.01;

/// The generous boxes.
#[derive(Clone, Default)]
pub struct BroadPhase {
    boxes: Vec<Aabb>,
    /// Pairs of boxes that share a point, ascending.
    keys: Vec<(u32, u32)>,
    /// The shapes, by where their boxes begin along x: a box shares no point with those that begin beyond it.
    by_x: Vec<usize>,
    /// The last list, while a new one is made.
    old: Vec<(u32, u32)>,
}

impl BroadPhase {
    /// Forces a new list on the next call of [`BroadPhase::update`].
    pub fn invalidate(&mut self) {
        self.boxes.clear();
    }

    /// The near pairs of shapes, the lower place first, ascending.
    pub fn keys(&self) -> &[(u32, u32)] {
        &self.keys
    }

    /// Brings the list up to date with the tight bounds of all shapes; false when it is still the same.
    pub fn update(&mut self, model: &Model, tight: &[Aabb]) -> bool {
        let known = self.boxes.len() == tight.len();
        if known && self.boxes.iter().zip(tight).all(|(outer, inner)| contains(outer, inner)) {
            return false;
        }
        if known {
            for (outer, inner) in self.boxes.iter_mut().zip(tight) {
                if !contains(outer, &grown(inner, SPENT_M)) {
                    *outer = grown(inner, SLACK_M);
                }
            }
        } else {
            self.boxes.clear();
            self.boxes.extend(tight.iter().map(|inner| grown(inner, SLACK_M)));
        }
        self.old.clone_from(&self.keys);
        self.list(model);
        !known || self.old != self.keys
    }

    /// Lists the near pairs.
    fn list(&mut self, model: &Model) {
        self.by_x.clear();
        self.by_x.extend(0..self.boxes.len());
        self.by_x.sort_unstable_by(|&i, &j| self.boxes[i].mins.x.total_cmp(&self.boxes[j].mins.x));
        self.keys.clear();
        for (k, &i) in self.by_x.iter().enumerate() {
            let own = &self.boxes[i];
            for &j in &self.by_x[k + 1..] {
                let other = &self.boxes[j];
                if other.mins.x > own.maxs.x {
                    break;
                }
                if separation(own, other) <= 0.0 && may_touch(model, i.min(j), i.max(j)) {
                    self.keys.push((i.min(j) as u32, i.max(j) as u32));
                }
            }
        }
        self.keys.sort_unstable();
    }
}

/// Whether two shapes, the lower place first, can be in contact.
fn may_touch(model: &Model, i: usize, j: usize) -> bool {
    match (model.colliders()[i].owner, model.colliders()[j].owner) {
        (Owner::Static, Owner::Static) => false,
        (Owner::Object(a), Owner::Object(b)) => a != b,
        (Owner::Link(_), Owner::Link(_)) => model.self_pairs().binary_search(&(i as u32, j as u32)).is_ok(),
        _ => true,
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
