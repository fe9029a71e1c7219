//! Narrow phase: contact points of near pairs.
//!
//! Every pair that may have come near (`distance_cache.rs`) goes through these steps:
//!
//! 1. two bodies at rest are left alone;
//! 2. a known gap is compared with the way of a step (`reach.rs`); what only a long way reaches is left out (`left_out.rs`);
//! 3. bounds and shapes are compared (`nearness`, `gap.rs`);
//! 4. the points are moved along or found (`pair_points.rs`);
//! 5. an overlap from the beginning counts as touching (`overlap_left`);
//! 6. the points that can touch become a contact (`collect`).

use super::bodies::{Bodies, bounded, within_hand};
use super::broad_phase::separation;
use super::distance_cache::DistanceCache;
use super::gap::still_separated;
use super::left_out::{LeftOuts, LeftPoint, leaves_out};
use super::manifold::Finder;
use super::pair_points::refresh;
use super::reach::Reach;
use super::restitution::Rebound;
use crate::anchor::{Anchor, Pair};
use crate::bounds::{DISTANCE_WORK, POINT_WORK};
use crate::config::Config;
use crate::dynamics::spatial::SpatialVelocity;
use crate::law::Law;
use crate::model::{Collider, Model, Owner, pair_friction};
use crate::surface::spin::SpinLaw;
use palmares_models::{Pose, Vec3};
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::shape::PackedFeatureId;
use std::ops::Range;

/// A contact point ready for the solver.
#[derive(Clone, Copy, Debug)]
pub struct ContactPoint {
    /// Position from the pair's origin, m.
    pub r: Vec3,
    /// Point at which friction acts, from the pair's origin, m: nearer to the middle of a patch than the
    /// point itself.
    pub friction_r: Vec3,
    /// Arm at which it acts against spin alone, m: the point's share of a patch.
    pub arm: f64,
    /// Unit normal from body A to body B.
    pub normal: Vec3,
    /// Unit tangents; `tangents[0] × tangents[1] = normal`.
    pub tangents: [Vec3; 2],
    /// Gap; negative when the shapes overlap, m.
    pub distance: f64,
    /// Memory of the point; `stretch` is rotated to world axes.
    pub anchor: Anchor,
    /// Index among the manifold's points.
    pub point: u32,
    /// Normal velocity of B against A at the start of the step, m/s; negative when they approach.
    pub approach: f64,
    /// Its rebound in this step; found before its island is solved.
    pub rebound: Option<Rebound>,
}

/// The contact points of two bodies' shapes.
#[derive(Clone, Debug)]
pub struct ContactPair {
    /// Body A.
    pub a: Owner,
    /// Body B.
    pub b: Owner,
    /// Origin of the pair's spatial quantities in the world, m: the centre of mass of an object if the pair
    /// has one, else the hand's base.
    pub origin: Vec3,
    /// Coulomb friction coefficient μ.
    pub friction: f64,
    /// Lever of rolling resistance, m.
    pub rolling_friction: f64,
    /// Law by which its points resist spin, if they do.
    pub spin: Option<SpinLaw>,
    /// Coefficient of restitution.
    pub restitution: f64,
    /// Overlap that counts as touching, m.
    pub initial_overlap: f64,
    /// Tangential displacement of bearing points that is expected beside that of their velocities, m.
    pub beside: Vec3,
    /// Indices in the list of points.
    pub points: Range<usize>,
    /// Index in the state's list of pairs.
    pub pair: usize,
}

/// All contacts of a step.
#[derive(Clone, Debug, Default)]
pub struct Contacts {
    /// In the order of the state's pairs; those that join later are behind them.
    pub pairs: Vec<ContactPair>,
    /// Grouped by pair.
    pub points: Vec<ContactPoint>,
    /// What the step may reach all the same.
    pub left_out: LeftOuts,
    /// Whether a dead blow is due; found before the islands are solved by the step.
    pub struck: bool,
    /// Limits for the reuse of a cached manifold of flat and of round shapes: cosine of the turn and square
    /// of the distance.
    reuse: Option<[(f64, f64); 2]>,
    finder: Finder,
}

