//! Faces that another part of the same body, or other furniture, covers: nothing can touch them, and no
//! contact's normal may be theirs.
//!
//! Flush parts form one surface, but each part has its own edges and sides. A body that slides over the seam
//! would catch on them: its contact with the next part would have the side's normal, or lean towards it. The
//! possible normals of a union of convex parts at a point are those of the faces that are still its surface
//! there (Terdiman, *Contact generation for meshes*; Jolt's removal of internal edges). So the uncovered
//! remainder of every face is computed with the model. A contact whose normal needs a covered face is turned
//! to the best uncovered face, or dropped.

use super::solid::Solid;
use palmares_models::{Pose, Vec3};

/// Parts closer to each other than this are flush, m: this is rounding, too small a step to matter.
const FLUSH_M: f64 = 2e-5;

/// Distance from a face at which a point counts as just outside, m.
const OUTSIDE_M: f64 = 5e-5;

/// A contact this far beyond the remainder of a face is still on it, m: bodies sink into what they touch.
const BEYOND_M: f64 = 1e-3;

/// A point this close to a face is on it, m.
const ON_FACE_M: f64 = 1e-6;

/// A normal leans towards a face if the cosine of their angle is more than this.
const LEANS: f64 = 1e-3;

/// A normal is turned only to a face that it leans to by more than this.
const TURNED: f64 = 0.1;

/// Uncovered remainders of the faces of a shape next to other parts.
#[derive(Clone, Debug, Default)]
pub struct Seams {
    /// Every face that is partly or wholly covered.
    faces: Vec<Remainder>,
    /// The parts that cover it.
    others: Vec<Other>,
}

/// Another part: half-spaces that contain its core, and its rounding, m.
#[derive(Clone, Debug)]
struct Other {
    spaces: Vec<(Vec3, f64)>,
    rounding: f64,
}

impl Other {
    /// Whether a point is in or on the part; near edges that are not square, rather not.
    fn holds(&self, at: Vec3) -> bool {
        let beyond = |(normal, offset): &(Vec3, f64)| (normal.dot(at) - offset).max(0.0).powi(2);
        self.spaces.iter().map(beyond).sum::<f64>() <= (self.rounding + FLUSH_M).powi(2)
    }
}

#[derive(Clone, Debug)]
struct Remainder {
    face: u32,
    /// Convex polygons, counterclockwise as seen from outside; empty if the whole face is covered.
    pieces: Vec<Vec<Vec3>>,
    /// Per piece: a corner of each edge, and the direction out of the piece across it.
    edges: Vec<Vec<(Vec3, Vec3)>>,
}

/// Rule for a contact's normal at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Verdict {
    /// The normal stays.
    Free,
    /// The normal becomes that of this face.
    Turned(u32),
    /// There is no contact.
    Dropped,
}

/// Half-spaces that contain a shape, as unit normals and offsets in its own frame; empty for a shape without
/// flat faces.
fn half_spaces(solid: &Solid) -> Vec<(Vec3, f64)> {
    match solid {
        Solid::Ball | Solid::Segment { .. } => Vec::new(),
        Solid::HalfSpace { normal } => vec![(*normal, 0.0)],
        Solid::Polytope(polytope) => polytope.faces.iter().map(|face| (face.normal, face.offset)).collect(),
        Solid::Cylinder { radius, half_length } => {
            const SIDES: usize = 32;
            let side = |k: usize| {
                let (s, c) = libm::sincos(k as f64 * std::f64::consts::TAU / SIDES as f64);
                (Vec3::new(c, 0.0, s), *radius)
            };
            let caps = [(Vec3::Y, *half_length), (Vec3::NEG_Y, *half_length)];
            caps.into_iter().chain((0..SIDES).map(side)).collect()
        }
    }
}

impl Seams {
    /// Whether no face is covered.
    pub(crate) fn is_empty(&self) -> bool {
        self.faces.is_empty()
    }

    /// Removes the area that another part of the same body covers from the faces of `solid`; `from_other`
    /// maps that part's frame to this. Returns the work: how many half-spaces polygons were compared with.
    pub(crate) fn cover(
        &mut self,
        (solid, rounding): (&Solid, f64),
        other: (&Solid, f64),
        from_other: &Pose,
    ) -> u64 {
        let cores: Vec<(Vec3, f64)> = half_spaces(other.0)
            .into_iter()
            .map(|(normal, offset)| {
                let normal = from_other.rotation * normal;
                (normal, offset + normal.dot(from_other.translation))
            })
            .collect();
        if cores.is_empty() {
            return 0;
        }
        let spaces: Vec<(Vec3, f64)> = cores.iter().map(|(n, d)| (*n, d + other.1 + FLUSH_M)).collect();
        let (mut covers, mut work) = (false, 0);
        for (face, normal, ring) in solid.faces() {
            let outwards = normal * (rounding + OUTSIDE_M);
            let known = self.faces.iter().position(|known| known.face == face);
            let before = known.map_or_else(|| vec![ring], |k| self.faces[k].pieces.clone());
            let mut pieces = Vec::new();
            work += before.len() as u64 * spaces.len() as u64;
            for piece in &before {
                subtract(piece, outwards, &spaces, &mut pieces);
            }
            if pieces == before {
                continue;
            }
            covers = true;
            let edges = pieces.iter().map(|piece| edges(piece, normal)).collect();
            let remainder = Remainder { face, pieces, edges };
            match known {
                Some(k) => self.faces[k] = remainder,
                None => self.faces.push(remainder),
            }
        }
        if covers {
            self.others.push(Other { spaces: cores, rounding: other.1 });
        }
        work
    }

