//! Narrow phase: contact points of near pairs.

use super::broad_phase::separation;
use super::distance_cache::DistanceCache;
use super::gap::still_apart;
use super::manifold::{self, Finder};
use super::restitution::Rebound;
use crate::anchor::{Anchor, Pair};
use crate::bounds::{DISTANCE_WORK, MANIFOLD_WORK, POINT_WORK};
use crate::config::Config;
use crate::dynamics::hand::HandDynamics;
use crate::dynamics::spatial::SpatialVelocity;
use crate::model::{Collider, Model, Owner, pair_friction};
use crate::state::Sleep;
use crate::surface::spin::SpinLaw;
use palmares_models::{Pose, Vec3};
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::query::{
    ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher, TrackedContact,
};
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
    /// Indices in the list of points.
    pub points: Range<usize>,
    /// Index in the state's list of pairs.
    pub pair: usize,
}

/// All contacts of a step.
#[derive(Clone, Debug, Default)]
pub struct Contacts {
    /// In the order of the state's pairs.
    pub pairs: Vec<ContactPair>,
    /// Grouped by pair.
    pub points: Vec<ContactPoint>,
    /// Limits for the reuse of a cached manifold of flat and of round shapes: cosine of the turn and square
    /// of the distance.
    reuse: Option<[(f64, f64); 2]>,
    finder: Finder,
}

/// The bodies of a world and how they move.
pub struct Bodies<'a> {
    /// Model of the world.
    pub(crate) model: &'a Model,
    /// Dynamics of the hand.
    pub(crate) dynamics: &'a HandDynamics,
    /// Generalized velocity.
    pub(crate) v: &'a [f64],
    /// Central poses of the objects.
    pub(crate) objects: &'a [Pose],
    /// Sleep state of the objects.
    pub(crate) sleep: &'a [Sleep],
}

impl Bodies<'_> {
    /// SpatialVelocity of a body about a point of the world.
    #[inline(always)]
    pub fn velocity(&self, owner: Owner, at: Vec3) -> SpatialVelocity {
        match owner {
            Owner::Static => SpatialVelocity::ZERO,
            Owner::Link(i) => self.dynamics.recursion.velocity[i].moved(at - self.dynamics.kin.origin),
            Owner::Object(k) => {
                let v = &self.v[self.model.object_dofs(k)..];
                let motion = SpatialVelocity {
                    linear: Vec3::new(v[0], v[1], v[2]),
                    angular: Vec3::new(v[3], v[4], v[5]),
                };
                motion.moved(at - self.objects[k].translation)
            }
        }
    }

    /// Whether a body may move in this step.
    #[inline]
    pub fn is_awake(&self, owner: Owner) -> bool {
        match owner {
            Owner::Static => false,
            Owner::Link(_) => true,
            Owner::Object(k) => !self.sleep[k].asleep,
        }
    }
}

