//! The axis of a contact: the direction of largest separation, or of smallest overlap, of two shapes. Its
//! length is always one.

use crate::anchor::Facing;
use crate::model::Collider;
use crate::surface::solid::Solid;
use palmares_models::{Pose, Vec3};
use parry3d_f64::query::details::contact_support_map_support_map_with_params;
use parry3d_f64::query::gjk::{GJKResult, VoronoiSimplex};
use parry3d_f64::query::sat::{
    cuboid_cuboid_find_local_separating_edge_twoway, cuboid_cuboid_find_local_separating_normal_oneway,
};
use parry3d_f64::shape::Cuboid;

/// The axis between two shapes without their rounding, in the frame of the first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    /// Unit normal from A to B.
    pub normal: Vec3,
    /// Separation along it, m; negative where the shapes overlap.
    pub separation: f64,
    /// The nearest points of A and B, where they are known.
    pub nearest: Option<[Vec3; 2]>,
    /// The face it belongs to.
    pub facing: Facing,
}

/// Result of the search for an axis.
enum Search {
    /// The shapes are farther from each other than the limit of the search.
    Separated,
    /// The geometry library returned no direction, or this one, which is no axis of theirs.
    Unknown(Vec3),
    Found(Axis),
}

/// A face's normal replaces an axis whose separation is larger by no more than this, m.
const FACE_BIAS_M: f64 = 1e-8;

/// Cosine of the largest angle between the two for this: 8°.
const NEAR_FACE: f64 = 0.99;

/// If shapes overlap along a direction by this much more than their nearest points do, m, the nearest points
/// are wrong.
const UNSOUND_M: f64 = 1e-5;

/// Separation of B from A along a direction, m.
pub(super) fn separation(a: &Collider, b: &Collider, a_from_b: &Pose, normal: Vec3) -> f64 {
    let support = |of: &Collider, direction: Vec3| match of.core.as_support_map() {
        Some(map) => map.local_support_point(direction),
        None => Vec3::ZERO,
    };
    let on_a = support(a, normal);
    let on_b = a_from_b.transform_point(support(b, a_from_b.rotation.inverse() * -normal));
    (on_b - on_a).dot(normal)
}

/// The normal of a face that a contact kept from its last step, from A to B.
pub(super) fn kept(facing: Facing, a: &Collider, b: &Collider, a_from_b: &Pose) -> Option<Vec3> {
    match facing {
        Facing::None => None,
        Facing::First(face) => a.solid.normals().nth(face as usize),
        Facing::Second(face) => {
            b.solid.normals().nth(face as usize).map(|normal| a_from_b.rotation * -normal)
        }
    }
}

/// Finds the axis; `None` if the shapes are more than `reach` apart. Where the geometry library has no
/// direction for shapes that touch exactly or coincide, the axis is, in this order, the face normal with the
/// best separation, the line between the centres, or z.
pub(super) fn find(a: &Collider, b: &Collider, a_from_b: &Pose, reach: f64, last: Vec3) -> Option<Axis> {
    let found = match (a.core.as_cuboid(), b.core.as_cuboid()) {
        (Some(box_a), Some(box_b)) => of_boxes(box_a, box_b, a_from_b, reach),
        _ => of_supports(a, b, a_from_b, reach, last),
    };
    let axis = match found {
        Search::Separated => return None,
        Search::Found(axis) => with_faces(axis, a, b, a_from_b),
        Search::Unknown(direction) => by_trial(direction, a, b, a_from_b),
    };
    (axis.separation <= reach).then_some(axis)
}

fn is_unit(normal: Vec3) -> bool {
    (normal.length_squared() - 1.0).abs() < 1e-6
}

/// Boxes: by the separating axis theorem. Faces win over edges that do no better.
fn of_boxes(box_a: &Cuboid, box_b: &Cuboid, a_from_b: &Pose, reach: f64) -> Search {
    let of_a = cuboid_cuboid_find_local_separating_normal_oneway(box_a, box_b, a_from_b);
    if of_a.0 > reach {
        return Search::Separated;
    }
    let of_b = cuboid_cuboid_find_local_separating_normal_oneway(box_b, box_a, &a_from_b.inverse());
    if of_b.0 > reach {
        return Search::Separated;
    }
    let of_edges = cuboid_cuboid_find_local_separating_edge_twoway(box_a, box_b, a_from_b);
    if of_edges.0 > reach {
        return Search::Separated;
    }
    let (mut separation, mut normal) = of_a;
    if of_b.0 > separation + FACE_BIAS_M {
        (separation, normal) = (of_b.0, a_from_b.rotation * -of_b.1);
    }
    if of_edges.0 > separation + FACE_BIAS_M {
        (separation, normal) = of_edges;
    }
    let axis = Axis { normal, separation, nearest: None, facing: Facing::None };
    if is_unit(normal) { Search::Found(axis) } else { Search::Unknown(Vec3::ZERO) }
}

