//! What the search for contacts leaves out, and whether the solution of a step reaches it.
//!
//! The search takes what the short reach of a step ([`super::reach`]) holds. The rest of what the full reach holds is listed
//! here. Once an island is solved, and before anything moves, each entry is compared with the velocities at the end of the step:
//!
//! - a point is hit if its gap φ and its normal velocity u_n give `φ + h u_n < 0`: the condition under which it would press;
//! - two shapes are hit if they overlap after both have moved by h with these velocities. Most are far enough apart: the points
//!   of a shape of radius r come nearer by at most `h (|u| + |ω| r)`, with the relative velocities u of its origin and ω.
//!
//! A step that changes the speed of no point by more than `w/2h` hits nothing, since all that is left out is farther than `w + h u`
//! by the speeds u at the start: most steps end here.
//!
//! Pairs of the hand with itself and with furniture are not even listed before that ([`DistanceCache::waiting`]): their island is
//! known, and the changes of the links' speeds tell which of them a step can reach.
//!
//! What is hit joins with the full reach, and the island is solved again. Left out is only what presses softly on bodies that are
//! awake: rebounds are found before a step is solved, and a body wakes before it.

use super::bodies::bounded;
use super::gap::distance;
use super::motion::speed;
use super::reach::SHORT_M;
use crate::anchor::Anchor;
use crate::bounds::DISTANCE_WORK;
use crate::contact::distance_cache::DistanceCache;
use crate::dynamics::spatial::SpatialVelocity;
use crate::model::{Model, Owner};
use palmares_models::{Pose, Rotation, Vec3};

/// Something that a step reaches only with more than its short reach.
#[derive(Clone, Copy, Debug)]
pub struct LeftOut {
    /// Index of the pair of shapes among the near pairs.
    pub index: usize,
    pub(super) what: What,
    /// Whether it has joined.
    pub joined: bool,
}

/// What of two shapes is left out.
#[derive(Clone, Copy, Debug)]
pub(super) enum What {
    /// Everything; a lower bound of their gap, m.
    Shapes(f64),
    /// A point of a near pair, by its index.
    Point(usize),
}

/// A point that is left out.
#[derive(Clone, Copy, Debug)]
pub(super) struct LeftPoint {
    /// Its place in the world, m.
    pub at: Vec3,
    /// From A to B.
    pub normal: Vec3,
    /// Gap, m.
    pub gap: f64,
    /// Index among the manifold's points.
    pub point: usize,
    /// Memory of the point, which it has if it joins.
    pub memory: Anchor,
}

/// All that a step leaves out.
#[derive(Clone, Debug, Default)]
pub struct LeftOuts {
    /// In the order of the near pairs; those that waited are behind them.
    pub list: Vec<LeftOut>,
    pub(super) points: Vec<LeftPoint>,
}

impl LeftOuts {
    pub(super) fn clear(&mut self) {
        self.list.clear();
        self.points.clear();
    }

    /// Leaves out the shapes of pair `index`, which have at least this gap, m.
    #[inline]
    pub(crate) fn shapes(&mut self, index: usize, gap: f64) {
        self.list.push(LeftOut { index, what: What::Shapes(gap), joined: false });
    }

    /// Leaves out a point of pair `index`.
    #[inline]
    pub(super) fn point(&mut self, index: usize, point: LeftPoint) {
        self.list.push(LeftOut { index, what: What::Point(self.points.len()), joined: false });
        self.points.push(point);
    }
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
    /// Upper bounds of the speed of the shapes' points at the end, m/s, by their odometers; negative where unknown.
    pub speeds: &'a mut [f64],
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

    /// Upper bound of the speed of any point of a shape, m/s, by its odometer: the frame of that is the base's or the world.
    fn speed(&mut self, slot: usize) -> f64 {
        let (known, shapes) = (self.speeds[slot], self.poses.len());
        if known >= 0.0 {
            return known;
        }
        let shape = &self.model.colliders()[slot % shapes];
        let at = self.poses[slot % shapes].translation;
        let mut motion = self.velocity(shape.owner, at);
        if slot >= shapes {
            motion = motion - self.velocity(Owner::Link(0), at);
        }
        self.speeds[slot] = speed(motion, shape);
        self.speeds[slot]
    }

    /// Pose of a shape at the end.
    fn pose(&self, shape: usize, owner: Owner, h: f64) -> Pose {
        let pose = &self.poses[shape];
        let v = self.velocity(owner, pose.translation);
        let turned = Rotation::from_scaled_axis(v.angular * h) * pose.rotation;
        Pose::from_parts(pose.translation + v.linear * h, turned.normalize())
    }

    /// Whether something left out is hit. The computing is added to `spent`.
    pub(crate) fn hit(
        &mut self,
        left: LeftOut,
        (left_out, distances): (&LeftOuts, &DistanceCache),
        spent: &mut u64,
    ) -> bool {
        let h = self.model.config().step_s;
        let (i, j) = distances.key(left.index);
        let (a, b) = (&self.model.colliders()[i], &self.model.colliders()[j]);
        *spent += 1;
        match left.what {
            What::Point(k) => {
                let LeftPoint { at, normal, gap, .. } = left_out.points[k];
                let relative = self.velocity(b.owner, at).linear - self.velocity(a.owner, at).linear;
                gap + h * relative.dot(normal) < 0.0
            }
            What::Shapes(gap) => {
                let (p, q) = distances.slots(left.index);
                let sum = h * (self.speed(p) + self.speed(q));
                if gap > sum {
                    return false;
                }
                let (bounded, radius) = bounded((i, a), (j, b));
                let at = self.poses[bounded].translation;
                let relative = self.velocity(b.owner, at) - self.velocity(a.owner, at);
                let most = sum.min(h * (relative.linear.length() + relative.angular.length() * radius));
                if gap > most {
                    return false;
                }
                *spent += DISTANCE_WORK;
                let ends = [(i, a.owner), (j, b.owner)].map(|(shape, owner)| self.pose(shape, owner, h));
                // The gap is a known bound, and no result depends on what is known: the true one decides.
                distance(a, b, &ends[0].inv_mul(&ends[1])) <= 0.0
                    && distance(a, b, &self.poses[i].inv_mul(&self.poses[j])) <= most
            }
        }
    }
}

/// Whether a step may leave out what is beyond its short reach. The step of an undamped hand has stages, each with its own search
/// for contacts.
#[inline]
pub(crate) fn leaves_out(model: &Model) -> bool {
    model.config().from_rest(false) > SHORT_M && !model.undamped_hand()
}
