//! Distances of near pairs: selects the pairs that a step has to check.
//!
//! Every shape has an odometer: an upper bound of the distance that any of its points has travelled; another one counts in the
//! frame of the hand's base ([`super::motion`]). A pair with a known gap is not checked before the odometers could have used up that gap, so that most pairs cost
//! one comparison. This is a cache: no result depends on it.

use palmares_models::Pose;

/// A pair and the odometer value at which it is due.
#[derive(Clone, Copy, Debug)]
struct PairBound {
    key: (u32, u32),
    /// Their odometers.
    slots: (u32, u32),
    /// Sum of both odometers that uses up the known gap of the pair.
    until: f64,
    /// Whether it is due only within the short reach of a step.
    waits: bool,
}

/// Odometers, and the known gaps of the near pairs.
#[derive(Clone, Debug, Default)]
pub struct DistanceCache {
    /// In the order of the near pairs.
    bounds: Vec<PairBound>,
    /// The same before the list of pairs changed.
    old: Vec<PairBound>,
    /// Per pair: the gap that was found, m, and the pose of B in A's frame then.
    gaps: Vec<(f64, Pose)>,
    /// The same before the list of pairs changed.
    old_gaps: Vec<(f64, Pose)>,
    /// Per shape and frame: distance travelled since the cache began, m.
    odometer: Vec<f64>,
    /// The same plus the distance that may count against a gap in this step: with the full reach, and with the short one.
    ahead: [Vec<f64>; 2],
}

impl DistanceCache {
    /// Discards all gaps: the state has been changed from outside.
    pub fn clear(&mut self, odometers: usize) {
        self.odometer.clear();
        self.odometer.resize(odometers, 0.0);
        for bound in &mut self.bounds {
            bound.until = f64::NEG_INFINITY;
        }
    }

    /// Adds the last step's `paths`.
    pub fn travel(&mut self, paths: &[f64]) {
        for (odometer, path) in self.odometer.iter_mut().zip(paths) {
            *odometer += path;
        }
    }

    /// Sets the part of a gap that each shape can use up in this step, m: with the full reach, or for pairs that `wait` with the
    /// short one.
    pub fn set_reach(&mut self, wait: bool, reach: impl Iterator<Item = f64>) {
        let ahead = &mut self.ahead[usize::from(wait)];
        ahead.clear();
        ahead.extend(self.odometer.iter().zip(reach).map(|(odometer, reach)| odometer + reach));
    }

    /// Follows a new list of near pairs. `of` a pair are the distance of its odometers from its shapes, and whether it waits.
    pub fn follow(&mut self, keys: &[(u32, u32)], of: impl Fn((u32, u32)) -> (u32, bool)) {
        std::mem::swap(&mut self.bounds, &mut self.old);
        std::mem::swap(&mut self.gaps, &mut self.old_gaps);
        let mut old = self.old.drain(..).zip(self.old_gaps.drain(..)).peekable();
        self.bounds.clear();
        self.gaps.clear();
        for &key in keys {
            while old.next_if(|(bound, _)| bound.key < key).is_some() {}
            let (bound, gap) = old.next_if(|(bound, _)| bound.key == key).unwrap_or_else(|| {
                let (by, waits) = of(key);
                let slots = (key.0 + by, key.1 + by);
                (PairBound { key, slots, until: f64::NEG_INFINITY, waits }, (0.0, Pose::IDENTITY))
            });
            self.bounds.push(bound);
            self.gaps.push(gap);
        }
    }

    /// Number of near pairs.
    pub fn count(&self) -> usize {
        self.bounds.len()
    }

    /// The next pair from `from` on that may have come near.
    #[inline]
    pub fn next(&self, from: usize) -> Option<usize> {
        let due = |bound: &PairBound| {
            let ((a, b), ahead) = (bound.slots, &self.ahead[usize::from(bound.waits)]);
            bound.until <= ahead[a as usize] + ahead[b as usize]
        };
        self.bounds.get(from..)?.iter().position(due).map(|k| from + k)
    }

    /// The shapes of pair `index`.
    #[inline]
    pub fn key(&self, index: usize) -> (usize, usize) {
        let (a, b) = self.bounds[index].key;
        (a as usize, b as usize)
    }

    /// Whether two shapes, lower index first, are a near pair.
    pub fn has(&self, key: (u32, u32)) -> bool {
        self.bounds.binary_search_by_key(&key, |bound| bound.key).is_ok()
    }

    /// Whether pair `index` is due only within the short reach.
    #[inline]
    pub fn waits(&self, index: usize) -> bool {
        self.bounds[index].waits
    }

    /// The pairs that wait and are apart, and whose known gap these ways of the odometers can use up; with the gap, m.
    pub fn waiting(&self, ways: &[f64]) -> impl Iterator<Item = (usize, f64)> {
        self.bounds.iter().enumerate().filter_map(|(index, bound)| {
            let (a, b) = (bound.slots.0 as usize, bound.slots.1 as usize);
            let gap = bound.until - (self.odometer[a] + self.odometer[b]);
            (bound.waits && gap > 0.0 && gap <= ways[a] + ways[b]).then_some((index, gap))
        })
    }

