//! What the search for contacts leaves out, and whether the solution of a step reaches it.
//!
//! The search takes what the short reach of a step ([`super::reach`]) holds. The rest of what the full reach holds is listed
//! here. Once an island is solved, and before anything moves, each entry is compared with the velocities at the end of the step:
//!
//! - a point is hit if its gap φ and its normal velocity u_n give `φ + h u_n < 0`: the condition under which it would press;
//! - two shapes are hit if they overlap after both have moved by h with these velocities. Most are far enough apart: the points
//!   of a shape of radius r come nearer by at most `h (|u| + |ω| r)`, with the relative velocities u of its origin and ω.
//!
//! What is hit joins with the full reach, and the island is solved again. Left out is only what presses softly on bodies that are
//! awake: rebounds are found before a step is solved, and a body wakes before it.

use super::gap::distance;
use super::narrow_phase::{Bodies, Contacts, Shapes};
use super::reach::SHORT_M;
use crate::anchor::Pair;
use crate::bounds::{DISTANCE_WORK, POINT_WORK};
use crate::config::Config;
use crate::contact::distance_cache::DistanceCache;
use crate::dynamics::spatial::SpatialVelocity;
use crate::model::{Collider, Model, Owner};
use palmares_models::{Pose, Rotation, Vec3};

/// Something that a step reaches only with more than its short reach.
#[derive(Clone, Copy, Debug)]
pub struct LeftOut {
    /// The shapes.
    pub key: (u32, u32),
    /// Body A.
    pub a: Owner,
    /// Body B.
    pub b: Owner,
    /// Index of the pair among the near pairs.
    pub(super) index: usize,
    pub(super) what: What,
    /// Whether it has joined.
    pub joined: bool,
}

/// What of two shapes is left out.
#[derive(Clone, Copy, Debug)]
pub(super) enum What {
    /// Everything; a lower bound of their gap, m.
    Shapes(f64),
    /// A point of a near pair.
    Point {
        /// Its place in the world, m.
        at: Vec3,
        /// From A to B.
        normal: Vec3,
        /// Gap, m.
        gap: f64,
    },
}

/// How the bodies move until the end of a step.
pub(crate) struct Ends<'a> {
    pub model: &'a Model,
    /// Generalized velocity at the end.
    pub v: &'a [f64],
    /// Velocities of the links at the end, about `origin`.
    pub links: &'a [SpatialVelocity],
    /// Origin of the hand's velocities in the world, m.
    pub origin: Vec3,
    /// Poses of the objects at the start.
    pub objects: &'a [Pose],
    /// Poses of the shapes at the start.
    pub poses: &'a [Pose],
}

impl Ends<'_> {
    /// Spatial velocity of a body about a point of the world.
    fn velocity(&self, owner: Owner, at: Vec3) -> SpatialVelocity {
        match owner {
            Owner::Static => SpatialVelocity::ZERO,
            Owner::Link(i) => self.links[i].moved(at - self.origin),
            Owner::Object(k) => {
                let v = &self.v[self.model.object_dofs(k)..][..6];
                let [linear, angular] = [&v[..3], &v[3..]].map(Vec3::from_slice);
                SpatialVelocity { linear, angular }.moved(at - self.objects[k].translation)
            }
        }
    }

    /// Pose of a shape at the end.
    fn pose(&self, shape: usize, owner: Owner, h: f64) -> Pose {
        let pose = &self.poses[shape];
        let v = self.velocity(owner, pose.translation);
        let turned = Rotation::from_scaled_axis(v.angular * h) * pose.rotation;
        Pose::from_parts(pose.translation + v.linear * h, turned.normalize())
    }

    /// Whether something left out is hit. The computing is added to `spent`.
    pub(crate) fn hit(&self, left: &LeftOut, spent: &mut u64) -> bool {
        let h = self.model.config().step_s;
        *spent += POINT_WORK;
        match left.what {
            What::Point { at, normal, gap } => {
                let relative = self.velocity(left.b, at).linear - self.velocity(left.a, at).linear;
                gap + h * relative.dot(normal) < 0.0
            }
            What::Shapes(gap) => {
                let (i, j) = (left.key.0 as usize, left.key.1 as usize);
                let (a, b) = (&self.model.colliders()[i], &self.model.colliders()[j]);
                let (bounded, radius) = bounded((i, a), (j, b));
                let at = self.poses[bounded].translation;
                let relative = self.velocity(left.b, at) - self.velocity(left.a, at);
                if gap > h * (relative.linear.length() + relative.angular.length() * radius) {
                    return false;
                }
                *spent += DISTANCE_WORK;
                let [at_a, at_b] =
                    [(i, left.a), (j, left.b)].map(|(shape, owner)| self.pose(shape, owner, h));
                distance(a, b, &at_a.inv_mul(&at_b)) <= 0.0
            }
        }
    }
}

/// The shape of two that has bounds, and its radius, m.
#[inline]
pub(super) fn bounded((i, a): (usize, &Collider), (j, b): (usize, &Collider)) -> (usize, f64) {
    if b.bounding_radius.is_finite() { (j, b.bounding_radius) } else { (i, a.bounding_radius) }
}

/// Whether a step may leave out what is beyond its short reach. The step of an undamped hand has stages, each with its own search
/// for contacts.
pub(super) fn leaves_out(model: &Model, config: &Config) -> bool {
    config.from_rest(false) > SHORT_M && !model.undamped_hand()
}

impl Contacts {
    /// Lets two shapes join with the full reach of the step: `left` is what was left out of them. The index of their contact, if
    /// they have one.
    pub(crate) fn join(
        &mut self,
        bodies: &Bodies<'_>,
        shapes: &Shapes<'_>,
        distances: &mut DistanceCache,
        pairs: &mut Vec<Pair>,
        left: &LeftOut,
    ) -> Option<usize> {
        let config = bodies.model.config();
        let (i, j) = (left.key.0 as usize, left.key.1 as usize);
        let (a, b) = (&bodies.model.colliders()[i], &bodies.model.colliders()[j]);
        let reach = bodies.reach((i, a), (j, b), shapes);
        let place = match pairs.binary_search_by_key(&left.key, |pair| pair.key) {
            Ok(place) => place,
            Err(place) => {
                let mut pair = Pair::new(left.key);
                let a_from_b = shapes.poses[i].inv_mul(&shapes.poses[j]);
                self.update(config, &mut pair, (a, b), a_from_b, &reach);
                if pair.manifold.points.is_empty() {
                    return None;
                }
                distances.set_bound(left.index, 0.0);
                pairs.insert(place, pair);
                for contact in self.pairs.iter_mut().filter(|contact| contact.pair >= place) {
                    contact.pair += 1;
                }
                place
            }
        };
        if pairs[place].covered {
            return None;
        }
        let before = self.pairs.iter().position(|contact| contact.pair == place);
        let count = self.pairs.len();
        self.add(bodies, shapes.poses, (a, b), (&mut pairs[place], place), &reach, None);
        if self.pairs.len() == count {
            return None;
        }
        let Some(index) = before else { return Some(count) };
        // Its points are replaced by more of them.
        self.pairs.swap_remove(index);
        Some(index)
    }
}
