//! The rim of a cylinder on the plane of a furniture's face, if the object of an island touches there alone.

use super::impacts::MAX_TURN;
use super::work::Work;
use crate::config::Config;
use crate::contact::narrow_phase::{ContactPair, ContactPoint};
use crate::model::{Collider, Model, Owner};
use crate::solver::island::Island;
use crate::state::State;
use crate::surface::solid::{Solid, farthest};
use palmares_models::{Pose, Vec3};

/// Sine of the tilt below which a cap bears with its corners, too.
const FLAT: f64 = 0.02;

/// A point within this distance of the rim's lowest one is that point, m.
const SAME_M: f64 = 1e-6;

/// A rim and a plane.
pub(super) struct Rim<'a> {
    pub object: usize,
    shape: &'a Collider,
    pub radius: f64,
    /// Height of its cap along the cylinder's axis, m.
    cap: f64,
    furniture: &'a Collider,
    /// Pose of the furniture, and the index of its face; a ground has none.
    face: (Pose, Option<u32>),
    /// Unit normal of the plane, towards the object, and a point on it.
    normal: Vec3,
    on_plane: Vec3,
    /// Least height of the other cap's rim over this one's lowest point, m.
    clearance: f64,
}

/// The lowest point of a rim.
#[derive(Clone, Copy)]
pub(super) struct Lowest {
    /// From the centre of mass, m.
    pub arm: Vec3,
    pub gap: f64,
}

impl<'a> Rim<'a> {
    /// The rim on which the object of an island stands alone, and its point's index in the island's only pair.
    pub(super) fn find(
        model: &'a Model,
        state: &State,
        work: &Work,
        island: &Island,
    ) -> Option<(Self, usize)> {
        let [index] = island.pairs[..] else { return None };
        let pair = &work.collision.contacts.pairs[index];
        let known = &state.pairs[pair.pair];
        let [a, b] = [known.key.0, known.key.1].map(|i| i as usize);
        let (object, shape, furniture, second) = match (pair.a, pair.b) {
            (Owner::Static, Owner::Object(k)) => (k, b, a, true),
            (Owner::Object(k), Owner::Static) => (k, a, b, false),
            _ => return None,
        };
        let (pose, ground) = (work.collision.poses[shape], work.collision.poses[furniture]);
        let [shape, furniture] = [shape, furniture].map(|i| &model.colliders()[i]);
        let Solid::Cylinder { radius, half_length } = shape.solid else { return None };
        let face = if second { known.facing.of_first() } else { known.facing.of_second() };
        if face.is_none() && !matches!(furniture.solid, Solid::HalfSpace { .. }) {
            return None;
        }
        let points = &work.collision.contacts.points[pair.points.clone()];
        let turn = state.object_velocity(model, object).1.length() * model.config().step_s;
        let (k, bears) = bearing(pair, points, turn, model.config())?;
        let normal = if second { bears.normal } else { -bears.normal };
        let found = &known.manifold.points[bears.point as usize];
        let (at, on_plane) =
            if second { (found.local_p2, found.local_p1) } else { (found.local_p1, found.local_p2) };
        let down = pose.rotation.inverse() * -normal;
        let rim = Rim {
            object,
            shape,
            radius,
            cap: half_length.copysign(down.y),
            furniture,
            face: (ground, face),
            normal,
            on_plane: ground.transform_point(on_plane),
            clearance: model.config().contact_onset_m,
        };
        let lowest = farthest(radius, rim.cap, down) + down * shape.rounding;
        (lowest.distance_squared(at) < SAME_M * SAME_M).then_some((rim, k))
    }

    /// Its lowest point in a pose of the object; `None` where more than this point may touch.
    pub(super) fn lowest(&self, object: &Pose) -> Option<Lowest> {
        let pose = *object * self.shape.body_from_shape;
        let down = pose.rotation.inverse() * -self.normal;
        let lowest = farthest(self.radius, self.cap, down);
        let place = pose.transform_point(lowest) - self.normal * self.shape.rounding;
        let other = 2.0 * self.cap * down.y;
        let tilted = down.x * down.x + down.z * down.z > FLAT * FLAT;
        (other > self.clearance && tilted && self.is_over_face(place)).then_some(Lowest {
            arm: place - object.translation,
            gap: (place - self.on_plane).dot(self.normal),
        })
    }

    fn is_over_face(&self, place: Vec3) -> bool {
        let (pose, Some(face)) = self.face else { return true };
        let foot = pose.inverse_transform_point(place - self.normal * self.furniture.rounding);
        // Across the face alone.
        let (_, normal, offset) = self.furniture.solid.plane(face);
        let foot = foot - normal * (normal.dot(foot) - offset);
        self.furniture.solid.is_over(face, foot) && self.furniture.seams.is_bare(face, foot)
    }
}

/// The one point of a pair that bears. While none bears, the nearest one, unless its blow rebounds or is rigid ([`super::impacts`]).
fn bearing<'a>(
    pair: &ContactPair,
    points: &'a [ContactPoint],
    turn: f64,
    config: &Config,
) -> Option<(usize, &'a ContactPoint)> {
    let mut bearing = points.iter().enumerate().filter(|(_, point)| point.anchor.loaded);
    if let Some(found) = bearing.next() {
        return bearing.next().is_none().then_some(found);
    }
    let nearest = points.iter().enumerate().min_by(|(_, a), (_, b)| a.distance.total_cmp(&b.distance))?;
    let (_, point) = nearest;
    let rebounds = pair.restitution > 0.0 && point.distance + pair.initial_overlap > config.contact_onset_m;
    let strikes = point.approach < -config.rebound_speed && (pair.restitution > 0.0 || turn <= MAX_TURN);
    (!rebounds && !strikes).then_some(nearest)
}
