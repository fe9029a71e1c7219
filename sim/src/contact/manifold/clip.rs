//! Overlap of two features, projected along the contact's normal: one is clipped by the edges of the other
//! (Sutherland and Hodgman 1974), so that every corner of the common polygon is found once and in order.

use crate::surface::solid::Feature;
use palmares_models::Vec3;
use parry3d_f64::shape::PackedFeatureId;

/// A corner of the overlap. Heights are along the normal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Overlap {
    /// Coordinates across the normal, m.
    pub x: f64,
    pub y: f64,
    /// Height of A's surface and of B's, m.
    pub heights: [f64; 2],
    /// Feature ids of A and B at this corner.
    pub ids: [PackedFeatureId; 2],
}

impl Overlap {
    pub(super) fn distance(&self) -> f64 {
        self.heights[1] - self.heights[0]
    }
}

/// Directions across a normal; x, y and the normal are right-handed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Across {
    pub x: Vec3,
    pub y: Vec3,
    pub normal: Vec3,
}

impl Across {
    pub(super) fn of(normal: Vec3) -> Self {
        let x = normal.any_orthonormal_vector();
        Across { x, y: normal.cross(x), normal }
    }
}

/// A corner of a feature, projected along the normal.
#[derive(Clone, Copy, Debug)]
struct Projected {
    x: f64,
    y: f64,
    height: f64,
    id: u32,
}

/// Origin of a corner of the polygon that is clipped.
#[derive(Clone, Copy, Debug)]
enum Origin {
    /// A corner of the clipped feature.
    Corner(u32),
    /// A crossing of one of its edges with an edge of the other feature.
    Crossing(u32, u32),
    /// A corner of the other feature.
    Knife(usize),
    /// Beyond the other feature's corners; a later cut removes it.
    Beyond,
}

/// A line between two corners: an edge of the clipped feature, or of the other.
#[derive(Clone, Copy, Debug)]
enum Edge {
    Own(u32),
    Knife(usize),
}

#[derive(Clone, Copy, Debug)]
struct Cut {
    x: f64,
    y: f64,
    /// Height of the clipped surface; meaningless at the other's corners.
    height: f64,
    origin: Origin,
    /// Edge from here to the next corner.
    edge: Edge,
}

/// Scratch memory of a clip.
#[derive(Clone, Debug, Default)]
pub(super) struct Clip {
    knife: Vec<Projected>,
    cut: Vec<Cut>,
    next: Vec<Cut>,
}

/// The plane of a feature as heights over coordinates across the normal: `h = h₀ + a x + b y`. `None` for a
/// line, and for a plane along the normal.
fn plane(feature: &Feature, across: &Across) -> Option<[f64; 3]> {
    let (n, corners) = (feature.normal, &feature.corners);
    let along = n.dot(across.normal);
    if corners.len() < 3 || along.abs() < STEEP {
        return None;
    }
    let offset = corners.iter().map(|corner| n.dot(corner.at)).sum::<f64>() / corners.len() as f64;
    Some([offset / along, -n.dot(across.x) / along, -n.dot(across.y) / along])
}

/// A plane whose normal has a smaller cosine to the contact's normal than this gives no usable heights.
const STEEP: f64 = 0.02;

/// Id of an edge, from its two corners.
fn edge_id(a: u32, b: u32) -> u32 {
    (a.min(b) & 0xfff) << 12 | (a.max(b) & 0xfff)
}

fn project(feature: &Feature, across: &Across, to: &mut Vec<Projected>) {
    to.clear();
    to.extend(feature.corners.iter().map(|corner| Projected {
        x: corner.at.dot(across.x),
        y: corner.at.dot(across.y),
        height: corner.at.dot(across.normal),
        id: corner.id,
    }));
}

