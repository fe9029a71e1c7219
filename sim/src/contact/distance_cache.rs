//! Distances of near pairs: which of them have to be looked at in a step.
//!
//! Every shape has an odometer: an upper bound of the way that any of its points has made. A pair that is known to be
//! some distance apart is not looked at before the odometers could have used that distance up, so that most pairs
//! cost one comparison. A cache: no result depends on it.

use palmares_models::Pose;

/// A pair and when to look at it.
#[derive(Clone, Copy, Debug)]
struct Watch {
    key: (u32, u32),
    /// The sum of both odometers that uses up what is known of the pair's distance.
    until: f64,
}

/// Odometers, and what is known of the distances of the near pairs.
#[derive(Clone, Debug, Default)]
pub struct DistanceCache {
    /// In the order of the near pairs.
    watches: Vec<Watch>,
    /// The same before the list of pairs changed.
    old: Vec<Watch>,
    /// Of every pair: the distance that its shapes were found to have, m, and where B then stood in A's frame.
    gaps: Vec<(f64, Pose)>,
    /// The same before the list of pairs changed.
    old_gaps: Vec<(f64, Pose)>,
    /// Of every shape: the way so far, m.
    odometer: Vec<f64>,
    /// ... and with it what may count against a distance in this step.
    ahead: Vec<f64>,
}

impl DistanceCache {
    /// Forgets all distances: the state has been changed from outside.
    pub fn forget(&mut self, shapes: usize) {
        self.odometer.clear();
        self.odometer.resize(shapes, 0.0);
        for watch in &mut self.watches {
            watch.until = f64::NEG_INFINITY;
        }
    }

    /// Counts the last step's `paths`; `reach` of a shape is how much of a pair's distance it can use up in this step.
    pub fn travel(&mut self, paths: &[f64], reach: impl Iterator<Item = f64>) {
        for (odometer, path) in self.odometer.iter_mut().zip(paths) {
            *odometer += path;
        }
        self.ahead.clear();
        self.ahead.extend(self.odometer.iter().zip(reach).map(|(odometer, reach)| odometer + reach));
    }

    /// Follows a new list of near pairs.
    pub fn follow(&mut self, keys: &[(u32, u32)]) {
        std::mem::swap(&mut self.watches, &mut self.old);
        std::mem::swap(&mut self.gaps, &mut self.old_gaps);
        let mut old = self.old.drain(..).zip(self.old_gaps.drain(..)).peekable();
        self.watches.clear();
        self.gaps.clear();
        for &key in keys {
            while old.next_if(|(watch, _)| watch.key < key).is_some() {}
            let unknown = (Watch { key, until: f64::NEG_INFINITY }, (0.0, Pose::IDENTITY));
            let (watch, gap) = old.next_if(|(watch, _)| watch.key == key).unwrap_or(unknown);
            self.watches.push(watch);
            self.gaps.push(gap);
        }
    }

    /// Number of near pairs.
    pub fn count(&self) -> usize {
        self.watches.len()
    }

    /// The next pair from `from` on that may have come near.
    #[inline]
    pub fn next(&self, from: usize) -> Option<usize> {
        let due = |watch: &Watch| {
            let (a, b) = watch.key;
            watch.until <= self.ahead[a as usize] + self.ahead[b as usize]
        };
        self.watches.get(from..)?.iter().position(due).map(|k| from + k)
    }

    /// The shapes of pair `index`.
    #[inline]
    pub fn key(&self, index: usize) -> (usize, usize) {
        let (a, b) = self.watches[index].key;
        (a as usize, b as usize)
    }

    /// Whether two shapes, the lower place first, are a near pair.
    pub fn has(&self, key: (u32, u32)) -> bool {
        self.watches.binary_search_by_key(&key, |watch| watch.key).is_ok()
    }

    /// Neither shape of pair `index` moves: it is not looked at until one of them is roused.
    pub fn rest(&mut self, index: usize) {
        self.watches[index].until = f64::INFINITY;
    }

    /// Looks at the pairs at rest again in which a shape `is_awake`.
    pub fn rouse(&mut self, is_awake: impl Fn(usize) -> bool) {
        for Watch { key: (a, b), until } in &mut self.watches {
            if *until == f64::INFINITY && (is_awake(*a as usize) || is_awake(*b as usize)) {
                *until = f64::NEG_INFINITY;
            }
        }
    }

    /// What is left of the distance of pair `index`, m.
    pub fn slack(&self, index: usize) -> f64 {
        self.watches[index].until - self.ways(index)
    }

    /// The shapes of pair `index` are this far apart, m.
    pub fn learn(&mut self, index: usize, distance: f64) {
        self.watches[index].until = distance + self.ways(index);
    }

    /// What is known of the distance of pair `index`, m, and where B then stood in A's frame; 0 if nothing is.
    pub fn gap(&self, index: usize) -> (f64, Pose) {
        self.gaps[index]
    }

    /// The shapes of pair `index` have this distance, m, where B stands there in A's frame.
    pub fn remember(&mut self, index: usize, gap: f64, a_from_b: Pose) {
        self.gaps[index] = (gap, a_from_b);
    }

    fn ways(&self, index: usize) -> f64 {
        let (a, b) = self.watches[index].key;
        self.odometer[a as usize] + self.odometer[b as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pair_is_looked_at_when_its_distance_may_be_used_up() {
        let mut cache = DistanceCache::default();
        cache.forget(3);
        cache.follow(&[(0, 1), (0, 2), (1, 2)]);
        let reach = [0.5, 0.0, 1.0];
        cache.travel(&[0.0; 3], reach.into_iter());
        assert_eq!((cache.next(0), cache.next(1), cache.next(3)), (Some(0), Some(1), None));
        cache.learn(0, 2.0);
        cache.learn(1, 2.0);
        assert_eq!((cache.next(0), cache.next(3)), (Some(2), None));
        cache.travel(&[0.25, 0.5, 0.5], reach.into_iter());
        // 0.75 of 2 m are used up, and 0.5 and 1.5 m of reach.
        assert_eq!((cache.next(0), cache.slack(0)), (Some(1), 1.25));
        // What is known survives a new list; what is new is looked at.
        cache.follow(&[(0, 1), (0, 3)]);
        assert_eq!(cache.slack(0), 1.25);
        cache.forget(3);
        assert_eq!(cache.slack(0), f64::NEG_INFINITY);
    }

    #[test]
    fn a_pair_at_rest_is_looked_at_when_one_of_it_is_roused() {
        let mut cache = DistanceCache::default();
        cache.forget(3);
        cache.follow(&[(0, 1), (1, 2)]);
        cache.travel(&[], [1.0; 3].into_iter());
        cache.rest(0);
        cache.rest(1);
        assert_eq!(cache.next(0), None);
        cache.rouse(|shape| shape == 2);
        assert_eq!((cache.next(0), cache.key(1)), (Some(1), (1, 2)));
        // A new list does not wake what is at rest.
        cache.follow(&[(0, 1), (0, 2), (1, 2)]);
        assert_eq!((cache.next(0), cache.next(2)), (Some(1), Some(2)));
    }
}