    /// Neither shape of pair `index` moves: the pair is not checked until one of them is reactivated.
    pub fn deactivate(&mut self, index: usize) {
        self.bounds[index].until = f64::INFINITY;
    }

    /// Makes the pairs at rest due again in which a shape `is_awake`.
    pub fn reactivate(&mut self, is_awake: impl Fn(usize) -> bool) {
        for PairBound { key: (a, b), until, .. } in &mut self.bounds {
            if *until == f64::INFINITY && (is_awake(*a as usize) || is_awake(*b as usize)) {
                *until = f64::NEG_INFINITY;
            }
        }
    }

    /// Remaining gap of pair `index`, m.
    pub fn slack(&self, index: usize) -> f64 {
        self.bounds[index].until - self.ways(index)
    }

    /// Stores a lower bound of the gap of pair `index`, m.
    pub fn set_bound(&mut self, index: usize, distance: f64) {
        self.bounds[index].until = distance + self.ways(index);
    }

    /// Known gap of pair `index`, m, and the pose of B in A's frame when it was found; 0 if unknown.
    pub fn gap(&self, index: usize) -> (f64, Pose) {
        self.gaps[index]
    }

    /// Stores the gap of pair `index`, m, at this pose of B in A's frame.
    pub fn set_gap(&mut self, index: usize, gap: f64, a_from_b: Pose) {
        self.gaps[index] = (gap, a_from_b);
    }

    /// The odometers of pair `index`.
    #[inline]
    pub fn slots(&self, index: usize) -> (usize, usize) {
        let (a, b) = self.bounds[index].slots;
        (a as usize, b as usize)
    }

    fn ways(&self, index: usize) -> f64 {
        let (a, b) = self.bounds[index].slots;
        self.odometer[a as usize] + self.odometer[b as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pair_is_looked_at_when_its_distance_may_be_used_up() {
        let mut cache = DistanceCache::default();
        cache.clear(3);
        cache.follow(&[(0, 1), (0, 2), (1, 2)], |_| (0, false));
        let reach = [0.5, 0.0, 1.0];
        cache.set_reach(false, reach.into_iter());
        assert_eq!((cache.next(0), cache.next(1), cache.next(3)), (Some(0), Some(1), None));
        cache.set_bound(0, 2.0);
        cache.set_bound(1, 2.0);
        assert_eq!((cache.next(0), cache.next(3)), (Some(2), None));
        cache.travel(&[0.25, 0.5, 0.5]);
        cache.set_reach(false, reach.into_iter());
        // 0.75 of 2 m are used up, and 0.5 and 1.5 m of reach.
        assert_eq!((cache.next(0), cache.slack(0)), (Some(1), 1.25));
        // Known gaps survive a new list; new pairs are checked.
        cache.follow(&[(0, 1), (0, 3)], |_| (0, false));
        assert_eq!(cache.slack(0), 1.25);
        cache.clear(3);
        assert_eq!(cache.slack(0), f64::NEG_INFINITY);
    }

    #[test]
    fn a_pair_at_rest_is_looked_at_when_one_of_it_is_roused() {
        let mut cache = DistanceCache::default();
        cache.clear(3);
        cache.follow(&[(0, 1), (1, 2)], |_| (0, false));
        cache.set_reach(false, [1.0; 3].into_iter());
        cache.deactivate(0);
        cache.deactivate(1);
        assert_eq!(cache.next(0), None);
        cache.reactivate(|shape| shape == 2);
        assert_eq!((cache.next(0), cache.key(1)), (Some(1), (1, 2)));
        // A new list does not wake pairs at rest.
        cache.follow(&[(0, 1), (0, 2), (1, 2)], |_| (0, false));
        assert_eq!((cache.next(0), cache.next(2)), (Some(1), Some(2)));
    }

    #[test]
    fn a_pair_that_waits_is_due_within_the_short_reach_and_listed_within_other_ways() {
        let mut cache = DistanceCache::default();
        cache.clear(3);
        cache.follow(&[(0, 1), (0, 2), (1, 2)], |key| (0, key != (0, 2)));
        for (index, gap) in [1.0, 1.0, 0.0].into_iter().enumerate() {
            cache.set_bound(index, gap);
        }
        cache.set_reach(false, [0.6; 3].into_iter());
        cache.set_reach(true, [0.4; 3].into_iter());
        // A gap of 1 m: the full reach of both uses it up, the short one does not.
        assert_eq!((cache.next(0), cache.next(2)), (Some(1), Some(2)));
        assert_eq!((cache.waits(0), cache.waits(1)), (true, false));
        assert_eq!(cache.waiting(&[0.6, 0.3, 0.3]).count(), 0);
        // What touches does not wait any more.
        assert_eq!(cache.waiting(&[0.6; 3]).collect::<Vec<_>>(), [(0, 1.0)]);
    }
}
