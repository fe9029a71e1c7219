//! A hand seen from the side of its palm: the outlines of its shapes, those behind first.

use super::figure::fingers;
use palmares_models::hand::Hand;
use palmares_models::shape::Shape;
use palmares_models::{Rotation, Vec3};
use std::f64::consts::TAU;

/// Corners of a circle.
const CORNERS: usize = 24;
/// Where the eye is: turned so much about z from the x axis, and raised, rad.
const AROUND: f64 = 0.5;
const RAISED: f64 = 0.35;

/// A hand in one posture.
#[derive(Clone, Debug, Default)]
pub(super) struct View {
    pub(super) title: String,
    /// Those in front last.
    pub(super) outlines: Vec<Outline>,
}

/// A shape as it is seen.
#[derive(Clone, Debug)]
pub(super) struct Outline {
    /// To the right and up, m; convex, counter-clockwise.
    pub(super) points: Vec<(f64, f64)>,
    /// Which finger; none for the palm.
    pub(super) finger: Option<usize>,
}

/// Looks at a hand with these coordinates, its base frame upright.
pub(super) fn look(hand: &Hand, q: &[f64], title: String) -> View {
    let eye = Rotation::from_rotation_y(RAISED) * Rotation::from_rotation_z(-AROUND);
    let groups = fingers(hand);
    // A finger's links are those that its coordinates move, and what hangs on them.
    let mut finger_of: Vec<Option<usize>> = Vec::with_capacity(hand.links.len());
    for link in &hand.links {
        let own = link.joint.as_ref().and_then(|joint| {
            groups.iter().position(|group| group.members.iter().any(|&(c, _)| c == joint.coordinate))
        });
        finger_of.push(own.or_else(|| link.parent.and_then(|parent| finger_of[parent])));
    }
    let mut seen: Vec<(f64, Outline)> = Vec::new();
    for (i, base_from_link) in hand.base_from_links(q).iter().enumerate() {
        for geom in &hand.links[i].geoms {
            let base_from_geom = *base_from_link * geom.link_from_geom;
            let (points, radius) = skeleton(&geom.shape);
            let place = |p: &Vec3| eye * (base_from_geom * *p);
            let placed: Vec<Vec3> = points.iter().map(place).collect();
            let depth = placed.iter().map(|p| p.x).sum::<f64>() / placed.len().max(1) as f64;
            let round = |p: &Vec3| {
                let (right, up) = (p.y, p.z);
                circle(radius).map(move |(x, y)| (right + x, up + y))
            };
            let points = convex(placed.iter().flat_map(round).collect());
            seen.push((depth, Outline { points, finger: finger_of[i] }));
        }
    }
    // The eye is at +x.
    seen.sort_by(|a, b| a.0.total_cmp(&b.0));
    View { title, outlines: seen.into_iter().map(|(_, outline)| outline).collect() }
}

/// Points that, each with a ball of the radius around it, span a shape.
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

/// A circle's corners; one point without a radius.
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

/// What all of these views span: left, right, bottom, top, m.
pub(super) fn span(views: &[View]) -> (f64, f64, f64, f64) {
    let points = views.iter().flat_map(|view| &view.outlines).flat_map(|outline| &outline.points);
    points.fold((f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY), |span, &(x, y)| {
        (span.0.min(x), span.1.max(x), span.2.min(y), span.3.max(y))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hull_is_what_a_rubber_band_would_be() {
        let square = vec![(0.0, 0.0), (1.0, 1.0), (0.5, 0.5), (1.0, 0.0), (0.0, 1.0), (0.5, 0.0), (1.0, 1.0)];
        assert_eq!(convex(square), [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]);
    }

    #[test]
    fn the_softhand_is_seen_with_five_fingers_and_smaller_when_closed() {
        let hand = Hand::builtin("softhand").expect("it is built in");
        let rest: Vec<f64> = hand.coordinates.iter().map(|c| c.rest).collect();
        let closed: Vec<f64> = hand.coordinates.iter().map(|c| c.upper.min(1.0)).collect();
        let [open, closed] = [rest, closed].map(|q| look(&hand, &q, String::new()));
        let shapes: usize = hand.links.iter().map(|link| link.geoms.len()).sum();
        for view in [&open, &closed] {
            assert_eq!(view.outlines.len(), shapes);
            assert!(view.outlines.iter().all(|outline| outline.points.len() >= 3));
            for finger in 0..5 {
                assert!(view.outlines.iter().any(|outline| outline.finger == Some(finger)), "{finger}");
            }
        }
        let height = |view: &View| span(std::slice::from_ref(view)).3;
        assert!(height(&closed) < height(&open) - 0.02, "{} {}", height(&closed), height(&open));
    }
}