    /// Whether a point on a face of the core is on the face's remainder, or as far beyond it as bodies sink
    /// in.
    pub(crate) fn is_bare(&self, face: u32, at: Vec3) -> bool {
        let is_within = |(corner, outward): &(Vec3, Vec3)| outward.dot(at - *corner) <= BEYOND_M;
        self.faces
            .iter()
            .find(|known| known.face == face)
            .is_none_or(|known| known.edges.iter().any(|edges| edges.iter().all(is_within)))
    }

    /// Rule for the contact normal of a point on the core's surface, if it is not a face's own: it must
    /// need no face that is covered there. The normal of a point of the rounded surface that is in no other
    /// part stays.
    pub(crate) fn judge(&self, (solid, rounding): (&Solid, f64), normal: Vec3, at: Vec3) -> Verdict {
        if !self.others.iter().any(|other| other.holds(at + normal * rounding)) {
            return Verdict::Free;
        }
        let here = || solid.planes().filter(|(_, n, offset)| (n.dot(at) - offset).abs() <= ON_FACE_M);
        let needs_covered = here().any(|(face, n, _)| n.dot(normal) > LEANS && !self.is_bare(face, at));
        if !needs_covered {
            return Verdict::Free;
        }
        let mut best = (TURNED, Verdict::Dropped);
        for (face, n, _) in here().filter(|(face, ..)| self.is_bare(*face, at)) {
            let along = n.dot(normal);
            if along > best.0 {
                best = (along, Verdict::Turned(face));
            }
        }
        best.1
    }
}

/// A corner of each edge of a convex polygon, and the direction out of the polygon across it.
fn edges(polygon: &[Vec3], normal: Vec3) -> Vec<(Vec3, Vec3)> {
    let ends = polygon.iter().zip(polygon.iter().cycle().skip(1));
    ends.filter_map(|(p, q)| Some((*p, (*q - *p).cross(normal).try_normalize()?))).collect()
}

/// Adds to `out` the part of a polygon outside an intersection of half-spaces; the polygon is moved by
/// `aside` for the test.
fn subtract(polygon: &[Vec3], aside: Vec3, spaces: &[(Vec3, f64)], out: &mut Vec<Vec<Vec3>>) {
    // Most parts are far away.
    if spaces.iter().any(|(n, offset)| polygon.iter().all(|p| n.dot(*p + aside) >= *offset)) {
        out.push(polygon.to_vec());
        return;
    }
    let mut rest = polygon.to_vec();
    if !is_area(&rest) {
        return;
    }
    for (normal, offset) in spaces {
        let height = |p: Vec3| normal.dot(p + aside) - offset;
        // Most half-spaces cut nothing off.
        if rest.iter().all(|p| height(*p) < 0.0) {
            continue;
        }
        let (inside, outside) = (half(&rest, |p| -height(p)), half(&rest, height));
        if is_area(&outside) {
            out.push(outside);
        }
        rest = inside;
        if !is_area(&rest) {
            return;
        }
    }
}

/// The part of a convex polygon where `height` is not negative.
fn half(polygon: &[Vec3], height: impl Fn(Vec3) -> f64) -> Vec<Vec3> {
    let mut out = Vec::with_capacity(polygon.len() + 1);
    for k in 0..polygon.len() {
        let (p, q) = (polygon[k], polygon[(k + 1) % polygon.len()]);
        let (a, b) = (height(p), height(q));
        if a >= 0.0 {
            out.push(p);
        }
        if (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0) {
            out.push(p + (q - p) * (a / (a - b)));
        }
    }
    out
}

/// Whether a polygon is wider than what counts as flush.
fn is_area(polygon: &[Vec3]) -> bool {
    if polygon.len() < 3 {
        return false;
    }
    let (mut twice, mut around) = (Vec3::ZERO, 0.0);
    for k in 0..polygon.len() {
        let (p, q) = (polygon[k], polygon[(k + 1) % polygon.len()]);
        twice += (p - polygon[0]).cross(q - polygon[0]);
        around += p.distance(q);
    }
    twice.length() > FLUSH_M * around
}
