//! Contact points of two convex shapes, from whole faces.
//!
//! 1. [`axis`]: the direction of largest separation, or of smallest overlap.
//! 2. [`solid`](crate::surface::solid): the facing features along it: faces with all corners, or a line or rim of a curved side.
//! 3. [`clip`]: the corners of their overlap, projected along the axis.
//! 4. [`patch`]: a few of these corners that represent the area, and the lever of friction.
//! 5. [`seams`](crate::surface::seams): parts of a surface that other parts of the same body cover are no face and no edge.
//!
//! A face that rests on a face keeps its normal: the search tries the face of the last step first, and keeps
//! it while the shapes' nearest points are on it.

pub mod axis;
mod clip;
mod ground;
mod patch;
mod rim;

use crate::anchor::{Anchor, Facing, Pair};
use crate::model::Collider;
use crate::surface::seams::Verdict;
use crate::surface::solid::{Feature, Solid};
use axis::Axis;
use clip::{Across, Clip, Overlap};
use palmares_models::{Pose, Vec3};
use parry3d_f64::query::{ContactManifold, TrackedContact};
use parry3d_f64::shape::PackedFeatureId;

/// A kept face still has the nearest points if the gap of the faces is that of the shapes, up to this
/// difference, m.
const ON_FACE_M: f64 = 1e-9;

/// The nearest points are a contact of their own if they are nearer than all corners by this, m.
const NEARER_M: f64 = 1e-7;

/// In overlaps deeper than this, m, another face may be nearer than that of the last step.
const DEEP_M: f64 = 1e-3;

/// The direction of largest separation or smallest overlap of two shapes, neither of them a ball, from A to B
/// in the frame of A, and the separation along it, m; `None` if they are more than `reach` apart. The search
/// begins at `last`.
pub fn separating_axis(
    a: &Collider,
    b: &Collider,
    a_from_b: &Pose,
    reach: f64,
    last: Vec3,
) -> Option<(Vec3, f64)> {
    let round = a.rounding + b.rounding;
    axis::find(a, b, a_from_b, reach + round, last).map(|axis| (axis.normal, axis.separation - round))
}

/// Scratch memory of the search.
#[derive(Clone, Debug, Default)]
pub struct Finder {
    features: [Feature; 2],
    clip: Clip,
    /// Overlap of two features.
    overlap: Vec<Overlap>,
    /// Points besides these: of a rim, or the nearest points.
    beside: Vec<Overlap>,
    /// The points of both that are kept.
    kept: Vec<Overlap>,
    on_ground: Vec<(Vec3, Overlap)>,
    /// Points of the pair before this search.
    before: Vec<TrackedContact<Anchor>>,
}

impl Finder {
    /// Finds the points of a pair again, up to `margin` apart, m. A point with the ids of an old one takes
    /// over its memory.
    pub fn find(&mut self, pair: &mut Pair, a: &Collider, b: &Collider, a_from_b: &Pose, margin: f64) {
        self.before.clear();
        self.before.append(&mut pair.manifold.points);
        match (&a.solid, &b.solid) {
            (Solid::HalfSpace { normal }, _) => self.on_ground(pair, (*normal, b), a_from_b, margin, false),
            (_, Solid::HalfSpace { normal }) => {
                self.on_ground(pair, (*normal, a), &a_from_b.inverse(), margin, true);
            }
            _ => self.between(pair, a, b, a_from_b, margin),
        }
        if pair.manifold.points.is_empty() {
            (pair.facing, pair.covered, pair.lever) = (Facing::None, false, 0.0);
        }
        pair.manifold.match_contacts(&self.before);
    }

    /// Points of the last pair before its search.
    pub fn before(&self) -> &[TrackedContact<Anchor>] {
        &self.before
    }