/// All shapes in the world, in the order of the model's colliders.
pub struct Shapes<'a> {
    /// Their poses.
    pub poses: &'a [Pose],
    /// Their bounds, grown by the margin and the motion of a step.
    pub bounds: &'a [Aabb],
    /// Upper bounds of the speed of their points, m/s, in the world and then in the frame of the hand's base.
    pub speeds: &'a [f64],
}

/// Whether two shapes may touch in this step.
enum Nearness {
    /// They cannot; a lower bound of their gap, m.
    Separated(f64),
    /// They may; the pose of B in A's frame.
    Near(Pose),
}

impl Shapes<'_> {
    /// Compares two shapes: their bounds, and where these meet, the shapes ([`still_separated`]). `known` is their memory, if there is
    /// any, and `distances` has them at an index. The computing is added to `spent`.
    #[inline]
    fn nearness(
        &self,
        config: &Config,
        (a, b): (&Collider, &Collider),
        known: Option<&Pair>,
        (distances, index): (&mut DistanceCache, usize),
        reachable: f64,
        spent: &mut u64,
    ) -> Nearness {
        let (i, j) = distances.key(index);
        let bounds_gap = separation(&self.bounds[i], &self.bounds[j]);
        if bounds_gap > 0.0 {
            // The bounds exceed the shapes by the margin and their motion in a step.
            let ways = config.step_s * (self.speeds[i] + self.speeds[j]);
            return Nearness::Separated(bounds_gap + ways + config.margin(false));
        }
        *spent += DISTANCE_WORK;
        let a_from_b = self.poses[i].inv_mul(&self.poses[j]);
        match still_separated(known, (distances, index), (a, b), &a_from_b, reachable) {
            Some(gap) => Nearness::Separated(gap),
            None => Nearness::Near(a_from_b),
        }
    }
}

impl Contacts {
    /// Checks every near pair with at least one awake body; `distances` knows the pairs that are too far
    /// apart. Returns the computing; the search ends beyond `allowed`.
    pub fn find(
        &mut self,
        bodies: &Bodies<'_>,
        shapes: &Shapes<'_>,
        distances: &mut DistanceCache,
        pairs: &mut Vec<Pair>,
        allowed: u64,
    ) -> u64 {
        let (model, config) = (bodies.model, bodies.model.config());
        self.pairs.clear();
        self.points.clear();
        self.left_out.clear();
        let may_leave = leaves_out(model);
        self.struck = false;
        let mut spent = distances.count() as u64;
        // Near pairs and remembered ones have the same order. So the memory of the present pair is at `place`,
        // or must be inserted there.
        let (mut from, mut place) = (0, 0);
        distances.watch();
        while let Some(index) = distances.next(&mut from) {
            if spent > allowed {
                return spent;
            }
            let (i, j) = distances.key(index);
            let (a, b) = (&model.colliders()[i], &model.colliders()[j]);
            if !bodies.is_awake(a.owner) && !bodies.is_awake(b.owner) {
                distances.deactivate(index);
                continue;
            }
            let (p, q) = distances.slots(index);
            let speeds = shapes.speeds[p] + shapes.speeds[q];
            let widest = Reach::new(config, within_hand(a, b), speeds);
            let slack = distances.slack(index);
            if slack > widest.reachable {
                continue;
            }
            let may_leave = may_leave
                && a.restitution.max(b.restitution) == 0.0
                && bodies.takes_part(a.owner)
                && bodies.takes_part(b.owner);
            let listed = may_leave && !distances.waits(index);
            if may_leave && slack > widest.shortened().reachable {
                if listed {
                    self.left_out.shapes(index, slack);
                }
                continue;
            }
            let full = bodies.reach((i, a), (j, b), shapes.poses, speeds);
            let reach = if may_leave { full.shortened() } else { full };
            if slack > reach.reachable {
                if listed && slack <= full.reachable {
                    self.left_out.shapes(index, slack);
                }
                continue;
            }
            let key = (i as u32, j as u32);
            place += pairs[place..].iter().take_while(|pair| pair.key < key).count();
            let is_known = pairs.get(place).is_some_and(|pair| pair.key == key);
            let known = is_known.then(|| &pairs[place]);
            match shapes.nearness(
                config,
                (a, b),
                known,
                (&mut *distances, index),
                reach.reachable,
                &mut spent,
            ) {
                Nearness::Separated(gap) => {
                    if is_known {
                        pairs.remove(place);
                    }
                    distances.set_bound(index, gap);
                    if listed && gap <= full.reachable {
                        self.left_out.shapes(index, gap);
                    }
                }
                Nearness::Near(a_from_b) => {
                    distances.set_bound(index, 0.0);
                    if !is_known {
                        pairs.insert(place, Pair::new(key));
                    }
                    let pair = &mut pairs[place];
                    spent += self.update(config, pair, (a, b), a_from_b, &reach);
                    if pair.manifold.points.is_empty() {
                        distances.set_gap(index, 0.0, a_from_b);
                        if pair.is_blank() {
                            pairs.remove(place);
                        }
                    } else if !pair.covered {
                        spent += self.add(
                            bodies,
                            shapes.poses,
                            (a, b),
                            (pair, place),
                            &reach,
                            may_leave.then_some(index),
                        );
                    }
                }
            }
        }
        spent
    }