/// All shapes in the world, in the order of the model's colliders.
pub struct Shapes<'a> {
    /// Their poses.
    pub poses: &'a [Pose],
    /// Their bounds, grown by the margin and the motion of a step.
    pub bounds: &'a [Aabb],
    /// Upper bounds of the speed of their points, m/s.
    pub speeds: &'a [f64],
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
        let (model, Shapes { poses, bounds, speeds }) = (bodies.model, shapes);
        self.pairs.clear();
        self.points.clear();
        let mut spent = distances.count() as u64;
        let config = model.config();
        let [flat, round] = *self.reuse.get_or_insert_with(|| {
            let flat = (libm::cos(config.manifold_reuse_rad), config.manifold_reuse_m.powi(2));
            [flat, (libm::cos(config.round_reuse_rad), config.round_reuse_m.powi(2))]
        });
        // Near pairs and remembered ones have the same order: the memory of the present pair is, or belongs,
        // at `place`.
        let (mut next, mut place) = (0, 0);
        while let Some(index) = distances.next(next) {
            next = index + 1;
            if spent > allowed {
                return spent;
            }
            let (i, j) = distances.key(index);
            let (a, b) = (&model.colliders()[i], &model.colliders()[j]);
            if !bodies.is_awake(a.owner) && !bodies.is_awake(b.owner) {
                distances.deactivate(index);
                continue;
            }
            // At most twice the present approach speed, and the speed that a step may add from rest.
            let approach = config.step_s * (speeds[i] + speeds[j]);
            let within_hand = matches!((a.owner, b.owner), (Owner::Link(_), Owner::Link(_)));
            let from_rest = config.from_rest(within_hand);
            let margin = config.margin(within_hand) + approach;
            let reachable = (from_rest + 2.0 * approach).min(margin);
            if distances.slack(index) > reachable {
                continue;
            }
            let key = (i as u32, j as u32);
            place += pairs[place..].iter().take_while(|pair| pair.key < key).count();
            let is_known = pairs.get(place).is_some_and(|pair| pair.key == key);
            let parted = separation(&bounds[i], &bounds[j]);
            if parted > 0.0 {
                if is_known {
                    pairs.remove(place);
                }
                // The bounds exceed the shapes by the margin and their motion in a step.
                distances.set_bound(index, parted + approach + config.margin(false));
                continue;
            }
            spent += DISTANCE_WORK;
            let a_from_b = poses[i].inv_mul(&poses[j]);
            let known = is_known.then(|| &pairs[place]);
            if let Some(apart) = still_apart(known, (&mut *distances, index), (a, b), &a_from_b, reachable) {
                if is_known {
                    pairs.remove(place);
                }
                distances.set_bound(index, apart);
                continue;
            }
            distances.set_bound(index, 0.0);
            if !is_known {
                pairs.insert(place, Pair::new(key));
            }
            let pair = &mut pairs[place];
            let first_sight = pair.manifold.points.is_empty() || pair.covered;
            let on_furniture = a.owner == Owner::Static || b.owner == Owner::Static;
            let reuse = if on_furniture && (a.is_round || b.is_round) { round } else { flat };
            if !still_valid(pair, a, b, &a_from_b, reuse) {
                spent += MANIFOLD_WORK;
                if a.is_ball || b.is_ball {
                    find_point(&mut pair.manifold, a, b, &a_from_b, margin);
                    self.finder.rule_point(&mut pair.manifold, a, b, &a_from_b);
                } else {
                    self.finder.find(pair, a, b, &a_from_b, margin);
                    merge_coincident(&mut pair.manifold, config.coincident_m.powi(2));
                    remember(
                        &mut pair.manifold.points,
                        self.finder.before(),
                        config.manifold_reuse_m.powi(2),
                    );
                }
            }
            let deepest = pair.manifold.points.iter().map(|point| point.dist).fold(f64::INFINITY, f64::min);
            // Bodies first found with a deeper overlap than `Config::overlap_m` were placed so; the overlap
            // is removed at `Config::separation_speed`.
            let taken_back = pair.initial_overlap - config.separation_speed * config.step_s;
            pair.initial_overlap =
                if first_sight && deepest < -config.overlap_m { -deepest } else { taken_back };
            pair.initial_overlap = pair.initial_overlap.min(-deepest).max(0.0);
            pair.seen = (0.0, Pose::IDENTITY);
            if pair.manifold.points.is_empty() {
                distances.set_gap(index, 0.0, a_from_b);
                pair.mean = Anchor::default();
                if pair.is_blank() {
                    pairs.remove(place);
                }
                continue;
            }
            pair.seen = (deepest, a_from_b);
            if pair.covered {
                continue;
            }
            let origin = match (a.owner, b.owner) {
                (_, Owner::Object(k)) | (Owner::Object(k), _) => bodies.objects[k].translation,
                _ => bodies.dynamics.kin.origin,
            };
            let first = self.points.len();
            let relative = bodies.velocity(b.owner, origin) - bodies.velocity(a.owner, origin);
            // Gap that no point between the shapes can use up in this step: twice the present approach speed,
            // and the speed that a step may add from rest.
            let (bounded, radius) =
                if a.bounding_radius.is_finite() { (i, a.bounding_radius) } else { (j, b.bounding_radius) };
            let way = (poses[bounded].translation - origin).length() + radius + margin;
            let fastest = relative.linear.length() + relative.angular.length() * way;
            let farthest = 1.001 * (from_rest + 2.0 * config.step_s * fastest);
            self.collect(pair, &poses[i], &poses[j], origin, relative, (from_rest, farthest, config));
            spent += POINT_WORK * pair.manifold.points.len() as u64;
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
                    points: first..self.points.len(),
                    pair: place,
                });
            }
        }
        spent
    }

    /// Collects the points that can touch in this step.
    fn collect(
        &mut self,
        pair: &mut Pair,
        pose_a: &Pose,
        pose_b: &Pose,
        origin: Vec3,
        relative: SpatialVelocity,
        (from_rest, farthest, config): (f64, f64, &Config),
    ) {
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
        for (k, point) in pair.manifold.points.iter_mut().enumerate() {
            // The nearest points, which have no features, are a contact of their own only where no corner is
            // as deep.
            let twice = point.fid1 == PackedFeatureId::UNKNOWN && deepest <= point.dist + config.coincident_m;
            if twice || point.dist > farthest {
                point.data = Anchor::IDLE;
                continue;
            }
            let on_a = pose_a.transform_point(point.local_p1);
            let on_b = pose_b.transform_point(point.local_p2);
            let r = (on_a + on_b) * 0.5 - origin;
            // Twice the present approach speed, and the speed that a step may add from rest.
            let velocity = relative.at(r);
            let approach = velocity.dot(normal);
            if point.dist > from_rest + 2.0 * approach.abs() * config.step_s {
                point.data = Anchor::IDLE;
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
        spread_friction(&mut self.points[first..], pair.lever, config.step_s);
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

/// Part of the square of the distance at which a patch's point resists spin that is an offset from the
/// middle; the rest is the arm of its own spin. Points alone would brake the slip of a fast spinning disc a
/// quarter too little.
const ASIDE: f64 = 0.8;

/// Moves the points of friction of a patch together, about the recent centre of the load; without one, about
/// that of the depths that the step brings. If the depths were always used, a chattering patch would not come
/// to rest.
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

/// Like [`manifold::apart`], for any shapes but a ground.
pub(super) fn apart(
    a: &Collider,
    b: &Collider,
    a_from_b: &Pose,
    reach: f64,
    last: Vec3,
) -> Option<(Vec3, f64)> {
    if !(a.is_ball || b.is_ball) {
        return manifold::apart(a, b, a_from_b, reach, last);
    }
    let mut found = ContactManifold::new();
    find_point(&mut found, a, b, a_from_b, reach);
    let distance = found.points.first()?.dist;
    Some((found.local_n1.normalize_or(Vec3::Z), distance))
}

/// Whether the points of a pair can be reused. parry's own reuse (up to 1 mm and 1°) gives energy to a
/// rolling cylinder; without any reuse polyhedra flicker. So the decision is made here, with much tighter
/// limits.
fn still_valid(
    pair: &mut Pair,
    a: &Collider,
    b: &Collider,
    a_from_b: &Pose,
    (cosine, squared): (f64, f64),
) -> bool {
    !(a.is_ball || b.is_ball) && pair.manifold.try_update_contacts_eps(a_from_b, cosine, squared)
}

/// The point of a ball and another shape, with the memory of the one before.
fn find_point(
    manifold: &mut ContactManifold<(), Anchor>,
    a: &Collider,
    b: &Collider,
    a_from_b: &Pose,
    margin: f64,
) {
    // On a capsule's core, a segment, a ball's centre has no normal.
    let cores = !(a.is_round || b.is_round);
    let [on_a, on_b] = [a, b].map(|of| if cores { (&*of.core, of.rounding) } else { (&*of.shape, 0.0) });
    let margin = margin + on_a.1 + on_b.1;
    let supported = DefaultQueryDispatcher
        .contact_manifold_convex_convex(a_from_b, on_a.0, on_b.0, None, None, margin, manifold);
    debug_assert!(supported.is_ok(), "every convex shape has a contact algorithm with a ball");
    for point in &mut manifold.points {
        point.local_p1 += manifold.local_n1 * on_a.1;
        point.local_p2 += manifold.local_n2 * on_b.1;
        point.dist -= on_a.1 + on_b.1;
    }
}

/// Gives points that parry considers new the memory of the nearest old one, if it was at the same position of
/// a shape. Of points that share a position only one is kept, and rounding decides which features it has the
/// next time: a grasp would lose its friction with them.
fn remember(points: &mut [TrackedContact<Anchor>], before: &[TrackedContact<Anchor>], within_squared: f64) {
    for point in points.iter_mut().filter(|point| !point.data.known) {
        let moved = |old: &TrackedContact<Anchor>| {
            let on_a = old.local_p1.distance_squared(point.local_p1);
            on_a.min(old.local_p2.distance_squared(point.local_p2))
        };
        let known = before.iter().filter(|old| old.data.known).map(|old| (moved(old), old));
        if let Some((squared, old)) = known.min_by(|a, b| a.0.total_cmp(&b.0))
            && squared < within_squared
        {
            point.data = old.data;
        }
    }
}

/// Keeps one of the points that share a position: the first, with the memory of any. Where a line passes over
/// a corner, rounding decides how many crossings with the adjacent edges parry finds, and each would press
/// like a point.
fn merge_coincident(manifold: &mut ContactManifold<(), Anchor>, within_squared: f64) {
    let points = &mut manifold.points;
    let mut kept = 0;
    for k in 0..points.len() {
        let point = points[k];
        let same = |other: &TrackedContact<Anchor>| {
            other.local_p1.distance_squared(point.local_p1) < within_squared
                && other.local_p2.distance_squared(point.local_p2) < within_squared
        };
        match points[..kept].iter_mut().find(|other| same(other)) {
            Some(other) if !other.data.known => other.data = point.data,
            Some(_) => {}
            None => {
                points[kept] = point;
                kept += 1;
            }
        }
    }
    points.truncate(kept);
}

#[cfg(test)]
mod tests {
    use super::*;
    use palmares_models::Rotation;
    use palmares_models::shape::Shape;

    fn point(x: f64, stretch: f64, known: bool) -> TrackedContact<Anchor> {
        let place = Vec3::new(x, 0.0, 0.0);
        let mut point =
            TrackedContact::new(place, place, PackedFeatureId::UNKNOWN, PackedFeatureId::UNKNOWN, 0.0);
        point.data = Anchor { known, stretch: Vec3::new(0.0, stretch, 0.0), ..Anchor::default() };
        point
    }

    #[test]
    fn a_point_with_other_features_in_the_place_of_an_old_one_remembers() {
        let before = [point(0.0, 1.0, true), point(0.01, 2.0, true), point(0.02, 3.0, false)];
        let mut points = [point(0.01, 0.0, false), point(0.0, 5.0, true), point(0.02, 0.0, false)];
        remember(&mut points, &before, 1e-10);
        assert_eq!(points.map(|point| point.data.stretch.y), [2.0, 5.0, 0.0]);
        assert_eq!(points.map(|point| point.data.known), [true, true, false]);
    }

    /// A rounded box and a capsule, then a ball.
    fn colliders() -> Vec<Collider> {
        let mut model = Model::new(Config::default(), None).expect("no hand");
        for shape in [
            Shape::Box { half_extents: [0.03, 0.02, 0.01], rounding: 0.004 },
            Shape::Capsule { half_length: 0.02, radius: 0.008 },
            Shape::Sphere { radius: 0.0065 },
        ] {
            model.add_static("shape", &shape, Pose::IDENTITY, 0.5).expect("it fits");
        }
        model.colliders().to_vec()
    }

    #[test]
    fn a_ball_touches_a_rounded_box_where_geometry_says() {
        let shapes = colliders();
        let (round, ball) = (&shapes[0], &shapes[2]);
        // Next to the face, the edge and the corner of the inner box; all but the last overlap or touch.
        let sharp = Vec3::new(0.026, 0.016, 0.006);
        for beyond in [(0.0, 0.0, 0.01), (0.0, 0.006, 0.008), (0.005, 0.006, 0.007), (-0.03, -0.02, -0.001)] {
            let beyond = Vec3::new(beyond.0, beyond.1, beyond.2);
            let mut pair = Pair::new((0, 1));
            find_point(
                &mut pair.manifold,
                round,
                ball,
                &Pose::from_parts(sharp + beyond, Rotation::IDENTITY),
                0.01,
            );
            let inside = beyond.max_element() < 0.0;
            let out = if inside { Vec3::Z } else { beyond.max(Vec3::ZERO).normalize() };
            let way = if inside { beyond.z } else { beyond.max(Vec3::ZERO).length() };
            let point = pair.manifold.points[0];
            assert!((pair.manifold.local_n1 - out).length() < 1e-14, "{beyond}");
            assert!((point.dist - (way - 0.004 - 0.0065)).abs() < 1e-15, "{beyond}: {}", point.dist);
            assert!((point.local_p2 + out * 0.0065).length() < 1e-15, "{beyond}");
            let surface = sharp + beyond.min(Vec3::ZERO) + out * 0.004;
            assert!(inside || (point.local_p1 - surface).length() < 1e-15, "{beyond}: {}", point.local_p1);
        }
    }
}
