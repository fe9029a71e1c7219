//! The gap of a near pair: computed exactly once, then bounded by the relative motion.

use super::distance_cache::DistanceCache;
use super::motion::way;
use crate::anchor::Pair;
use crate::model::Collider;
use palmares_models::Pose;
use parry3d_f64::query::details::distance_support_map_support_map;
use parry3d_f64::query::{DefaultQueryDispatcher, QueryDispatcher};

/// Gap of the shapes, if it is larger than the gap that is `reachable` in this step. The exact distance is
/// computed once, and again only when the relative motion could have used it up.
pub(super) fn still_separated(
    pair: Option<&Pair>,
    (distances, index): (&mut DistanceCache, usize),
    (a, b): (&Collider, &Collider),
    a_from_b: &Pose,
    reachable: f64,
) -> Option<f64> {
    // Points are part of the state, the cached distance is not: a restored snapshot has none.
    if pair.is_some_and(|pair| pair.manifold.points.iter().any(|point| point.data.loaded)) {
        return None;
    }
    let touched = pair.filter(|pair| !pair.manifold.points.is_empty());
    // Gaps known before a snapshot are known after it: for pairs with points, the state has them.
    let (gap, there) = touched.map_or_else(|| distances.gap(index), |pair| pair.updated_at);
    // An unbounded shape approaches with any turn.
    if gap > reachable && b.bounding_radius.is_finite() {
        let left = gap - way(&there, a_from_b, b.bounding_radius);
        if left > reachable {
            return Some(left);
        }
    }
    if touched.is_some() {
        return None;
    }
    let gap = distance(a, b, a_from_b);
    distances.set_gap(index, gap, *a_from_b);
    (gap > reachable).then_some(gap)
}

/// Distance of two shapes, m; 0 where they overlap.
pub(super) fn distance(a: &Collider, b: &Collider, a_from_b: &Pose) -> f64 {
    let cores = (a.core.as_cuboid(), b.core.as_cuboid());
    let found = match cores {
        // parry's own distance of two boxes can be more than a millimetre too large where two edges are nearest.
        (Some(a), Some(b)) => distance_support_map_support_map(a_from_b, a, b),
        _ => {
            DefaultQueryDispatcher.distance(a_from_b, &*a.core, &*b.core).map_or(0.0, |found| found.distance)
        }
    };
    (found - a.rounding - b.rounding).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::model::Model;
    use palmares_models::shape::Shape;
    use palmares_models::{Rotation, Vec3};

    fn colliders(shapes: &[Shape]) -> Vec<Collider> {
        let mut model = Model::new(Config::default(), None).expect("no hand");
        for shape in shapes {
            model.add_static("shape", shape, Pose::IDENTITY, 0.5).expect("it fits");
        }
        model.colliders().to_vec()
    }

    #[test]
    fn distances_are_those_of_the_cores_less_what_rounds_them() {
        let shapes = colliders(&[
            Shape::Box { half_extents: [0.03, 0.02, 0.01], rounding: 0.004 },
            Shape::Capsule { half_length: 0.02, radius: 0.008 },
        ]);
        // The capsule upright next to the box, its lower end above the box's edge.
        let a_from_b = Pose::translation(0.026, 0.016 + 0.03, 0.006 + 0.02 + 0.04);
        let found = distance(&shapes[0], &shapes[1], &a_from_b);
        assert!((found - (0.05 - 0.004 - 0.008)).abs() < 1e-15, "{found}");
        assert_eq!(distance(&shapes[0], &shapes[1], &Pose::translation(0.026, 0.02, 0.0)), 0.0);
    }

    /// A point of a box moves at most by the way of its origin plus the chord of its turn. The distance changes by no more.
    #[test]
    fn the_distance_of_two_boxes_changes_no_faster_than_they_move() {
        let size = Shape::Box { half_extents: [0.009, 0.006, 0.018], rounding: 0.003 };
        let shapes = colliders(&[size.clone(), size]);
        let radius = shapes[1].bounding_radius;
        // Fingers that turn about parallel axes: edges along them are nearest.
        let pose = |k: u32| {
            let turn = f64::from(k) * 0.005;
            let way = Vec3::new(0.0, (1.7 * turn).cos(), (1.7 * turn).sin());
            Pose::from_parts(way * 0.025, Rotation::from_axis_angle(Vec3::X, 2.0 * turn))
        };
        for k in 0..2000 {
            let (here, there) = (pose(k), pose(k + 1));
            let moved = here.translation.distance(there.translation);
            let cosine = here.rotation.dot(there.rotation);
            let chord = 2.0 * (1.0 - cosine * cosine).max(0.0).sqrt();
            let change = distance(&shapes[0], &shapes[1], &here) - distance(&shapes[0], &shapes[1], &there);
            assert!(change.abs() <= moved + chord * radius + 1e-9, "place {k}: {change}");
        }
    }
}