    /// A shape on a ground with this normal. `from` maps the shape's frame to the ground's.
    fn on_ground(
        &mut self,
        pair: &mut Pair,
        (up, shape): (Vec3, &Collider),
        from: &Pose,
        margin: f64,
        flipped: bool,
    ) {
        let normal = from.rotation.inverse() * up;
        let on_plane = from.inverse_transform_point(Vec3::ZERO);
        let Finder { features: [feature, _], on_ground, .. } = self;
        let reach = margin + shape.rounding;
        pair.lever = ground::corners(&shape.solid, (normal, on_plane), reach, feature, on_ground);
        for (at, corner) in on_ground.iter() {
            let height = corner.distance();
            let of_ground = from.transform_point(*at) - up * height;
            let of_shape = *at - normal * (height - (at - on_plane).dot(normal) + shape.rounding);
            pair.manifold.points.push(TrackedContact::flipped(
                of_ground,
                of_shape,
                corner.ids[0],
                corner.ids[1],
                height - shape.rounding,
                flipped,
            ));
        }
        let (of_ground, of_shape) = (up, -normal);
        (pair.manifold.local_n1, pair.manifold.local_n2) =
            if flipped { (of_shape, of_ground) } else { (of_ground, of_shape) };
    }

    /// Checks the point of a ball and another shape: its normal has length one, and needs no covered face.
    pub fn rule_point(
        &mut self,
        manifold: &mut ContactManifold<(), Anchor>,
        a: &Collider,
        b: &Collider,
        a_from_b: &Pose,
    ) {
        let Some(point) = manifold.points.first_mut() else { return };
        let ball_first = a.is_ball;
        if (manifold.local_n1.length_squared() - 1.0).abs() > 1e-6 {
            // The centre is exactly on the other's surface, or on its axis.
            let normal = a_from_b.translation.normalize_or(Vec3::Z);
            (manifold.local_n1, manifold.local_n2) = (normal, a_from_b.rotation.inverse() * -normal);
        }
        let other = if ball_first { b } else { a };
        if other.seams.is_empty() || other.is_ball {
            return;
        }
        let (normal, at, radius) = if ball_first {
            (manifold.local_n2, point.local_p2, a.bounding_radius)
        } else {
            (manifold.local_n1, point.local_p1, b.bounding_radius)
        };
        let at = at - normal * other.rounding;
        match other.seams.judge((&other.solid, other.rounding), normal, at) {
            Verdict::Free => {}
            Verdict::Dropped => manifold.points.clear(),
            Verdict::Turned(face) => {
                // Either the ball is over the face, or it touches another part.
                let other_from_ball = if ball_first { a_from_b.inverse() } else { *a_from_b };
                let center = other_from_ball.translation;
                let (_, n, offset) = other.solid.plane(face);
                let height = n.dot(center) - offset;
                let foot = center - n * height;
                if !other.solid.is_over(face, foot) || !other.seams.is_bare(face, foot) {
                    manifold.points.clear();
                    return;
                }
                let on_other = foot + n * other.rounding;
                let ball_normal = other_from_ball.rotation.inverse() * -n;
                let on_ball = ball_normal * radius;
                point.dist = height - other.rounding - radius;
                if ball_first {
                    (point.local_p1, point.local_p2) = (on_ball, on_other);
                    (manifold.local_n1, manifold.local_n2) = (ball_normal, n);
                } else {
                    (point.local_p1, point.local_p2) = (on_other, on_ball);
                    (manifold.local_n1, manifold.local_n2) = (n, ball_normal);
                }
            }
        }
    }

    fn between(&mut self, pair: &mut Pair, a: &Collider, b: &Collider, a_from_b: &Pose, margin: f64) {
        let reach = margin + a.rounding + b.rounding;
        let kept = axis::kept(pair.facing, a, b, a_from_b).map(|normal| Axis {
            normal,
            separation: axis::separation(a, b, a_from_b, normal),
            nearest: None,
            facing: pair.facing,
        });
        if let Some(kept) = kept {
            self.overlap(&kept, a, b, a_from_b, reach);
            if self.deepest() <= kept.separation + ON_FACE_M && kept.separation > -DEEP_M {
                return self.rule(pair, kept, a, b, a_from_b, reach);
            }
        }
        pair.facing = Facing::None;
        let last = pair.manifold.local_n1;
        let Some(found) = axis::find(a, b, a_from_b, reach, last) else { return };
        // A body driven deep into a thin one does not come out on its other side.
        let through = kept.filter(|kept| kept.separation <= -DEEP_M && kept.normal.dot(found.normal) < 0.0);
        let found = through.unwrap_or(found);
        self.overlap(&found, a, b, a_from_b, reach);
        if self.deepest() > found.separation + NEARER_M {
            self.add_nearest(&found, a, b, a_from_b, reach);
        }
        self.rule(pair, found, a, b, a_from_b, reach);
    }

