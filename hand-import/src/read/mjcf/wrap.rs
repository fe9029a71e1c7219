//! The shortest cable from one point to another around a ball or a cylinder.
//!
//! In the plane across the cylinder, or through the ball's centre and both points, the cable is a tangent, an arc and a tangent. A
//! tangent point is at the angle `acos(r / d)` from the direction of its end, which is at distance d from the centre.

use palmares_models::{Pose, Vec3};
use std::f64::consts::{PI, TAU};

/// The shape that a cable winds around, with its radius: an axis along z, or a ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Round {
    Ball(f64),
    Cylinder(f64),
}

/// A point of the plane.
type Point = [f64; 2];

/// Length of the cable between two points in the world; `side` is a point on the side where it passes, and a cable whose side
/// point is inside the geom passes through it.
pub(crate) fn length(from: Vec3, to: Vec3, round: Round, world_from_round: &Pose, side: Option<Vec3>) -> f64 {
    let straight = (to - from).length();
    let here = world_from_round.inverse();
    let (a, b, side) = (here * from, here * to, side.map(|side| here * side));
    let (radius, inside) = match round {
        Round::Ball(r) | Round::Cylinder(r) => (r, side.is_some_and(|side| side.length() < r)),
    };
    // Axes of the plane.
    let (x, y) = match round {
        Round::Cylinder(_) => (Vec3::X, Vec3::Y),
        Round::Ball(_) => {
            if a.length() < 1e-12 {
                return straight;
            }
            let x = a.normalize();
            let normal = x.cross(b);
            // Both ends on one line through the centre: any plane through it.
            let normal = if normal.length() > 1e-12 { normal } else { x.any_orthonormal_vector() };
            (x, normal.normalize().cross(x))
        }
    };
    let flat = |v: Vec3| [v.dot(x), v.dot(y)];
    let (p, q) = (flat(a), flat(b));
    let side = side.map(flat).map(|s| {
        let long = norm(s).max(1e-300);
        s.map(|x| x / long)
    });
    let found = if inside { inner(p, q, radius) } else { outer(p, q, radius, side) };
    let Some((first, arc, last)) = found else { return straight };
    let rise = match round {
        Round::Cylinder(_) => b.z - a.z,
        Round::Ball(_) => 0.0,
    };
    // On the unrolled surface the cable is straight.
    let whole = first + arc + last;
    let part = |part: f64| part.hypot(if whole > 0.0 { rise * part / whole } else { 0.0 });
    part(first) + part(arc) + part(last)
}

fn norm(p: Point) -> f64 {
    p[0].hypot(p[1])
}

fn angle(p: Point) -> f64 {
    libm::atan2(p[1], p[0])
}

/// Lengths of tangent, arc and tangent around a circle; `None` if the cable does not touch it.
fn outer(p: Point, q: Point, r: f64, side: Option<Point>) -> Option<(f64, f64, f64)> {
    let (dp, dq) = (norm(p), norm(q));
    if dp < r || dq < r || r < 1e-12 || norm([q[0] - p[0], q[1] - p[1]]) < 1e-12 {
        return None;
    }
    // A side counts only opposite to both ends: else the cable takes the short way, as without one.
    let side = side.filter(|s| opposite(*s, p, q));
    if norm(nearest(p, q)) > r && side.is_none() {
        return None;
    }
    let (ap, aq) = (libm::acos((r / dp).min(1.0)), libm::acos((r / dq).min(1.0)));
    let way = |turn: f64| {
        let (tp, tq) = (angle(p) + turn * ap, angle(q) - turn * aq);
        let on = |t: f64| [r * libm::cos(t), r * libm::sin(t)];
        let (on_p, on_q) = (on(tp), on(tq));
        let arc = (turn * (tq - tp)).rem_euclid(TAU);
        // A straight cable that just touches.
        let arc = if arc > TAU - 1e-9 { 0.0 } else { arc };
        (on_p, on_q, r * arc)
    };
    let ways = [way(1.0), way(-1.0)];
    let good = |(on_p, on_q, _): &(Point, Point, f64)| {
        if cross(p, *on_p, q, *on_q) {
            return f64::NEG_INFINITY;
        }
        match side {
            Some(s) => {
                let middle = [on_p[0] + on_q[0], on_p[1] + on_q[1]];
                (s[0] * middle[0] + s[1] * middle[1]) / norm(middle).max(1e-300)
            }
            None => -norm([on_p[0] - on_q[0], on_p[1] - on_q[1]]),
        }
    };
    let best = if good(&ways[0]) > good(&ways[1]) { ways[0] } else { ways[1] };
    let (on_p, on_q, arc) = best;
    if cross(p, on_p, q, on_q) {
        return None;
    }
    let tangent = |d: f64| (d * d - r * r).max(0.0).sqrt();
    Some((tangent(dp), arc, tangent(dq)))
}

/// The cable touches a ring from inside in one point: the shortest way from p over the ring to q, if the straight way passes
/// outside of it.
fn inner(p: Point, q: Point, r: f64) -> Option<(f64, f64, f64)> {
    let (dp, dq) = (norm(p), norm(q));
    if dp <= r || dq <= r || norm(nearest(p, q)) <= r {
        return None;
    }
    // As seen from the centre, the angles of incidence and reflection are equal: bisection over the angle between the ends.
    let between = (angle(q) - angle(p) + PI).rem_euclid(TAU) - PI;
    let legs = |t: f64| {
        let leg = |d: f64, t: f64| (d * d + r * r - 2.0 * d * r * libm::cos(t)).max(0.0).sqrt();
        (leg(dp, t), leg(dq, between.abs() - t))
    };
    let slope = |t: f64| {
        let (first, last) = legs(t);
        dp * r * libm::sin(t) / first - dq * r * libm::sin(between.abs() - t) / last
    };
    let (mut low, mut high) = (0.0, between.abs());
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if slope(middle) > 0.0 { high = middle } else { low = middle }
    }
    let (first, last) = legs(0.5 * (low + high));
    Some((first, 0.0, last))
}