impl Clip {
    /// Corners of the overlap of features of A and B, both in A's frame, and the radius of a line in it.
    pub(super) fn overlap(&mut self, a: &Feature, b: &Feature, across: &Across, out: &mut Vec<Overlap>) {
        out.clear();
        if a.corners.is_empty() || b.corners.is_empty() {
            return;
        }
        let [of_a, of_b] = [a, b].map(|feature| {
            if feature.corners.len() > 2 { feature.normal.dot(across.normal).abs() } else { -1.0 }
        });
        if of_a < 0.0 && of_b < 0.0 {
            return lines(a, b, across, out);
        }
        // The flatter feature cuts.
        let a_is_knife = of_a >= of_b;
        let (knife, cut) = if a_is_knife { (a, b) } else { (b, a) };
        project(knife, across, &mut self.knife);
        self.cut_by_knife(cut, across);
        let knife_plane = plane(knife, across);
        let cut_plane = plane(cut, across);
        for corner in &self.cut {
            let at = |plane: Option<[f64; 3]>| plane.map(|[h, x, y]| h + x * corner.x + y * corner.y);
            let (own, other, own_id, other_id) = match corner.origin {
                Origin::Corner(id) => (
                    Some(corner.height),
                    at(knife_plane),
                    PackedFeatureId::vertex(id),
                    PackedFeatureId::face(knife.face),
                ),
                Origin::Crossing(own, other) => (
                    Some(corner.height),
                    at(knife_plane),
                    PackedFeatureId::edge(own),
                    PackedFeatureId::edge(other),
                ),
                Origin::Beyond => continue,
                Origin::Knife(k) => (
                    at(cut_plane),
                    Some(self.knife[k].height),
                    PackedFeatureId::face(cut.face),
                    PackedFeatureId::vertex(self.knife[k].id),
                ),
            };
            let (Some(own), Some(other)) = (own, other) else { continue };
            let (heights, ids) = if a_is_knife {
                ([other, own], [other_id, own_id])
            } else {
                ([own, other], [own_id, other_id])
            };
            out.push(Overlap { x: corner.x, y: corner.y, heights, ids });
        }
    }

    /// Keeps the part of a polygon or a line that is within the cutting feature.
    fn cut_by_knife(&mut self, feature: &Feature, across: &Across) {
        let Clip { knife, cut, next } = self;
        let n = feature.corners.len();
        cut.clear();
        for (k, corner) in feature.corners.iter().enumerate() {
            let (x, y) = (corner.at.dot(across.x), corner.at.dot(across.y));
            let edge = Edge::Own(edge_id(corner.id, feature.corners[(k + 1) % n].id));
            let height = corner.at.dot(across.normal);
            cut.push(Cut { x, y, height, origin: Origin::Corner(corner.id), edge });
        }
        let is_line = n == 2;
        // The inside is on the left of every edge, or on the right of every edge.
        let area = (0..knife.len()).fold(0.0, |area, k| {
            let (p, q) = (knife[k], knife[(k + 1) % knife.len()]);
            area + (p.x * q.y - q.x * p.y)
        });
        let sign = if area < 0.0 { -1.0 } else { 1.0 };
        for k in 0..knife.len() {
            let (p, q) = (knife[k], knife[(k + 1) % knife.len()]);
            let (dx, dy) = (q.x - p.x, q.y - p.y);
            let side = |c: &Cut| sign * (dx * (c.y - p.y) - dy * (c.x - p.x));
            next.clear();
            let count = cut.len();
            for i in 0..count {
                let (here, there) = (cut[i], cut[(i + 1) % count]);
                let (s, t) = (side(&here), side(&there));
                let last = is_line && i + 1 == count;
                let crossing = || {
                    let part = s / (s - t);
                    let origin = match here.edge {
                        Edge::Own(id) => Origin::Crossing(id, edge_id(p.id, q.id)),
                        // Consecutive lines of the cutting feature meet in its corner.
                        Edge::Knife(j) if (j + 1) % knife.len() == k => Origin::Knife(k),
                        Edge::Knife(j) if (k + 1) % knife.len() == j => Origin::Knife(j),
                        Edge::Knife(_) => Origin::Beyond,
                    };
                    let [x, y, height] = match origin {
                        Origin::Knife(corner) => [knife[corner].x, knife[corner].y, 0.0],
                        _ => [
                            here.x + part * (there.x - here.x),
                            here.y + part * (there.y - here.y),
                            here.height + part * (there.height - here.height),
                        ],
                    };
                    Cut { x, y, height, origin, edge: here.edge }
                };
                if s >= 0.0 {
                    next.push(here);
                    if t < 0.0 && !last {
                        next.push(Cut { edge: Edge::Knife(k), ..crossing() });
                    }
                } else if t >= 0.0 && !last {
                    // If it returns exactly on the line, the corner itself is the crossing.
                    if t > 0.0 {
                        next.push(crossing());
                    }
                }
            }
            std::mem::swap(cut, next);
        }
    }
}