    /// Writes the overlap along an axis to the manifold, without points that need a covered face. If all do,
    /// writes them and marks the pair as covered.
    fn rule(
        &mut self,
        pair: &mut Pair,
        found: Axis,
        a: &Collider,
        b: &Collider,
        a_from_b: &Pose,
        reach: f64,
    ) {
        pair.covered = false;
        // Shapes placed deep in several parts are separated from each.
        let deep = found.separation - a.rounding - b.rounding < -DEEP_M;
        if deep || a.seams.is_empty() && b.seams.is_empty() {
            return self.put(pair, &found, a, b, a_from_b, reach);
        }
        let kept = [&self.overlap, &self.beside].map(Clone::clone);
        let axis = self.turned(found, a, b, a_from_b, reach);
        self.leave_bare(&axis, a, b, a_from_b);
        pair.covered = self.deepest() > reach;
        if !pair.covered {
            return self.put(pair, &axis, a, b, a_from_b, reach);
        }
        [self.overlap, self.beside] = kept;
        self.put(pair, &found, a, b, a_from_b, reach);
    }

    /// The axis, if no point of the overlap needs a face that is covered there; otherwise the axis of the
    /// best other face, with its overlap or an empty one.
    fn turned(&mut self, found: Axis, a: &Collider, b: &Collider, a_from_b: &Pose, reach: f64) -> Axis {
        let across = Across::of(found.normal);
        let mut axis = found;
        for (k, shape) in [a, b].into_iter().enumerate() {
            let own = match axis.facing {
                Facing::First(_) => k == 0,
                Facing::Second(_) => k == 1,
                Facing::None => false,
            };
            if shape.seams.is_empty() || own {
                continue;
            }
            let into = |at: Vec3| if k == 0 { at } else { a_from_b.inverse_transform_point(at) };
            let normal = if k == 0 { axis.normal } else { a_from_b.rotation.inverse() * -axis.normal };
            let deepest =
                self.overlap.iter().chain(&self.beside).min_by(|p, q| p.distance().total_cmp(&q.distance()));
            let Some(deepest) = deepest else { continue };
            let at = across.x * deepest.x + across.y * deepest.y + across.normal * deepest.heights[k];
            match shape.seams.judge((&shape.solid, shape.rounding), normal, into(at)) {
                Verdict::Free => {}
                Verdict::Dropped => {
                    self.overlap.clear();
                    self.beside.clear();
                }
                Verdict::Turned(face) => {
                    let facing = if k == 0 { Facing::First(face) } else { Facing::Second(face) };
                    let Some(normal) = axis::kept(facing, a, b, a_from_b) else { continue };
                    axis = Axis {
                        normal,
                        separation: axis::separation(a, b, a_from_b, normal),
                        nearest: None,
                        facing,
                    };
                    self.overlap(&axis, a, b, a_from_b, reach);
                    return axis;
                }
            }
        }
        axis
    }

    /// Keeps the points of a face's overlap that are not on a covered part of it.
    fn leave_bare(&mut self, axis: &Axis, a: &Collider, b: &Collider, a_from_b: &Pose) {
        let (k, shape, face) = match axis.facing {
            Facing::First(face) => (0, a, face),
            Facing::Second(face) => (1, b, face),
            Facing::None => return,
        };
        if shape.seams.is_empty() {
            return;
        }
        let across = Across::of(axis.normal);
        let is_bare = |corner: &Overlap| {
            let at = across.x * corner.x + across.y * corner.y + across.normal * corner.heights[k];
            let at = if k == 0 { at } else { a_from_b.inverse_transform_point(at) };
            shape.seams.is_bare(face, at)
        };
        self.overlap.retain(is_bare);
        self.beside.retain(is_bare);
    }

    fn deepest(&self) -> f64 {
        self.overlap.iter().chain(&self.beside).map(Overlap::distance).fold(f64::INFINITY, f64::min)
    }

