//! Contacts with a half-space: every corner near its plane, or the rim or line of a curved side.

use super::clip::Overlap;
use super::patch;
use super::rim;
use crate::surface::solid::{Corner, Feature, Solid};
use palmares_models::Vec3;
use parry3d_f64::shape::PackedFeatureId;

/// Largest number of corners besides those of the flattest face, the deepest first.
const MAX_OTHER_CORNERS: usize = 8;

/// Finds the corners of `solid` that are within `reach` of the plane. The plane's `normal` points out of the
/// ground, in the solid's frame, from the point `on_plane`. Positions are in the solid's frame; heights are
/// above the plane. Returns the lever of friction.
pub(super) fn corners(
    solid: &Solid,
    (normal, on_plane): (Vec3, Vec3),
    reach: f64,
    feature: &mut Feature,
    out: &mut Vec<(Vec3, Overlap)>,
) -> f64 {
    out.clear();
    solid.feature(-normal, None, feature);
    let across = super::clip::Across::of(normal);
    let place = |at: Vec3, id: u32| {
        let height = (at - on_plane).dot(normal);
        let ids = [PackedFeatureId::face(0), PackedFeatureId::vertex(id)];
        Overlap { x: at.dot(across.x), y: at.dot(across.y), heights: [0.0, height], ids }
    };
    let rim = solid.rim(-normal);
    let lowest = rim.map(|rim| (rim, (rim.at - on_plane).dot(normal)));
    let of_face = |corner: &Corner| {
        let mut placed = place(corner.at, corner.id);
        if let Some((rim, lowest)) = &lowest {
            placed.heights[1] += rim::recede(rim, placed.heights[1] - lowest);
        }
        placed
    };
    let face: Vec<Overlap> = feature.corners.iter().map(of_face).collect();
    let mut near: Vec<Overlap> = face.iter().copied().filter(|corner| corner.distance() <= reach).collect();
    patch::reduce(&mut near, solid.is_cylinder());
    let lever = patch::lever(&face, if near.is_empty() { &face } else { &near });
    if let Solid::Polytope(polytope) = solid {
        let in_face = |k: u32| feature.corners.iter().any(|corner| corner.id == k);
        let others = (0u32..).zip(&polytope.vertices).filter(|(k, _)| !in_face(*k));
        let mut beside: Vec<Overlap> =
            others.map(|(k, at)| place(*at, k)).filter(|corner| corner.distance() <= reach).collect();
        beside.sort_by(|a, b| a.distance().total_cmp(&b.distance()));
        beside.truncate(MAX_OTHER_CORNERS);
        near.extend(beside);
    }
    if let Some(rim) = rim {
        let mut corner = place(rim.at, crate::surface::solid::RIM);
        corner.heights[1] += rim::fade(rim.sine);
        if corner.distance() <= reach {
            near.push(corner);
        }
    }
    out.extend(near.iter().map(|corner| {
        let at = across.x * corner.x + across.y * corner.y;
        (at + normal * (on_plane.dot(normal) + corner.heights[1]), *corner)
    }));
    lever
}
