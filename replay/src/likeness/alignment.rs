//! The longest common stretch of two paths, by local alignment (Smith, Waterman 1981).

use super::path::{NUMBERS, Path, Point, dot, minus};

/// Distance at which a point of a path is no longer counted as one of the other path, mm. Noise of 3 mm leaves 1 to 4 mm after the smoothing;
/// independent grasps of one object in one scene are 2 cm apart and more.
const TOLERANCE_MM: f64 = 12.0;
/// The same before the offset between the paths is known, mm.
const FIRST_TOLERANCE_MM: f64 = 25.0;
/// Longest constant offset of the base that is taken out, mm.
const MAX_OFFSET_MM: f64 = 20.0;
/// Alignments in which the offset is found, and rounds with the pairs of each.
const ALIGNMENTS: u32 = 3;
const OFFSET_ROUNDS: u32 = 20;
/// Change of the offset along an axis after which no further alignment is worth its time, mm.
const SETTLED_MM: f64 = 0.2;
/// Loss for a point of one path that the other does not have, in points.
const GAP: f32 = 0.5;
/// Largest loss for two points that do not match, in points.
const MISMATCH: f64 = 2.0;

/// How alike two runs are, over their longest common stretch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Likeness {
    /// Part of the shorter path.
    pub share: f64,
    /// Root mean square of the distances, without the offset, mm.
    pub distance_mm: f64,
    /// How much later the second run is in the middle of the stretch, s.
    pub shift_s: f64,
    /// Constant distance of the bases, mm.
    pub offset_mm: f64,
}

/// Compares two paths; None if they have no stretch in common.
pub fn compare(one: &Path, other: &Path) -> Option<Likeness> {
    let step_mm = one.step_mm.max(other.step_mm);
    let (a, b) = (one.with_step(step_mm), other.with_step(step_mm));
    let shorter = a.len().min(b.len());
    // The nearest place of a path hides the part of the offset along it: several rounds, each with new pairs, find the whole.
    let mut offset = [0.0; 3];
    for _ in 0..ALIGNMENTS {
        let before = offset;
        let found = align(&a, &b, offset, FIRST_TOLERANCE_MM);
        for _ in 0..OFFSET_ROUNDS {
            let left: Vec<_> = found.iter().map(|(i, j)| nearest(&a[*i], &b, *j, offset)).collect();
            for (k, offset) in offset.iter_mut().enumerate() {
                *offset += left.iter().map(|left| left[k]).sum::<f64>() / (left.len().max(1) as f64);
            }
        }
        if (0..3).all(|k| (offset[k] - before[k]).abs() < SETTLED_MM) {
            break;
        }
    }
    let length = offset.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > MAX_OFFSET_MM {
        offset = offset.map(|x| x * MAX_OFFSET_MM / length);
    }
    let found = align(&a, &b, offset, TOLERANCE_MM);
    if found.is_empty() {
        return None;
    }
    let squares = found.iter().map(|(i, j)| {
        let left = nearest(&a[*i], &b, *j, offset);
        dot(&left, &left)
    });
    Some(Likeness {
        share: found.len() as f64 / shorter as f64,
        distance_mm: (squares.sum::<f64>() / found.len() as f64).sqrt(),
        shift_s: middle(found.iter().map(|(i, j)| b[*j].time_s - a[*i].time_s).collect()),
        offset_mm: length.min(MAX_OFFSET_MM),
    })
}

/// The median; 0 of nothing.
fn middle(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied().unwrap_or_default()
}

/// A piece of a path, from a point to the next.
struct Piece {
    from: [f64; NUMBERS],
    along: [f64; NUMBERS],
    square: f64,
}

impl Piece {
    fn new(path: &[Point], j: usize) -> Self {
        let along = minus(&path[(j + 1).min(path.len() - 1)].at, &path[j].at);
        Piece { from: path[j].at, along, square: dot(&along, &along) }
    }

    /// From its nearest place to a point.
    fn to(&self, point: &[f64; NUMBERS]) -> [f64; NUMBERS] {
        let behind = minus(point, &self.from);
        let part =
            if self.square > 0.0 { (dot(&self.along, &behind) / self.square).clamp(0.0, 1.0) } else { 0.0 };
        std::array::from_fn(|k| behind[k] - part * self.along[k])
    }
}

/// A point, with the offset of its base taken out.
fn moved(point: &Point, offset: [f64; 3]) -> [f64; NUMBERS] {
    let mut at = point.at;
    for (x, offset) in at.iter_mut().zip(offset) {
        *x -= offset;
    }
    at
}

/// To a point from the nearest place of a path beside its point `j`.
fn nearest(point: &Point, path: &[Point], j: usize, offset: [f64; 3]) -> [f64; NUMBERS] {
    let at = moved(point, offset);
    let (before, after) = (Piece::new(path, j.saturating_sub(1)).to(&at), Piece::new(path, j).to(&at));
    if dot(&before, &before) < dot(&after, &after) { before } else { after }
}

/// The pairs of points of the best local alignment. A point counts 1 minus its distance, in tolerances.
fn align(a: &[Point], b: &[Point], offset: [f64; 3], tolerance_mm: f64) -> Vec<(usize, usize)> {
    #[derive(Clone, Copy, PartialEq)]
    enum Step {
        Begin,
        Both,
        First,
        Second,
    }
    let pieces: Vec<Piece> = (0..b.len()).map(|j| Piece::new(b, j)).collect();
    let width = b.len() + 1;
    let mut steps = vec![Step::Begin; (a.len() + 1) * width];
    let (mut before, mut now) = (vec![0.0_f32; width], vec![0.0_f32; width]);
    let (mut best, mut end) = (0.0, (0, 0));
    for (i, point) in a.iter().enumerate() {
        let at = moved(point, offset);
        for (j, piece) in pieces.iter().enumerate() {
            let left = piece.to(&at);
            let gain = (1.0 - dot(&left, &left).sqrt() / tolerance_mm).max(-MISMATCH) as f32;
            let ways = [
                (before[j] + gain, Step::Both),
                (before[j + 1] - GAP, Step::First),
                (now[j] - GAP, Step::Second),
            ];
            let (mut sum, mut step) = (0.0, Step::Begin);
            for way in ways {
                if way.0 > sum {
                    (sum, step) = way;
                }
            }
            now[j + 1] = sum;
            steps[(i + 1) * width + j + 1] = step;
            if sum > best {
                (best, end) = (sum, (i + 1, j + 1));
            }
        }
        std::mem::swap(&mut before, &mut now);
    }
    let mut pairs = Vec::new();
    let (mut i, mut j) = end;
    loop {
        match steps[i * width + j] {
            Step::Begin => break,
            Step::Both => {
                (i, j) = (i - 1, j - 1);
                pairs.push((i, j));
            }
            Step::First => i -= 1,
            Step::Second => j -= 1,
        }
    }
    pairs
}
