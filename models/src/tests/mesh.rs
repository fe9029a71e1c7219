//! Hulls of few points, rounded by an exact offset of the faces.

use crate::Vec3;
use crate::shape::Shape;
use crate::shape::hull::rounded_hull;
use crate::shape::support::fibonacci_direction;

/// Corners of a box of half extents h.
fn corners(h: Vec3) -> Vec<Vec3> {
    let sign = |i: usize, axis: usize| if i >> axis & 1 == 0 { -1.0 } else { 1.0 };
    (0..8).map(|i| Vec3::new(sign(i, 0), sign(i, 1), sign(i, 2)) * h).collect()
}

#[test]
fn directions_are_unit_and_cover_the_sphere() {
    let all: Vec<Vec3> = (0..64).map(|i| fibonacci_direction(i, 64)).collect();
    assert!(all.iter().all(|d| (d.length() - 1.0).abs() < 1e-12));
    let sum = all.iter().copied().sum::<Vec3>();
    assert!(sum.length() < 0.5, "{sum}");
}

#[test]
fn a_long_box_keeps_its_faces() {
    // A shrink towards the centre would move the far faces most; an offset moves all by the same.
    let half = Vec3::new(0.1, 0.01, 0.02);
    let (shape, rounded) = rounded_hull(&corners(half), 64, 2e-3).unwrap();
    let Shape::Hull { points, rounding } = shape else { panic!("not a hull") };
    assert!(rounded && rounding == 2e-3);
    assert_eq!(points.len(), 8);
    for p in points {
        let p = Vec3::from_array(p).abs();
        assert!((p + Vec3::splat(2e-3) - half).length() < 1e-9, "{p}");
    }
}

/// A ball of 5 cm meshed with `count` points keeps at most 64 of them, and its radius.
fn keeps_a_ball(count: usize) {
    let ball: Vec<Vec3> = (0..count).map(|i| fibonacci_direction(i, count) * 0.05).collect();
    let (shape, rounded) = rounded_hull(&ball, 64, 2e-3).unwrap();
    let Shape::Hull { points, .. } = shape else { panic!("not a hull") };
    assert!(rounded && points.len() <= 64 && points.len() > 40, "{}", points.len());
    for p in points {
        let reach = Vec3::from_array(p).length() + 2e-3;
        assert!((reach - 0.05).abs() < 5e-4, "{reach}");
    }
}

#[test]
fn a_finely_meshed_ball_keeps_few_points_and_its_radius() {
    keeps_a_ball(500);
}

#[test]
fn a_mesh_finer_than_needed_is_thinned_and_keeps_its_size() {
    keeps_a_ball(60_000);
    // Corners and flat faces survive.
    let side = 40;
    let half = Vec3::new(0.05, 0.02, 0.01);
    let grid = |i: usize| 2.0 * (i as f64) / f64::from(side) - 1.0;
    let mut fine = Vec::new();
    for i in 0..=side as usize {
        for j in 0..=side as usize {
            let (a, b) = (grid(i), grid(j));
            for s in [-1.0, 1.0] {
                fine.extend([Vec3::new(a, b, s), Vec3::new(a, s, b), Vec3::new(s, a, b)].map(|p| p * half));
            }
        }
    }
    let (shape, _) = rounded_hull(&fine, 64, 2e-3).unwrap();
    let Shape::Hull { points, .. } = shape else { panic!("not a hull") };
    assert!(fine.len() > 4096 && points.len() == 8, "{} {}", fine.len(), points.len());
    for p in points {
        let p = Vec3::from_array(p).abs();
        assert!((p + Vec3::splat(2e-3) - half).length() < 1e-9, "{p}");
    }
}

#[test]
fn what_is_too_thin_stays_sharp_and_what_is_flat_is_refused() {
    let (shape, rounded) = rounded_hull(&corners(Vec3::new(0.1, 0.1, 0.001)), 64, 2e-3).unwrap();
    assert!(!rounded && matches!(shape, Shape::Hull { rounding: 0.0, .. }));
    assert!(rounded_hull(&corners(Vec3::new(0.1, 0.1, 0.0)), 64, 2e-3).is_none());
    assert!(rounded_hull(&[], 64, 2e-3).is_none());
}