    /// Updates the points of a pair, and the overlap that counts as touching; returns the computing.
    #[inline(always)]
    pub(super) fn update(
        &mut self,
        config: &Config,
        pair: &mut Pair,
        (a, b): (&Collider, &Collider),
        a_from_b: Pose,
        reach: &Reach,
    ) -> u64 {
        let [flat, round] = *self.reuse.get_or_insert_with(|| {
            let flat = (libm::cos(config.manifold_reuse_rad), config.manifold_reuse_m.powi(2));
            [flat, (libm::cos(config.round_reuse_rad), config.round_reuse_m.powi(2))]
        });
        let first_sight = pair.manifold.points.is_empty() || pair.covered;
        let depth_before = -pair.updated_at.0;
        let on_furniture = a.owner == Owner::Static || b.owner == Owner::Static;
        pair.follow(&a_from_b);
        let reuse = if on_furniture && (a.is_round || b.is_round) { round } else { flat };
        let spent = refresh(&mut self.finder, pair, (a, b), &a_from_b, reach.margin, reuse, config);
        let deepest = pair.manifold.points.iter().map(|point| point.dist).fold(f64::INFINITY, f64::min);
        let placed = std::mem::take(&mut pair.placed) && -deepest > depth_before + config.overlap_m;
        // Bodies that turn reach a surface sooner than predicted. Their overlap has stored no energy before it bears, so a
        // rebound must not return any.
        let turned_in = a.restitution.max(b.restitution) > 0.0
            && deepest < -config.contact_onset_m
            && !pair.manifold.points.iter().any(|point| point.data.loaded);
        pair.initial_overlap = if turned_in {
            -deepest
        } else {
            overlap_left(config, pair.initial_overlap, deepest, first_sight || placed)
        };
        if pair.manifold.points.is_empty() {
            pair.updated_at = (0.0, Pose::IDENTITY);
            pair.mean = Anchor::default();
        } else {
            pair.updated_at = (deepest, a_from_b);
        }
        spent
    }

