//! The area on which two flat faces press: the corners that represent it, and the distance from its middle at
//! which friction acts.
//!
//! Under an even pressure the friction of an area A against spin is `μ N ρ`, `ρ = 1/A ∫ |r − c| dA` about its centroid c. Points at
//! its corners, which carry the normal forces, would give `μ N Σ|r_i − c|/n`, as if all pressure were on the
//! rim. So friction acts at the distance `λ |r_i − c|` instead of `|r_i − c|`, with the factor `λ = ρ n/Σ|r_i
//! − c|`: 2/3 for a disc, 1/2 for a line. Most of this distance is the offset of a point's friction; the rest
//! is the arm at which the point itself resists spin ([`super::super::narrow_phase`]). The sum of the points' friction then
//! has Contensou's coupling of slip and spin.

use super::clip::Overlap;

/// Largest number of points of a patch. The deepest corner is one more if it is not among them.
const MAX_POINTS: usize = 8;

/// The same for a disc. When it tilts, the lowest point of its rim is one more.
const MAX_POINTS_OF_DISC: usize = 4;

/// A dropped corner counts if it is deeper than all others by more than this, m.
const DEEPER_M: f64 = 1e-6;

/// Factor λ of a line, and of areas below [`THIN`].
pub(super) const LINE: f64 = 0.5;

/// λ is larger by this factor than under an even pressure. Pure spin stops 2 to 3 % early; in return
/// distance, turn and time of a disc that slides and spins, and the final ratio of slip to spin, are within 3.2 %.
const SPREAD: f64 = 1.03;

/// An area below this part of the square of its circumference is a line.
const THIN: f64 = 1e-5;

/// Keeps as many corners of a polygon as a patch may have: the corner whose loss costs the least area goes
/// first. Corners with the same cost go in order, so that a regular polygon stays regular.
pub(super) fn reduce(corners: &mut Vec<Overlap>, of_disc: bool) {
    let most = if of_disc { MAX_POINTS_OF_DISC } else { MAX_POINTS };
    if corners.len() <= most {
        return;
    }
    let mut left_out: Option<Overlap> = None;
    while corners.len() > most {
        let n = corners.len();
        let (mut least, mut which) = (f64::INFINITY, 0);
        for k in 0..n {
            let area = triangle(&corners[(k + n - 1) % n], &corners[k], &corners[(k + 1) % n]);
            if area < least * (1.0 - 1e-6) {
                (least, which) = (area, k);
            }
        }
        let gone = corners.remove(which);
        if left_out.is_none_or(|other| gone.distance() < other.distance()) {
            left_out = Some(gone);
        }
    }
    let deepest = corners.iter().map(Overlap::distance).fold(f64::INFINITY, f64::min);
    corners.extend(left_out.filter(|corner| corner.distance() < deepest - DEEPER_M));
}

fn triangle(a: &Overlap, b: &Overlap, c: &Overlap) -> f64 {
    0.5 * ((b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y)).abs()
}

/// Lever λ of a polygon's friction when `kept` points represent it.
pub(super) fn lever(polygon: &[Overlap], kept: &[Overlap]) -> f64 {
    let Some(([cx, cy], radius)) = mean_radius(polygon) else { return LINE };
    let to_corners = kept.iter().map(|p| (p.x - cx).hypot_of(p.y - cy)).sum::<f64>() / kept.len() as f64;
    if to_corners > 0.0 { (SPREAD * radius / to_corners).clamp(0.25, 1.0) } else { LINE }
}

trait Hypot {
    fn hypot_of(self, other: Self) -> Self;
}

impl Hypot for f64 {
    /// Without the system's library, whose last bit differs.
    fn hypot_of(self, other: f64) -> f64 {
        (self * self + other * other).sqrt()
    }
}