    /// Overlap of the features along an axis, at most `reach` apart.
    fn overlap(&mut self, axis: &Axis, a: &Collider, b: &Collider, a_from_b: &Pose, reach: f64) {
        let Finder { features: [of_a, of_b], clip, overlap, beside, .. } = self;
        let in_b = a_from_b.rotation.inverse() * -axis.normal;
        let [at_a, at_b] = match axis.nearest {
            Some([on_a, on_b]) => [Some(on_a), Some(a_from_b.inverse_transform_point(on_b))],
            None => [None, None],
        };
        a.solid.feature(axis.normal, at_a, of_a);
        b.solid.feature(in_b, at_b, of_b);
        for corner in &mut of_b.corners {
            corner.at = a_from_b.transform_point(corner.at);
        }
        of_b.normal = a_from_b.rotation * of_b.normal;
        for (of, rounding) in [(&mut *of_a, a.rounding), (of_b, b.rounding)] {
            if of.corners.len() == 2 && of.radius == 0.0 {
                of.radius = rounding;
            }
        }
        let across = Across::of(axis.normal);
        clip.overlap(of_a, of_b, &across, overlap);
        beside.clear();
        for (k, solid) in [&a.solid, &b.solid].into_iter().enumerate() {
            let direction = if k == 0 { axis.normal } else { in_b };
            let Some(rim) = solid.rim(direction) else { continue };
            let at = if k == 0 { rim.at } else { a_from_b.transform_point(rim.at) };
            let away = if k == 0 { -1.0 } else { 1.0 };
            let lowest =
                clip::on_face(if k == 0 { of_b } else { of_a }, at, away * rim::fade(rim.sine), &across, k);
            if lowest.is_some() {
                let height = at.dot(axis.normal);
                for corner in overlap.iter_mut() {
                    let above = away * (corner.heights[k] - height);
                    corner.heights[k] += away * rim::recede(&rim, above);
                }
            }
            beside.extend(lowest);
        }
        beside.retain(|corner| corner.distance() <= reach);
    }

    /// Adds the nearest points where no corner is as near: edges that meet outside the features, curved
    /// sides.
    fn add_nearest(&mut self, found: &Axis, a: &Collider, b: &Collider, a_from_b: &Pose, reach: f64) {
        let nearest = found.nearest.or_else(|| axis::nearest(a, b, a_from_b, reach, found.normal));
        let Some([on_a, on_b]) = nearest else { return };
        let across = Across::of(found.normal);
        let middle = (on_a + on_b) * 0.5;
        let heights = [on_a.dot(found.normal), on_b.dot(found.normal)];
        let ids = [PackedFeatureId::UNKNOWN; 2];
        self.beside.push(Overlap { x: middle.dot(across.x), y: middle.dot(across.y), heights, ids });
    }

    /// Writes the overlap to the manifold, with the shapes' rounding.
    fn put(&mut self, pair: &mut Pair, axis: &Axis, a: &Collider, b: &Collider, a_from_b: &Pose, reach: f64) {
        let Finder { overlap, beside, kept, .. } = self;
        kept.clear();
        kept.extend(overlap.iter().copied().filter(|corner| corner.distance() <= reach));
        patch::reduce(kept, a.solid.is_cylinder() || b.solid.is_cylinder());
        pair.lever = patch::lever(overlap, kept);
        kept.extend_from_slice(beside);
        pair.facing = axis.facing;
        let (normal, across) = (axis.normal, Across::of(axis.normal));
        let manifold = &mut pair.manifold;
        (manifold.local_n1, manifold.local_n2) = (normal, a_from_b.rotation.inverse() * -normal);
        for corner in kept.iter() {
            let at = across.x * corner.x + across.y * corner.y;
            let on_a = at + normal * (corner.heights[0] + a.rounding);
            let on_b = at + normal * (corner.heights[1] - b.rounding);
            let [of_a, of_b] = corner.ids;
            manifold.points.push(TrackedContact::new(
                on_a,
                a_from_b.inverse_transform_point(on_b),
                of_a,
                of_b,
                corner.distance() - a.rounding - b.rounding,
            ));
        }
    }
}