    /// Adds the contact of a pair that is `place`-th in the state, if one of its points can touch in this step; returns the computing.
    /// What is beyond the reach of a near pair that is not solved in full is listed as left out.
    #[inline(always)]
    pub(super) fn add(
        &mut self,
        bodies: &Bodies<'_>,
        poses: &[Pose],
        (a, b): (&Collider, &Collider),
        (pair, place): (&mut Pair, usize),
        reach: &Reach,
        near: Option<usize>,
    ) -> u64 {
        let (i, j) = (pair.key.0 as usize, pair.key.1 as usize);
        let origin = match (a.owner, b.owner) {
            (_, Owner::Object(k)) | (Owner::Object(k), _) => bodies.objects[k].translation,
            _ => bodies.dynamics.kin.origin,
        };
        let first = self.points.len();
        let relative = bodies.velocity(b.owner, origin) - bodies.velocity(a.owner, origin);
        let (bounded, radius) = bounded((j, b), (i, a));
        let way = (poses[bounded].translation - origin).length() + radius + reach.margin;
        let fastest = relative.linear.length() + relative.angular.length() * way;
        self.collect(pair, [&poses[i], &poses[j]], origin, relative, (reach, fastest, bodies.model), near);
        if self.points.len() > first {
            let friction = pair_friction(a, b);
            self.pairs.push(ContactPair {
                a: a.owner,
                b: b.owner,
                origin,
                friction,
                rolling_friction: a.rolling_friction.max(b.rolling_friction),
                spin: SpinLaw::between(&a.spin, &b.spin, friction),
                restitution: a.restitution.max(b.restitution),
                initial_overlap: pair.initial_overlap,
                beside: if bodies.model.has(Law::Anchors) {
                    poses[i].rotation * pair.beside
                } else {
                    Vec3::ZERO
                },
                points: first..self.points.len(),
                pair: place,
            });
        }
        POINT_WORK * pair.manifold.points.len() as u64
    }

    /// Collects the points that can touch in this step.
    #[inline(always)]
    fn collect(
        &mut self,
        pair: &mut Pair,
        [pose_a, pose_b]: [&Pose; 2],
        origin: Vec3,
        relative: SpatialVelocity,
        (reach, fastest, model): (&Reach, f64, &Model),
        left: Option<usize>,
    ) {
        let config = model.config();
        if !pair.manifold.points.iter().any(|point| point.data.loaded) {
            pair.mean = Anchor::default();
        }
        let normal = pose_a.rotation * pair.manifold.local_n1;
        let t1 = normal.any_orthonormal_vector();
        let t2 = normal.cross(t1);
        let deepest = pair
            .manifold
            .points
            .iter()
            .filter(|point| point.fid1 != PackedFeatureId::UNKNOWN)
            .map(|point| point.dist)
            .fold(f64::INFINITY, f64::min);
        let first = self.points.len();
        let beyond = reach.beyond(config, fastest);
        for (k, point) in pair.manifold.points.iter_mut().enumerate() {
            // The nearest points have no features. They are a contact of their own only where no corner is as
            // deep.
            let twice = point.fid1 == PackedFeatureId::UNKNOWN && deepest <= point.dist + config.coincident_m;
            if twice || left.is_none() && point.dist > beyond {
                point.data = Anchor::IDLE;
                continue;
            }
            let on_a = pose_a.transform_point(point.local_p1);
            let on_b = pose_b.transform_point(point.local_p2);
            let r = (on_a + on_b) * 0.5 - origin;
            let approach = relative.at(r).dot(normal);
            if reach.is_beyond(config, point.dist, approach) {
                let memory = point.data;
                point.data = Anchor::IDLE;
                if let Some(index) = left {
                    // As after a step without load.
                    let before = if memory.known { memory.bearing } else { pair.mean.bearing };
                    point.data = Anchor { bearing: before, ..Anchor::IDLE };
                    point.data.bearing = point.data.bearing_after(0.0, config.step_s);
                    let (at, gap) = (r + origin, point.dist);
                    self.left_out.point(index, LeftPoint { at, normal, gap, point: k, memory });
                }
                continue;
            }
            if !point.data.known {
                point.data = Anchor { known: true, loaded: false, ..pair.mean };
            }
            self.points.push(ContactPoint {
                r,
                friction_r: r,
                arm: 0.0,
                normal,
                tangents: [t1, t2],
                distance: point.dist,
                anchor: Anchor { stretch: pose_a.rotation * point.data.stretch, ..point.data },
                point: k as u32,
                approach,
                rebound: None,
            });
        }
        if model.has(Law::Patches) {
            spread_friction(&mut self.points[first..], pair.lever, config.step_s);
        }
        if !model.has(Law::Anchors) {
            self.points[first..].iter_mut().for_each(|point| point.anchor.let_go());
        }
        for point in &mut self.points[first..] {
            // A point without load has no slip of its own yet: it slips as fast as the surfaces move.
            if !point.anchor.loaded {
                let velocity = relative.at(point.friction_r);
                let across = velocity - normal * velocity.dot(normal);
                let spin = point.arm * relative.angular.dot(normal);
                point.anchor.slip = (across.length_squared() + spin * spin).sqrt();
            }
        }
    }
}

