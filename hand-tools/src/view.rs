//! A hand from the side of its palm: outlines of its shapes, the farthest first.

use crate::fingers::fingers;
use crate::outline::outline;
use palmares_models::hand::Hand;
use palmares_models::{Rotation, Vec3};

/// View direction: azimuth from the x axis, and elevation, rad.
const AZIMUTH: f64 = 0.5;
const ELEVATION: f64 = 0.35;

/// A hand in one posture.
#[derive(Clone, Debug, Default)]
pub(crate) struct View {
    pub(crate) title: String,
    /// The nearest last.
    pub(crate) outlines: Vec<Outline>,
}

/// The outline of a shape.
#[derive(Clone, Debug)]
pub(crate) struct Outline {
    /// Right and up, m; convex, counter-clockwise.
    pub(crate) points: Vec<(f64, f64)>,
    /// Index of the finger; None for the palm.
    pub(crate) finger: Option<usize>,
}

/// The view of a hand with these coordinates, its base upright.
pub(crate) fn view_of(hand: &Hand, q: &[f64], title: String) -> View {
    let to_world = Rotation::from_rotation_z(AZIMUTH) * Rotation::from_rotation_y(-ELEVATION);
    let [near, right, up] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| to_world * axis);
    let groups = fingers(hand);
    // The links of a finger are moved by its coordinates, or are descendants of such links.
    let mut finger_of: Vec<Option<usize>> = Vec::with_capacity(hand.links.len());
    for link in &hand.links {
        let own = link.joint.as_ref().and_then(|joint| {
            groups.iter().position(|group| group.members.iter().any(|&(c, _)| c == joint.coordinate))
        });
        finger_of.push(own.or_else(|| link.parent.and_then(|parent| finger_of[parent])));
    }
    let mut outlines: Vec<(f64, Outline)> = Vec::new();
    for (i, base_from_link) in hand.base_from_links(q).iter().enumerate() {
        for geom in &hand.links[i].geoms {
            let base_from_geom = *base_from_link * geom.link_from_geom;
            let depth = base_from_geom.translation.dot(near);
            let points = outline(&geom.shape, &base_from_geom, right, up);
            outlines.push((depth, Outline { points, finger: finger_of[i] }));
        }
    }
    // The farthest first.
    outlines.sort_by(|a, b| a.0.total_cmp(&b.0));
    View { title, outlines: outlines.into_iter().map(|(_, outline)| outline).collect() }
}

/// The area of these views: left, right, bottom, top, m.
pub(crate) fn span(views: &[View]) -> (f64, f64, f64, f64) {
    let points = views.iter().flat_map(|view| &view.outlines).flat_map(|outline| &outline.points);
    points.fold((f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY), |span, &(x, y)| {
        (span.0.min(x), span.1.max(x), span.2.min(y), span.3.max(y))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_softhand_has_five_fingers_and_is_lower_when_closed() {
        let hand = Hand::builtin("softhand").expect("it is built in");
        let rest: Vec<f64> = hand.coordinates.iter().map(|c| c.rest).collect();
        let closed: Vec<f64> = hand.coordinates.iter().map(|c| c.upper.min(1.0)).collect();
        let [open, closed] = [rest, closed].map(|q| view_of(&hand, &q, String::new()));
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