/// Other shapes: by the algorithms of Gilbert, Johnson and Keerthi and the expanding polytope.
fn of_supports(a: &Collider, b: &Collider, a_from_b: &Pose, reach: f64, last: Vec3) -> Search {
    let (Some(map_a), Some(map_b)) = (a.core.as_support_map(), b.core.as_support_map()) else {
        return Search::Unknown(Vec3::ZERO);
    };
    let start = last.try_normalize();
    let simplex = &mut VoronoiSimplex::new();
    match contact_support_map_support_map_with_params(a_from_b, map_a, map_b, reach, simplex, start) {
        GJKResult::ClosestPoints(on_a, on_b, normal) if is_unit(normal) => {
            let normal = normal.normalize();
            let separation = (on_b - on_a).dot(normal);
            // For curved shapes that touch exactly, the library may return any direction.
            if self::separation(a, b, a_from_b, normal) < separation - UNSOUND_M {
                return Search::Unknown(normal);
            }
            let nearest = Some([on_a, on_b]);
            Search::Found(Axis { normal, separation, nearest, facing: Facing::None })
        }
        // Either the direction proves the separation, or the search has failed.
        GJKResult::NoIntersection(normal)
            if is_unit(normal) && separation(a, b, a_from_b, normal) > 0.999 * reach =>
        {
            Search::Separated
        }
        _ => Search::Unknown(Vec3::ZERO),
    }
}

/// The normal of the nearest face, or the direction across a cylinder, if its separation is as good: bodies
/// that rest on a face then keep their normal from step to step.
fn with_faces(axis: Axis, a: &Collider, b: &Collider, a_from_b: &Pose) -> Axis {
    let mut best = axis;
    let mut least = axis.separation - FACE_BIAS_M;
    let mut offer = |normal: Vec3, facing: Facing| {
        let separation = separation(a, b, a_from_b, normal);
        if separation >= least {
            // The next face must do better.
            least = separation + FACE_BIAS_M;
            best = Axis { normal, separation, facing, ..axis };
        }
    };
    if let Some((face, normal)) = nearest_face(&a.solid, axis.normal) {
        offer(normal, Facing::First(face));
    }
    let in_b = a_from_b.rotation.inverse() * -axis.normal;
    if let Some((face, normal)) = nearest_face(&b.solid, in_b) {
        offer(a_from_b.rotation * -normal, Facing::Second(face));
    }
    // A curved side has no face, but a direction that does not depend on rounding.
    for (shape, direction) in [a, b].into_iter().zip(beside(a, b, a_from_b)) {
        let near = |normal: &Vec3| normal.dot(axis.normal) > NEAR_FACE;
        if let Some(normal) = direction.try_normalize().filter(|n| shape.solid.is_cylinder() && near(n)) {
            offer(normal, Facing::None);
        }
    }
    best
}

/// From the centre of A to that of B.
fn between(a: &Collider, b: &Collider, a_from_b: &Pose) -> Vec3 {
    a_from_b.transform_point(b.local_bounds.center()) - a.local_bounds.center()
}

/// The same across A's own axis, and across B's: the sides of parallel cylinders face each other along these.
fn beside(a: &Collider, b: &Collider, a_from_b: &Pose) -> [Vec3; 2] {
    let center = between(a, b, a_from_b);
    [Vec3::Y, a_from_b.rotation * Vec3::Y].map(|axis| center - axis * center.dot(axis))
}

/// The face of a shape whose normal is nearest to a direction, if within [`NEAR_FACE`].
fn nearest_face(solid: &Solid, direction: Vec3) -> Option<(u32, Vec3)> {
    let mut best = None;
    let mut most = NEAR_FACE;
    for (k, normal) in solid.normals().enumerate() {
        let along = normal.dot(direction);
        if along > most {
            (best, most) = (Some((k as u32, normal)), along);
        }
    }
    best
}

/// The best of all axes for shapes without another one.
fn by_trial(direction: Vec3, a: &Collider, b: &Collider, a_from_b: &Pose) -> Axis {
    let mut best =
        Axis { normal: Vec3::Z, separation: f64::NEG_INFINITY, nearest: None, facing: Facing::None };
    let mut offer = |normal: Vec3, facing: Facing| {
        let separation = separation(a, b, a_from_b, normal);
        if separation > best.separation + FACE_BIAS_M {
            best = Axis { normal, separation, nearest: None, facing };
        }
    };
    for (k, normal) in a.solid.normals().enumerate() {
        offer(normal, Facing::First(k as u32));
    }
    for (k, normal) in b.solid.normals().enumerate() {
        offer(a_from_b.rotation * -normal, Facing::Second(k as u32));
    }
    // Curved sides face each other along the line between their axes, or their centres.
    let axis_b = a_from_b.rotation * Vec3::Y;
    let [across_a, across_b] = beside(a, b, a_from_b);
    let crossed = Vec3::Y.cross(axis_b);
    for direction in [across_a, across_b, between(a, b, a_from_b), crossed, -crossed, direction] {
        if let Some(normal) = direction.try_normalize() {
            offer(normal, Facing::None);
        }
    }
    if best.separation == f64::NEG_INFINITY {
        best.separation = separation(a, b, a_from_b, Vec3::Z);
    }
    best
}

/// The nearest points of A and B in A's frame; for overlapping shapes, the points that have to separate.
pub(super) fn nearest(
    a: &Collider,
    b: &Collider,
    a_from_b: &Pose,
    reach: f64,
    normal: Vec3,
) -> Option<[Vec3; 2]> {
    match of_supports(a, b, a_from_b, reach, normal) {
        Search::Found(axis) => axis.nearest,
        Search::Separated | Search::Unknown(_) => None,
    }
}
