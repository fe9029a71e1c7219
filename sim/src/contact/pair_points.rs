//! The points of a pair of shapes: moved along with them, or found anew with the memory of the old ones.

use super::manifold::{self, Finder};
use crate::anchor::{Anchor, Pair};
use crate::bounds::MANIFOLD_WORK;
use crate::config::Config;
use crate::model::Collider;
use palmares_models::{Pose, Vec3};
use parry3d_f64::query::{
    ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher, TrackedContact,
};
use parry3d_f64::shape::Shape as ConvexShape;

/// Way of a ball's centre from a surface that shows on which side the surface is, m.
const NEARER_M: f64 = 1e-6;

/// Like [`manifold::separating_axis`], for any shapes but a ground.
pub(super) fn separating_axis(
    a: &Collider,
    b: &Collider,
    a_from_b: &Pose,
    reach: f64,
    last: Vec3,
) -> Option<(Vec3, f64)> {
    if !(a.is_ball || b.is_ball) {
        return manifold::separating_axis(a, b, a_from_b, reach, last);
    }
    let mut found = ContactManifold::new();
    find_point(&mut found, a, b, a_from_b, reach);
    let distance = found.points.first()?.dist;
    Some((found.local_n1.normalize_or(Vec3::Z), distance))
}

/// Finds the points of a pair up to a gap of `margin`, unless those of the last step can be moved along; returns the computing.
/// `reuse` are the limits for this: cosine of the turn, and square of the way.
#[inline(always)]
pub(super) fn refresh(
    finder: &mut Finder,
    pair: &mut Pair,
    (a, b): (&Collider, &Collider),
    a_from_b: &Pose,
    margin: f64,
    reuse: (f64, f64),
    config: &Config,
) -> u64 {
    if still_valid(pair, a, b, a_from_b, reuse) {
        return 0;
    }
    if a.is_ball || b.is_ball {
        find_point(&mut pair.manifold, a, b, a_from_b, margin);
        finder.rule_point(&mut pair.manifold, a, b, a_from_b);
    } else {
        finder.find(pair, a, b, a_from_b, margin);
        merge_coincident(&mut pair.manifold, config.coincident_m.powi(2));
        remember(&mut pair.manifold.points, finder.before(), config.manifold_reuse_m.powi(2));
    }
    MANIFOLD_WORK
}

/// Whether the points of a pair can be reused. parry's own reuse (up to 1 mm and 1°) gives energy to a
/// rolling cylinder; without any reuse polyhedra flicker. So the decision is made here, with much tighter
/// limits.
#[inline(always)]
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
    face_outwards(manifold, [on_a.0, on_b.0], a_from_b);
    for point in &mut manifold.points {
        point.local_p1 += manifold.local_n1 * on_a.1;
        point.local_p2 += manifold.local_n2 * on_b.1;
        point.dist -= on_a.1 + on_b.1;
    }
}

/// A ball's centre that lies exactly on a surface has no direction from it. There parry's normal is that away from the shape's
/// origin, or towards it, and the ball would be led through the shape. It becomes that of a ball a micrometre nearer to the middle.
#[inline]
fn face_outwards(manifold: &mut ContactManifold<(), Anchor>, [a, b]: [&dyn ConvexShape; 2], a_from_b: &Pose) {
    let Some(point) = manifold.points.first_mut() else { return };
    let flipped = a.as_ball().is_some();
    let (shape, ball) = if flipped { (b, a) } else { (a, b) };
    let (Some(ball), None) = (ball.as_ball(), shape.as_ball()) else { return };
    if point.dist != -ball.radius {
        return;
    }
    let shape_from_ball = if flipped { a_from_b.inverse() } else { *a_from_b };
    let center = shape_from_ball.translation;
    let nearer = center.move_towards(shape.compute_local_aabb().center(), NEARER_M);
    let out = (shape.project_local_point(nearer, false).point - nearer).normalize_or(Vec3::Z);
    let inwards = shape_from_ball.rotation.inverse() * -out;
    if flipped {
        (manifold.local_n1, manifold.local_n2, point.local_p1) = (inwards, out, inwards * ball.radius);
    } else {
        (manifold.local_n1, manifold.local_n2, point.local_p2) = (out, inwards, inwards * ball.radius);
    }
}

/// Gives points that parry considers new the memory of the nearest old one, if it was at the same position of
/// a shape. Only one of the points that share a position is kept, and rounding decides which features it has in
/// the next step. Without this a grasp would lose its friction.
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
    use crate::model::Model;
    use palmares_models::Rotation;
    use palmares_models::shape::Shape;
    use parry3d_f64::shape::PackedFeatureId;

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
    fn a_ball_whose_centre_is_on_a_surface_is_led_out() {
        let shapes = colliders();
        let (round, ball) = (&shapes[0], &shapes[2]);
        let turned = Rotation::from_rotation_x(0.7);
        // The faces of the inner box.
        for (sharp, out) in [(0.026, Vec3::X), (0.016, -Vec3::Y), (0.006, Vec3::Z)] {
            let place = Pose::from_parts(out * sharp + (Vec3::ONE - out.abs()) * 1e-3, turned);
            for flipped in [false, true] {
                let (mut found, there) = (ContactManifold::new(), place.inverse());
                let (a, b, place) = if flipped { (ball, round, &there) } else { (round, ball, &place) };
                find_point(&mut found, a, b, place, 0.01);
                let (point, normal) =
                    (found.points[0], if flipped { found.local_n2 } else { found.local_n1 });
                assert!((normal - out).length() < 1e-9, "{out}, {flipped}: {normal}");
                assert!((point.dist + 0.0065 + 0.004).abs() < 1e-12, "{out}: {}", point.dist);
                let (on_a, on_b) = (point.local_p1, place.transform_point(point.local_p2));
                let apart = (on_b - on_a).dot(found.local_n1);
                assert!((apart - point.dist).abs() < 1e-9, "{out}, {flipped}: {apart} {}", point.dist);
            }
        }
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
