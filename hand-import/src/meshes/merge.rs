//! Links with more shapes than a hand may have: near shapes become the convex hull of their group.

use palmares_models::Vec3;

/// Largest number of groups that are compared with each other.
const MOST_COMPARED: usize = 1000;

/// A box along the axes of a link.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    low: Vec3,
    high: Vec3,
}

impl Bounds {
    fn of(points: &[Vec3]) -> Bounds {
        let none = Bounds { low: Vec3::splat(f64::INFINITY), high: Vec3::splat(f64::NEG_INFINITY) };
        points.iter().fold(none, |b, p| Bounds { low: b.low.min(*p), high: b.high.max(*p) })
    }

    fn with(&self, other: &Bounds) -> Bounds {
        Bounds { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    fn volume(&self) -> f64 {
        let size = self.high - self.low;
        size.x * size.y * size.z
    }

    /// Volume that a box around both adds to both.
    fn cost(&self, other: &Bounds) -> f64 {
        self.with(other).volume() - self.volume() - other.volume()
    }
}

/// Groups of shapes, given by their points, of which there are at most `most`: again and again the two groups unite whose boxes
/// fit best. Groups are in the order of their first shapes.
pub(super) fn groups(shapes: &[Vec<Vec3>], most: usize) -> Vec<Vec<usize>> {
    // Neighbours in the file are together from the start if there are too many to compare.
    let together = shapes.len().div_ceil(MOST_COMPARED).max(1);
    let start = |(number, chunk): (usize, &[Vec<Vec3>])| {
        let first = number * together;
        Some((Bounds::of(&chunk.concat()), (first..first + chunk.len()).collect()))
    };
    let mut groups: Vec<Option<(Bounds, Vec<usize>)>> =
        shapes.chunks(together).enumerate().map(start).collect();
    let best = |groups: &[Option<(Bounds, Vec<usize>)>], a: usize| {
        let (own, _) = groups[a].as_ref()?;
        let others = groups.iter().enumerate().filter(|(b, _)| *b != a);
        let costs = others.filter_map(|(b, other)| Some((b, own.cost(&other.as_ref()?.0))));
        costs.min_by(|x, y| x.1.total_cmp(&y.1))
    };
    let mut partners: Vec<Option<(usize, f64)>> = (0..groups.len()).map(|a| best(&groups, a)).collect();
    let mut left = groups.len();
    while left > most.max(1) {
        let open = partners.iter().enumerate().filter_map(|(a, partner)| Some((a, (*partner)?)));
        let Some((a, (b, _))) = open.min_by(|x, y| x.1.1.total_cmp(&y.1.1)) else { break };
        let (Some((first, mut all)), Some((second, more))) = (groups[a].take(), groups[b].take()) else {
            break;
        };
        all.extend(more);
        groups[a] = Some((first.with(&second), all));
        partners[b] = None;
        left -= 1;
        for k in 0..groups.len() {
            if k == a || partners[k].is_some_and(|(partner, _)| partner == a || partner == b) {
                partners[k] = best(&groups, k);
            } else if let (Some((own, _)), Some((merged, _)), Some((_, cost))) =
                (&groups[k], &groups[a], partners[k])
                && own.cost(merged) < cost
            {
                partners[k] = Some((a, own.cost(merged)));
            }
        }
    }
    let mut groups: Vec<Vec<usize>> = groups.into_iter().flatten().map(|(_, all)| all).collect();
    groups.iter_mut().for_each(|group| group.sort_unstable());
    groups.sort_by_key(|group| group[0]);
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_shapes_unite_and_far_ones_stay() {
        // Three rows of boxes, 0.1 m from each other; the gaps in a row are 1 mm.
        let cube = |x: f64, y: f64| [0.0, 0.01].map(|d| Vec3::new(x + d, y + d, d)).to_vec();
        let shapes: Vec<Vec<Vec3>> =
            (0..12).map(|k| cube(0.011 * f64::from(k / 3), 0.1 * f64::from(k % 3))).collect();
        let rows = vec![vec![0, 3, 6, 9], vec![1, 4, 7, 10], vec![2, 5, 8, 11]];
        assert_eq!(groups(&shapes, 3), rows);
        assert_eq!(groups(&shapes, 12).len(), 12);
        assert_eq!(groups(&shapes, 1), [(0..12).collect::<Vec<_>>()]);
        assert!(groups(&[], 3).is_empty());
    }
}
