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
const FLAT: f64 = 0.1;

/// A point within this distance of the rim's lowest one is that point, m.
const SAME_M: f64 = 1e-6;

/// Surfaces farther off than so many times the way of a step are not met.
const SPARE: f64 = 1.5;

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
    /// The rim on which the object of an island stands alone, the place of its pair in the island, and that of its point in the pair.
    pub(super) fn find(
        model: &'a Model,
        state: &State,
        work: &Work,
        island: &Island,
    ) -> Option<(Self, usize, usize)> {
        let place = nearest(work, island)?;
        let pair = &work.collision.contacts.pairs[island.pairs[place]];
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
        let (linear, angular) = state.object_velocity(model, object);
        let config = model.config();
        if !others_are_far(work, island, place, (linear, angular), config.step_s) {
            return None;
        }
        let turn = angular.length() * config.step_s;
        let (k, bears) = bearing(pair, points, turn, config)?;
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
            clearance: config.contact_onset_m,
        };
        let lowest = farthest(radius, rim.cap, down) + down * shape.rounding;
        (lowest.distance_squared(at) < SAME_M * SAME_M).then_some((rim, place, k))
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

/// The pair of an island that bears, or else the nearest one, by its place in the island.
fn nearest(work: &Work, island: &Island) -> Option<usize> {
    let contacts = &work.collision.contacts;
    let gap = |&(_, index): &(usize, &usize)| {
        let points = &contacts.points[contacts.pairs[*index].points.clone()];
        let bears = points.iter().any(|point| point.anchor.loaded);
        let least = points.iter().map(|point| point.distance).fold(f64::INFINITY, f64::min);
        if bears { f64::NEG_INFINITY } else { least }
    };
    let places = island.pairs.iter().enumerate();
    places.min_by(|a, b| gap(a).total_cmp(&gap(b))).map(|(place, _)| place)
}

/// Whether no point of the island's other pairs bears or may come to bear, as fast as the object moves now.
fn others_are_far(
    work: &Work,
    island: &Island,
    place: usize,
    (linear, angular): (Vec3, Vec3),
    step_s: f64,
) -> bool {
    let contacts = &work.collision.contacts;
    let others = island.pairs.iter().enumerate().filter(|(other, _)| *other != place);
    others.map(|(_, index)| &contacts.pairs[*index]).all(|pair| {
        contacts.points[pair.points.clone()].iter().all(|point| {
            let way = SPARE * step_s * (linear.length() + angular.length() * point.r.length());
            !point.anchor.loaded && point.distance > way
        })
    })
}

/// The one point of a pair that bears. While none bears, the nearest one, unless its blow is rigid ([`super::impacts`]). A rim that
/// may rebound is left to the law of blows.
fn bearing<'a>(
    pair: &ContactPair,
    points: &'a [ContactPoint],
    turn: f64,
    config: &Config,
) -> Option<(usize, &'a ContactPoint)> {
    if pair.restitution > 0.0 {
        return None;
    }
    let mut bearing = points.iter().enumerate().filter(|(_, point)| point.anchor.loaded);
    if let Some(found) = bearing.next() {
        return bearing.next().is_none().then_some(found);
    }
    let nearest = points.iter().enumerate().min_by(|(_, a), (_, b)| a.distance.total_cmp(&b.distance))?;
    let strikes = nearest.1.approach < -config.rebound_speed && turn <= MAX_TURN;
    (!strikes).then_some(nearest)
}
