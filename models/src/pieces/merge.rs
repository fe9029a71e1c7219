//! Joins parts to fewer pieces: repeatedly the two whose common hull adds the least volume.

use parry3d_f64::transformation::try_convex_hull;

use crate::Vec3;
use crate::shape::hull::thinned;
use crate::shape::inertia::volume_of_triangles;

/// Pieces are joined, even below the requested number, while the excess of a piece's hull over its parts'
/// volume is within this.
const FREE: f64 = 0.03;

/// Points by which pieces are compared: of more, the support points along this number of directions represent
/// the hull.
const PROXY: usize = 96;

/// The hull of some parts.
pub(super) struct Piece {
    /// Vertices of the hull, or, if it is flat, points.
    pub(super) points: Vec<Vec3>,
    /// A few of them that represent the hull while pieces are joined.
    proxy: Vec<Vec3>,
    /// Volume of the hull of these few points, m³.
    pub(super) volume: f64,
    /// Volume of the parts it was joined from, m³.
    parts_volume: f64,
    low: Vec3,
    high: Vec3,
}

/// Vertices and volume of a hull; empty and 0 if it is flat.
fn hull(points: &[Vec3]) -> (Vec<Vec3>, f64) {
    let found = try_convex_hull(points).ok();
    found.map_or((Vec::new(), 0.0), |(vertices, faces)| {
        let volume = volume_of_triangles(&vertices, &faces).max(0.0);
        (vertices, volume)
    })
}

impl Piece {
    fn new(points: Vec<Vec3>, parts_volume: Option<f64>) -> Piece {
        let (vertices, mut volume) = hull(&points);
        let points = if vertices.is_empty() { points } else { vertices };
        let mut proxy = points.clone();
        if points.len() > PROXY {
            proxy = thinned(&points, PROXY);
            volume = hull(&proxy).1;
        }
        let low = points.iter().fold(Vec3::splat(f64::INFINITY), |low, p| low.min(*p));
        let high = points.iter().fold(Vec3::splat(f64::NEG_INFINITY), |high, p| high.max(*p));
        Piece { points, proxy, volume, parts_volume: parts_volume.unwrap_or(volume), low, high }
    }

    fn joined(&self, other: &Piece) -> Piece {
        let points = self.points.iter().chain(&other.points).copied().collect();
        Piece::new(points, Some(self.parts_volume + other.parts_volume))
    }

    fn near(&self, other: &Piece, margin: f64) -> bool {
        let gap = (self.low - other.high).max(other.low - self.high);
        gap.max_element() <= margin
    }
}

/// Effect of joining two pieces.
struct Pair {
    a: usize,
    b: usize,
    /// m³
    added: f64,
    /// Excess of the common hull over its parts, relative to their volume.
    excess: f64,
}

/// At most `most` pieces of the parts' points. `margin` is the largest distance of neighbours, m. `report` is
/// called with the remaining number of pieces.
pub(super) fn merge(
    parts: Vec<Vec<Vec3>>,
    most: usize,
    margin: f64,
    report: &mut dyn FnMut(usize),
) -> Vec<Piece> {
    let mut pieces: Vec<Option<Piece>> =
        parts.into_iter().filter(|p| !p.is_empty()).map(|p| Some(Piece::new(p, None))).collect();
    let mut left = pieces.len();
    let pair = |pieces: &[Option<Piece>], a: usize, b: usize, far: bool| {
        let (x, y) = (pieces[a].as_ref()?, pieces[b].as_ref()?);
        if !far && !x.near(y, margin) {
            return None;
        }
        let proxy: Vec<Vec3> = x.proxy.iter().chain(&y.proxy).copied().collect();
        let (volume, parts) = (hull(&proxy).1, x.parts_volume + y.parts_volume);
        Some(Pair { a, b, added: volume - x.volume - y.volume, excess: volume / parts - 1.0 })
    };
    let mut pairs: Vec<Pair> = Vec::new();
    for b in 0..pieces.len() {
        pairs.extend((0..b).filter_map(|a| pair(&pieces, a, b, false)));
    }
    let mut far = false;
    loop {
        let flat = |p: &Pair| [p.a, p.b].iter().any(|&k| pieces[k].as_ref().is_some_and(|x| x.volume <= 0.0));
        // A flat part is no piece: it joins a neighbour whatever that adds.
        let cheap = |p: &Pair| flat(p) || p.excess <= FREE;
        let best = (0..pairs.len())
            .filter(|&k| left > most || cheap(&pairs[k]))
            .min_by(|&x, &y| pairs[x].added.total_cmp(&pairs[y].added));
        let Some(best) = best else {
            if left <= most || far {
                break;
            }
            // The rest touches nothing: any two may be joined.
            far = true;
            for b in 0..pieces.len() {
                pairs.extend((0..b).filter_map(|a| pair(&pieces, a, b, true)));
            }
            continue;
        };
        let Pair { a, b, .. } = pairs.swap_remove(best);
        let joined = pieces[a].as_ref().zip(pieces[b].as_ref()).map(|(x, y)| x.joined(y));
        pairs.retain(|p| ![p.a, p.b].iter().any(|k| [a, b].contains(k)));
        (pieces[a], pieces[b]) = (joined, None);
        left -= 1;
        report(left);
        pairs.extend((0..pieces.len()).filter(|&k| k != a).filter_map(|k| pair(&pieces, a, k, far)));
    }
    pieces.into_iter().flatten().collect()
}
