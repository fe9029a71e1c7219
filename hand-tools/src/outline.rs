//! Outline of a convex shape in a view direction.

use palmares_models::shape::Shape;
use palmares_models::{Pose, Vec3};
use std::f64::consts::TAU;

/// Number of corners of a circle.
const CORNERS: usize = 24;

/// The outline of a convex shape in a view with these directions, m; counter-clockwise.
pub(crate) fn outline(shape: &Shape, pose: &Pose, right: Vec3, up: Vec3) -> Vec<(f64, f64)> {
    let (points, radius) = skeleton(shape);
    let round = |p: Vec3| {
        let at = pose.transform_point(p);
        circle(radius).map(move |(x, y)| (at.dot(right) + x, at.dot(up) + y))
    };
    convex(points.into_iter().flat_map(round).collect())
}

/// Points and a radius: the shape is the convex hull of spheres of this radius around the points.
fn skeleton(shape: &Shape) -> (Vec<Vec3>, f64) {
    let ends = |half: f64| vec![Vec3::new(0.0, 0.0, -half), Vec3::new(0.0, 0.0, half)];
    match shape {
        Shape::Sphere { radius } => (vec![Vec3::ZERO], *radius),
        Shape::Capsule { radius, half_length } => (ends(*half_length), *radius),
        Shape::Cylinder { radius, half_length } => {
            let ring = |end: Vec3| circle(*radius).map(move |(x, y)| end + Vec3::new(x, y, 0.0));
            (ends(*half_length).into_iter().flat_map(ring).collect(), 0.0)
        }
        Shape::Box { half_extents, rounding } => {
            let [x, y, z] = half_extents.map(|half| half - rounding);
            let corner = |k: usize| {
                let sign = |bit: usize| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
                Vec3::new(sign(0) * x, sign(1) * y, sign(2) * z)
            };
            ((0..8).map(corner).collect(), *rounding)
        }
        Shape::Hull { points, rounding } => {
            (points.iter().map(|p| Vec3::from_array(*p)).collect(), *rounding)
        }
    }
}

/// A circle's corners; a single point for radius 0.
fn circle(radius: f64) -> impl Iterator<Item = (f64, f64)> {
    let corners = if radius > 0.0 { CORNERS } else { 1 };
    (0..corners).map(move |k| {
        let (sin, cos) = (TAU * k as f64 / CORNERS as f64).sin_cos();
        (radius * cos, radius * sin)
    })
}

/// The convex hull, counter-clockwise (Andrew's monotone chain).
fn convex(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let chain = |points: &mut dyn Iterator<Item = (f64, f64)>| {
        let mut hull: Vec<(f64, f64)> = Vec::new();
        for p in points {
            while let [.., a, b] = hull[..] {
                if (b.0 - a.0) * (p.1 - a.1) - (b.1 - a.1) * (p.0 - a.0) > 0.0 {
                    break;
                }
                hull.pop();
            }
            hull.push(p);
        }
        hull.pop();
        hull
    };
    let mut hull = chain(&mut points.iter().copied());
    hull.extend(chain(&mut points.iter().rev().copied()));
    hull
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hull_has_no_inner_points() {
        let square = vec![(0.0, 0.0), (1.0, 1.0), (0.5, 0.5), (1.0, 0.0), (0.0, 1.0), (0.5, 0.0), (1.0, 1.0)];
        assert_eq!(convex(square), [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]);
    }

    #[test]
    fn outlines_are_as_wide_as_the_shapes() {
        let pose = Pose::from_translation(Vec3::new(1.0, 0.0, 0.0));
        let width = |shape: &Shape| {
            let points = outline(shape, &pose, Vec3::X, Vec3::Z);
            let xs = points.iter().map(|p| p.0);
            (xs.clone().fold(f64::MAX, f64::min), xs.fold(f64::MIN, f64::max))
        };
        let near = |(low, high): (f64, f64), half: f64| {
            assert!((low - (1.0 - half)).abs() < 1e-3 * half && (high - (1.0 + half)).abs() < 1e-3 * half);
        };
        near(width(&Shape::Sphere { radius: 0.1 }), 0.1);
        near(width(&Shape::Capsule { radius: 0.1, half_length: 0.3 }), 0.1);
        near(width(&Shape::Cylinder { radius: 0.1, half_length: 0.3 }), 0.1);
        near(width(&Shape::Box { half_extents: [0.2, 0.1, 0.3], rounding: 0.01 }), 0.2);
    }
}
