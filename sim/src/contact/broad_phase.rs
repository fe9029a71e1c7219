//! Broad phase: pairs of shapes that are close enough to check in every step.
//!
//! Every shape has an enlarged box. The list of near pairs is rebuilt only when a shape leaves its box, so
//! that most steps test a few dozen pairs instead of all. The list is a superset of the touching pairs; the
//! result of a step does not depend on it.

use crate::model::{Model, Owner};
use palmares_models::{Mat3, Pose, Vec3};
use parry3d_f64::bounding_volume::Aabb;

/// Distance by which the enlarged box exceeds the tight one, m: a hand at 1 m/s refreshes it every 20 ms.
const SLACK_M: f64 = 0.02;

/// A rebuild of the list also refits boxes with less slack than this, m: links that move together then leave
/// their boxes together, and a list lasts longer.
const SPENT_M: f64 = 0.01;

/// Enlarged boxes.
#[derive(Clone, Default)]
pub struct BroadPhase {
    boxes: Vec<Aabb>,
    /// Pairs of boxes that share a point, ascending.
    keys: Vec<(u32, u32)>,
    /// Shapes sorted by the start of their boxes along x: a box shares no point with boxes that start beyond
    /// it.
    by_x: Vec<usize>,
    /// The last list, while a new one is made.
    old: Vec<(u32, u32)>,
}

impl BroadPhase {
    /// Forces a new list on the next call of [`BroadPhase::update`].
    pub fn invalidate(&mut self) {
        self.boxes.clear();
    }

    /// Near pairs of shapes, lower index first, ascending.
    pub fn keys(&self) -> &[(u32, u32)] {
        &self.keys
    }

    /// Updates the list for the tight bounds of all shapes; false if it did not change.
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

/// Whether two shapes, lower index first, can be in contact.
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

/// Gap of two boxes along the axis that separates them best; negative where they share a point.
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