/// The point of a segment nearest to the origin.
fn nearest(p: Point, q: Point) -> Point {
    let d = [q[0] - p[0], q[1] - p[1]];
    let along = -(p[0] * d[0] + p[1] * d[1]) / (d[0] * d[0] + d[1] * d[1]).max(1e-300);
    let along = along.clamp(0.0, 1.0);
    [p[0] + along * d[0], p[1] + along * d[1]]
}

/// Whether a direction is between those from p and q through the origin.
fn opposite(s: Point, p: Point, q: Point) -> bool {
    let cross = |a: Point, b: Point| a[0] * b[1] - a[1] * b[0];
    // The origin is in the triangle of all three.
    let (a, b, c) = (cross(p, q), cross(q, s), cross(s, p));
    a != 0.0 && a * b > 0.0 && a * c > 0.0
}

/// Whether the segments a–b and c–d cross.
fn cross(a: Point, b: Point, c: Point, d: Point) -> bool {
    let (u, v) = ([b[0] - a[0], b[1] - a[1]], [d[0] - c[0], d[1] - c[1]]);
    let det = u[0] * v[1] - u[1] * v[0];
    if det.abs() < 1e-15 {
        return false;
    }
    let w = [c[0] - a[0], c[1] - a[1]];
    let (s, t) = ((w[0] * v[1] - w[1] * v[0]) / det, (w[0] * u[1] - w[1] * u[0]) / det);
    (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn over(from: Vec3, to: Vec3, side: Option<Vec3>, round: Round) -> f64 {
        length(from, to, round, &Pose::IDENTITY, side)
    }

    #[test]
    fn a_cable_over_half_a_cylinder_is_two_tangents_and_half_its_circumference() {
        let (from, to) = (Vec3::new(-0.3, 0.1, 0.0), Vec3::new(-0.3, -0.1, 0.0));
        let right = over(from, to, Some(Vec3::new(0.2, 0.0, 0.0)), Round::Cylinder(0.1));
        assert!((right - (0.6 + 0.1 * PI)).abs() < 1e-12, "{right}");
        let left = over(from, to, None, Round::Cylinder(0.1));
        assert!((left - 0.2).abs() < 1e-12, "without a side the cable is straight: {left}");
    }

    #[test]
    fn a_side_counts_only_opposite_to_both_ends() {
        // MuJoCo 4.0: between 180° + 21.8° and 360° − 21.8°, the directions away from the ends.
        let (from, to) = (Vec3::new(-0.3, 0.12, 0.0), Vec3::new(0.3, 0.12, 0.0));
        let at = |degrees: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            over(from, to, Some(Vec3::new(cos, sin, 0.0)), Round::Cylinder(0.1))
        };
        let d = 0.3f64.hypot(0.12);
        let arc = TAU - 2.0 * libm::atan2(0.3, 0.12) - 2.0 * libm::acos(0.1 / d);
        let around = 2.0 * (d * d - 0.01f64).sqrt() + 0.1 * arc;
        assert!((at(203.0) - around).abs() < 1e-12 && (at(337.0) - around).abs() < 1e-12, "{}", at(203.0));
        assert!((at(200.0) - 0.6).abs() < 1e-12 && (at(340.0) - 0.6).abs() < 1e-12, "{}", at(200.0));
    }

    #[test]
    fn a_straight_cable_that_just_touches_stays_straight() {
        let (from, to) = (Vec3::new(-0.04, 0.005, 0.0), Vec3::new(0.015, 0.005, 0.0));
        let long = over(from, to, Some(Vec3::Y), Round::Cylinder(0.005));
        assert!((long - 0.055).abs() < 1e-12, "{long}");
    }

    #[test]
    fn along_a_cylinder_the_cable_is_a_helix() {
        let (from, to) = (Vec3::new(-0.3, 0.1, 0.0), Vec3::new(-0.3, -0.1, 0.4));
        let long = over(from, to, Some(Vec3::X), Round::Cylinder(0.1));
        let flat = 0.6 + 0.1 * PI;
        assert!((long - flat.hypot(0.4)).abs() < 1e-12, "{long}");
    }

    #[test]
    fn around_a_ball_the_cable_lies_in_the_plane_through_its_centre() {
        let turn = super::super::compiler::about(Vec3::new(1.0, 2.0, 3.0), 0.7);
        let (from, to) = (turn * Vec3::new(-0.2, 0.05, 0.0), turn * Vec3::new(0.2, 0.05, 0.0));
        let long = over(from, to, None, Round::Ball(0.1));
        // Tangents from 0.2062 m, arc between the tangent points on the near side.
        let d = 0.2f64.hypot(0.05);
        let arc = 2.0 * libm::atan2(0.2, 0.05) - 2.0 * libm::acos(0.1 / d);
        assert!((long - (2.0 * (d * d - 0.01f64).sqrt() + 0.1 * arc)).abs() < 1e-12, "{long}");
    }

    #[test]
    fn a_side_inside_the_ring_pulls_the_cable_through_it() {
        let (from, to) = (Vec3::new(-0.2, 0.3, 0.0), Vec3::new(0.2, 0.3, 0.0));
        let long = over(from, to, Some(Vec3::ZERO), Round::Cylinder(0.1));
        assert!((long - 2.0 * 0.2f64.hypot(0.2)).abs() < 1e-9, "{long}");
    }
}