/// Two lines: their crossing, and the ends of the stretch where they run side by side. Round lines that are
/// not parallel separate towards the ends: by `e²/(2 (r₁ + r₂))` where they are e apart across the normal.
fn lines(a: &Feature, b: &Feature, across: &Across, out: &mut Vec<Overlap>) {
    let place = |at: Vec3| [at.dot(across.x), at.dot(across.y), at.dot(across.normal)];
    let [a0, a1] = [0, 1].map(|k| place(a.corners[k].at));
    let [b0, b1] = [0, 1].map(|k| place(b.corners[k].at));
    let along = [a1[0] - a0[0], a1[1] - a0[1]];
    let other = [b1[0] - b0[0], b1[1] - b0[1]];
    let dot = |p: [f64; 2], q: [f64; 2]| p[0] * q[0] + p[1] * q[1];
    let (aa, bb) = (dot(along, along), dot(other, other));
    if aa == 0.0 || bb == 0.0 {
        return;
    }
    let between = |p: [f64; 3], q: [f64; 3], part: f64| [0, 1, 2].map(|k| p[k] + part * (q[k] - p[k]));
    let radius = a.radius + b.radius;
    let edges = [edge_id(a.corners[0].id, a.corners[1].id), edge_id(b.corners[0].id, b.corners[1].id)]
        .map(PackedFeatureId::edge);
    let mut add = |s: f64, t: f64, ids: [PackedFeatureId; 2]| {
        let (p, q) = (between(a0, a1, s), between(b0, b1, t));
        let offset = [q[0] - p[0], q[1] - p[1]];
        let parted = if radius > 0.0 { dot(offset, offset) / (2.0 * radius) } else { 0.0 };
        let (x, y) = (0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1]));
        out.push(Overlap { x, y, heights: [p[2], q[2] + parted], ids });
    };
    let cross = along[0] * other[1] - along[1] * other[0];
    let from = [b0[0] - a0[0], b0[1] - a0[1]];
    let sine_squared = cross * cross / (aa * bb);
    if sine_squared > PARALLEL * PARALLEL {
        let s = (from[0] * other[1] - from[1] * other[0]) / cross;
        let t = (from[0] * along[1] - from[1] * along[0]) / cross;
        if (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
            add(s, t, edges);
        }
    }
    if sine_squared < BESIDE * BESIDE {
        // B's ends next to A, and A's ends next to B.
        let on_a = |p: [f64; 3]| dot([p[0] - a0[0], p[1] - a0[1]], along) / aa;
        let on_b = |p: [f64; 3]| dot([p[0] - b0[0], p[1] - b0[1]], other) / bb;
        for (k, p, t) in [(0, b0, 0.0), (1, b1, 1.0)] {
            let s = on_a(p);
            if (0.0..=1.0).contains(&s) {
                add(s, t, [edges[0], PackedFeatureId::vertex(b.corners[k].id)]);
            }
        }
        for (k, p, s) in [(0, a0, 0.0), (1, a1, 1.0)] {
            let t = on_b(p);
            if (0.0..1.0).contains(&t) && t > 0.0 {
                add(s, t, [PackedFeatureId::vertex(a.corners[k].id), edges[1]]);
            }
        }
    }
}

/// Lines are parallel below this sine of their angle.
const PARALLEL: f64 = 1e-6;

/// Lines run side by side below this sine: 22°.
const BESIDE: f64 = 0.38;

/// A point of shape `side`'s rim against the other's feature, if it is within it; lifted along the normal.
pub(super) fn on_face(
    other: &Feature,
    at: Vec3,
    lifted: f64,
    across: &Across,
    side: usize,
) -> Option<Overlap> {
    let [h, a, b] = plane(other, across)?;
    let (x, y) = (at.dot(across.x), at.dot(across.y));
    let n = other.corners.len();
    let (mut left, mut right) = (false, false);
    for k in 0..n {
        let (p, q) = (other.corners[k].at, other.corners[(k + 1) % n].at);
        let [px, py, qx, qy] = [p.dot(across.x), p.dot(across.y), q.dot(across.x), q.dot(across.y)];
        let turn = (qx - px) * (y - py) - (qy - py) * (x - px);
        left |= turn > 0.0;
        right |= turn < 0.0;
    }
    if left && right {
        return None;
    }
    let (own, other_height) = (at.dot(across.normal) + lifted, h + a * x + b * y);
    let (own_id, other_id) =
        (PackedFeatureId::vertex(crate::surface::solid::RIM), PackedFeatureId::face(other.face));
    Some(if side == 0 {
        Overlap { x, y, heights: [own, other_height], ids: [own_id, other_id] }
    } else {
        Overlap { x, y, heights: [other_height, own], ids: [other_id, own_id] }
    })
}