/// A point of a patch resists spin at a distance from the middle. This part of its square is the offset of the
/// point of friction; the rest is the arm of the point's own spin. The offset alone would brake the slip of a
/// fast spinning disc a quarter too little.
const ASIDE: f64 = 0.8;

/// Moves the points of friction of a patch towards the recent centre of the load. A patch without a recent load
/// has the centre of the depths that the step brings. If the depths were always used, a chattering patch would
/// not come to rest.
#[inline]
fn spread_friction(points: &mut [ContactPoint], lever: f64, step_s: f64) {
    if points.len() < 2 {
        return;
    }
    let carried: f64 = points.iter().map(|point| point.anchor.bearing).sum();
    let weight = |point: &ContactPoint| {
        let depth = -(point.distance + step_s * point.approach);
        if carried > 0.0 { point.anchor.bearing } else { depth.max(0.0) }
    };
    let (sum, whole) = points.iter().fold((Vec3::ZERO, 0.0), |(sum, whole), point| {
        let weight = weight(point);
        (sum + point.r * weight, whole + weight)
    });
    let center = if whole > 0.0 {
        sum / whole
    } else {
        points.iter().fold(Vec3::ZERO, |sum, point| sum + point.r) / points.len() as f64
    };
    for point in points {
        let aside = (point.r - center) * lever;
        point.friction_r = center + aside * ASIDE.sqrt();
        point.arm = ((1.0 - ASIDE) * aside.length_squared()).sqrt();
    }
}

/// Overlap that counts as touching, m. A first overlap deeper than `Config::overlap_m` comes from placing the bodies. It
/// shrinks at `Config::separation_speed`, and is never more than the present overlap.
fn overlap_left(config: &Config, before: f64, deepest: f64, first_sight: bool) -> f64 {
    let taken_back = before - config.separation_speed * config.step_s;
    let counts = if first_sight && deepest < -config.overlap_m { -deepest } else { taken_back };
    counts.min(-deepest).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_overlap_of_bodies_that_were_placed_into_each_other_is_removed_slowly() {
        let config = Config::with_step(1e-3);
        let deep = 10.0 * config.overlap_m;
        let left = overlap_left(&config, 0.0, -deep, true);
        assert_eq!(left, deep, "it counts as touching");
        let later = overlap_left(&config, left, -deep, false);
        assert!((left - later - config.separation_speed * config.step_s).abs() < 1e-15, "{later}");
        // Shapes that separate by themselves do not return to the overlap; a later overlap is removed at once.
        assert_eq!(overlap_left(&config, left, -0.5 * deep, false), 0.5 * deep);
        assert_eq!(overlap_left(&config, left, f64::INFINITY, false), 0.0);
        assert_eq!(overlap_left(&config, 0.0, -deep, false), 0.0);
        assert_eq!(overlap_left(&config, 0.0, -0.5 * config.overlap_m, true), 0.0);
    }
}