/// Centroid of a polygon, and the mean distance of its points from the centroid. `None` without area.
fn mean_radius(polygon: &[Overlap]) -> Option<([f64; 2], f64)> {
    let n = polygon.len();
    if n < 3 {
        return None;
    }
    let origin = &polygon[0];
    let (mut area, mut around, mut cx, mut cy) = (0.0, 0.0, 0.0, 0.0);
    for k in 0..n {
        let (p, q) = (&polygon[k], &polygon[(k + 1) % n]);
        let [px, py, qx, qy] = [p.x - origin.x, p.y - origin.y, q.x - origin.x, q.y - origin.y];
        let twice = px * qy - qx * py;
        area += 0.5 * twice;
        cx += twice * (px + qx) / 6.0;
        cy += twice * (py + qy) / 6.0;
        around += (qx - px).hypot_of(qy - py);
    }
    if area.abs() < THIN * around * around {
        return None;
    }
    let [cx, cy] = [origin.x + cx / area, origin.y + cy / area];
    // An edge and the centroid form a triangle of height d. Its integral, between the angles φ of the edge's ends:
    // ∫∫ r dA = d³/6 [tan φ sec φ + asinh(tan φ)].
    let mut moment = 0.0;
    for k in 0..n {
        let (p, q) = (&polygon[k], &polygon[(k + 1) % n]);
        let [px, py, qx, qy] = [p.x - cx, p.y - cy, q.x - cx, q.y - cy];
        let (dx, dy) = (qx - px, qy - py);
        let length = dx.hypot_of(dy);
        if length == 0.0 {
            continue;
        }
        let d = (px * qy - qx * py) / length;
        if d.abs() < 1e-9 * around {
            continue;
        }
        let primitive = |along: f64| {
            let t = along / d;
            t * (1.0 + t * t).sqrt() + libm::asinh(t)
        };
        let [from, to] = [(px * dx + py * dy) / length, (qx * dx + qy * dy) / length];
        moment += d * d * d / 6.0 * (primitive(to) - primitive(from));
    }
    Some(([cx, cy], (moment / area).abs()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use parry3d_f64::shape::PackedFeatureId;

    fn polygon(corners: &[(f64, f64)]) -> Vec<Overlap> {
        let ids = [PackedFeatureId::UNKNOWN; 2];
        corners.iter().map(|&(x, y)| Overlap { x, y, heights: [0.0; 2], ids }).collect()
    }

    fn regular(n: usize, radius: f64, at: (f64, f64)) -> Vec<Overlap> {
        let corner = |k: usize| {
            let (s, c) = libm::sincos(k as f64 * std::f64::consts::TAU / n as f64);
            (at.0 + radius * c, at.1 + radius * s)
        };
        polygon(&(0..n).map(corner).collect::<Vec<_>>())
    }

    #[test]
    fn levers_are_those_of_an_even_pressure_and_a_little_more() {
        let disc = regular(400, 0.03, (0.2, -0.1));
        assert!((lever(&disc, &disc) - SPREAD * 2.0 / 3.0).abs() < 1e-4, "{}", lever(&disc, &disc));
        // Mean distance from the middle of a square of side a: a (√2 + asinh 1)/6, its corners' a/√2.
        let square = polygon(&[(1.0, 1.0), (3.0, 1.0), (3.0, 3.0), (1.0, 3.0)]);
        let exact = (2f64.sqrt() + libm::asinh(1.0)) / 6.0 * 2f64.sqrt();
        assert!((lever(&square, &square) - SPREAD * exact).abs() < 1e-12);
        let mut turned = square.clone();
        turned.reverse();
        assert!((lever(&turned, &turned) - SPREAD * exact).abs() < 1e-12);
        assert_eq!(lever(&polygon(&[(0.0, 0.0), (1.0, 0.0)]), &square), LINE);
        assert_eq!(lever(&polygon(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)]), &square), LINE);
    }

    #[test]
    fn a_regular_polygon_leaves_a_regular_one_and_the_deepest_corner_stays() {
        let mut corners = regular(16, 1.0, (0.0, 0.0));
        reduce(&mut corners, false);
        let angles: Vec<f64> = corners.iter().map(|c| libm::atan2(c.y, c.x)).collect();
        assert_eq!(corners.len(), 8);
        for pair in angles.windows(2) {
            let turn = (pair[1] - pair[0] + std::f64::consts::TAU) % std::f64::consts::TAU;
            assert!((turn - std::f64::consts::FRAC_PI_4).abs() < 1e-9, "{angles:?}");
        }
        let mut corners = regular(16, 1.0, (0.0, 0.0));
        corners[0].heights[1] = -1e-4;
        reduce(&mut corners, false);
        assert_eq!(corners.len(), 9);
        assert!(corners.iter().any(|corner| corner.distance() == -1e-4));
    }
}
