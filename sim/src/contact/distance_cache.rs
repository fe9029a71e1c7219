//! Distances of near pairs: selects the pairs that a step has to check.
//!
//! Every shape has an odometer: an upper bound of the distance that any of its points has travelled; another one counts in the
//! frame of the hand's base ([`super::motion`]). A pair with a known gap is not checked before the odometers could have used up that
//! gap. Most pairs are far from that: all are compared only now and then, and between these times the few that may be due before.
//! This is a cache: no result depends on it.

use palmares_models::Pose;

/// The odometer value at which a pair is due.
#[derive(Clone, Copy, Debug)]
struct PairBound {
    /// Its odometers.
    slots: (u32, u32),
    /// Sum of both odometers that uses up the known gap of the pair.
    until: f64,
    /// Whether it is due only within the short reach of a step.
    waits: bool,
}

/// The gap of a pair that was found.
#[derive(Clone, Copy, Debug)]
struct KnownGap {
    key: (u32, u32),
    /// m
    gap: f64,
    /// Pose of B in A's frame then.
    a_from_b: Pose,
}

/// The watched pairs are those that would be due after so many more steps like the last.
const WATCHED_STEPS: f64 = 8.0;

/// Steps after which all pairs are compared at the latest, so that a fast step does not leave many watched for long.
const WATCHED_FOR: u32 = 32;

/// Odometers, and the known gaps of the near pairs.
#[derive(Clone, Debug, Default)]
pub struct DistanceCache {
    /// In the order of the near pairs.
    bounds: Vec<PairBound>,
    gaps: Vec<KnownGap>,
    /// The same before the list of pairs changed.
    old: (Vec<PairBound>, Vec<KnownGap>),
    /// Per shape and frame: distance travelled since the cache began, m.
    odometer: Vec<f64>,
    /// The same plus the distance that may count against a gap in this step: with the full reach, and with the short one.
    ahead: [Vec<f64>; 2],
    /// Largest growth of `ahead` in the last step, m.
    farthest: f64,
    /// Indices of the pairs that may be due in this step, ascending.
    watched: Vec<u32>,
    /// The others are not due before `ahead` of two shapes grows by this in all, m.
    quiet: f64,
    /// Steps since all pairs were compared.
    age: u32,
}

impl DistanceCache {
    /// Begins with this number of odometers: the state has been changed from outside.
    pub fn clear(&mut self, odometers: usize) {
        self.odometer.clear();
        self.odometer.resize(odometers, 0.0);
        for ahead in &mut self.ahead {
            ahead.clear();
            ahead.resize(odometers, 0.0);
        }
        self.forget();
    }

    /// Discards all gaps.
    pub fn forget(&mut self) {
        for bound in &mut self.bounds {
            bound.until = f64::NEG_INFINITY;
        }
        self.quiet = 0.0;
    }

    /// Adds the last step's `ways`; `reach` is the part of a gap that a shape of some speed can use up in this step, and `short` the
    /// same for pairs that wait, if there are any.
    pub fn travel(
        &mut self,
        ways: &[f64],
        speeds: &[f64],
        reach: impl Fn(f64) -> f64,
        short: Option<impl Fn(f64) -> f64>,
    ) {
        self.odometer.iter_mut().zip(ways).for_each(|(odometer, way)| *odometer += way);
        let [full, waiting] = &mut self.ahead;
        self.farthest = look_ahead(&self.odometer, speeds, full, reach);
        if let Some(short) = short {
            self.farthest = self.farthest.max(look_ahead(&self.odometer, speeds, waiting, short));
        }
        self.quiet -= 2.0 * self.farthest;
        self.age += 1;
    }

    /// Follows a new list of near pairs. `of` a pair are the distance of its odometers from its shapes, and whether it waits.
    pub fn follow(&mut self, keys: &[(u32, u32)], of: impl Fn((u32, u32)) -> (u32, bool)) {
        std::mem::swap(&mut self.bounds, &mut self.old.0);
        std::mem::swap(&mut self.gaps, &mut self.old.1);
        let mut old = self.old.0.drain(..).zip(self.old.1.drain(..)).peekable();
        self.bounds.clear();
        self.gaps.clear();
        for &key in keys {
            while old.next_if(|(_, known)| known.key < key).is_some() {}
            let (bound, known) = old.next_if(|(_, known)| known.key == key).unwrap_or_else(|| {
                let (by, waits) = of(key);
                let slots = (key.0 + by, key.1 + by);
                let bound = PairBound { slots, until: f64::NEG_INFINITY, waits };
                (bound, KnownGap { key, gap: 0.0, a_from_b: Pose::IDENTITY })
            });
            self.bounds.push(bound);
            self.gaps.push(known);
        }
        self.quiet = 0.0;
    }

    /// Number of near pairs.
    pub fn count(&self) -> usize {
        self.bounds.len()
    }

    /// Begins to look for due pairs: compares all, if one that is not watched may be due.
    #[inline]
    pub fn watch(&mut self) {
        if self.quiet <= 0.0 || self.age >= WATCHED_FOR {
            self.compare_all();
        }
    }

    fn compare_all(&mut self) {
        let soon = 2.0 * WATCHED_STEPS * self.farthest;
        let mut quiet = f64::INFINITY;
        self.watched.clear();
        for (k, bound) in self.bounds.iter().enumerate() {
            let rest = bound.until - self.sum_ahead(bound);
            if rest <= soon {
                self.watched.push(k as u32);
            } else if rest < quiet {
                quiet = rest;
            }
        }
        (self.quiet, self.age) = (quiet, 0);
    }

    #[inline]
    fn sum_ahead(&self, bound: &PairBound) -> f64 {
        let ((a, b), ahead) = (bound.slots, &self.ahead[usize::from(bound.waits)]);
        ahead[a as usize] + ahead[b as usize]
    }

    /// The next pair that may have come near; `from` is a place among the watched pairs, at first 0.
    #[inline]
    pub fn next(&self, from: &mut usize) -> Option<usize> {
        while let Some(&index) = self.watched.get(*from) {
            *from += 1;
            let bound = &self.bounds[index as usize];
            if bound.until <= self.sum_ahead(bound) {
                return Some(index as usize);
            }
        }
        None
    }

    /// The shapes of pair `index`.
    #[inline]
    pub fn key(&self, index: usize) -> (usize, usize) {
        let (a, b) = self.gaps[index].key;
        (a as usize, b as usize)
    }

    /// Whether two shapes, lower index first, are a near pair.
    pub fn has(&self, key: (u32, u32)) -> bool {
        self.gaps.binary_search_by_key(&key, |known| known.key).is_ok()
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
        for (bound, known) in self.bounds.iter_mut().zip(&self.gaps) {
            let (a, b) = known.key;
            if bound.until == f64::INFINITY && (is_awake(a as usize) || is_awake(b as usize)) {
                bound.until = f64::NEG_INFINITY;
            }
        }
        self.quiet = 0.0;
    }

    /// Remaining gap of pair `index`, m.
    pub fn slack(&self, index: usize) -> f64 {
        self.bounds[index].until - self.ways(index)
    }

    /// Stores a lower bound of the gap of pair `index`, m, which has been due in this step.
    pub fn set_bound(&mut self, index: usize, distance: f64) {
        self.bounds[index].until = distance + self.ways(index);
    }

    /// The same for a pair that has not been due.
    pub fn set_bound_early(&mut self, index: usize, distance: f64) {
        self.set_bound(index, distance);
        self.quiet = 0.0;
    }

    /// Known gap of pair `index`, m, and the pose of B in A's frame when it was found; 0 if unknown.
    pub fn gap(&self, index: usize) -> (f64, Pose) {
        let KnownGap { gap, a_from_b, .. } = self.gaps[index];
        (gap, a_from_b)
    }

    /// Stores the gap of pair `index`, m, at this pose of B in A's frame.
    pub fn set_gap(&mut self, index: usize, gap: f64, a_from_b: Pose) {
        let known = &mut self.gaps[index];
        (known.gap, known.a_from_b) = (gap, a_from_b);
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

/// Writes the odometers `ahead` by the `reach` of these speeds; the largest growth, m.
#[inline]
fn look_ahead(odometers: &[f64], speeds: &[f64], ahead: &mut [f64], reach: impl Fn(f64) -> f64) -> f64 {
    let grow = |((odometer, speed), ahead): ((&f64, &f64), &mut f64)| {
        let now = odometer + reach(*speed);
        let grown = now - *ahead;
        *ahead = now;
        grown
    };
    let larger = |most: &mut f64, x: f64| *most = if x > *most { x } else { *most };
    // Four abreast: the order of a maximum does not matter.
    let mut most = [0.0; 4];
    let (odometers, last_odometers) = odometers.as_chunks::<4>();
    let (speeds, last_speeds) = speeds.as_chunks::<4>();
    let (ahead, last_ahead) = ahead.as_chunks_mut::<4>();
    for ((odometer, speed), ahead) in odometers.iter().zip(speeds).zip(ahead) {
        for k in 0..4 {
            larger(&mut most[k], grow(((&odometer[k], &speed[k]), &mut ahead[k])));
        }
    }
    for last in last_odometers.iter().zip(last_speeds).zip(last_ahead) {
        larger(&mut most[0], grow(last));
    }
    most.into_iter().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No pair waits.
    const NONE: Option<fn(f64) -> f64> = None;

    /// Indices of the due pairs.
    fn due(cache: &mut DistanceCache) -> Vec<usize> {
        cache.watch();
        let mut from = 0;
        std::iter::from_fn(|| cache.next(&mut from)).collect()
    }

    #[test]
    fn a_pair_is_looked_at_when_its_distance_may_be_used_up() {
        let mut cache = DistanceCache::default();
        cache.clear(3);
        cache.follow(&[(0, 1), (0, 2), (1, 2)], |_| (0, false));
        let reach = [0.5, 0.0, 1.0];
        cache.travel(&[0.0; 3], &reach, |speed| speed, NONE);
        assert_eq!(due(&mut cache), [0, 1, 2]);
        cache.set_bound(0, 2.0);
        cache.set_bound(1, 2.0);
        assert_eq!(due(&mut cache), [2]);
        cache.travel(&[0.25, 0.5, 0.5], &reach, |speed| speed, NONE);
        // 0.75 of 2 m are used up, and 0.5 and 1.5 m of reach.
        assert_eq!((due(&mut cache), cache.slack(0)), (vec![1, 2], 1.25));
        // Known gaps survive a new list; new pairs are checked.
        cache.follow(&[(0, 1), (1, 1)], |_| (0, false));
        assert_eq!((due(&mut cache), cache.slack(0)), (vec![1], 1.25));
        cache.forget();
        assert_eq!(due(&mut cache), [0, 1]);
    }

    #[test]
    fn a_pair_at_rest_is_looked_at_when_one_of_it_is_roused() {
        let mut cache = DistanceCache::default();
        cache.clear(3);
        cache.follow(&[(0, 1), (1, 2)], |_| (0, false));
        cache.travel(&[0.0; 3], &[1.0; 3], |speed| speed, NONE);
        assert_eq!(due(&mut cache), [0, 1]);
        cache.deactivate(0);
        cache.deactivate(1);
        assert!(due(&mut cache).is_empty());
        cache.reactivate(|shape| shape == 2);
        assert_eq!((due(&mut cache), cache.key(1)), (vec![1], (1, 2)));
        // A new list does not wake pairs at rest.
        cache.follow(&[(0, 1), (0, 2), (1, 2)], |_| (0, false));
        assert_eq!(due(&mut cache), [1, 2]);
    }

    /// Not all pairs are watched, and yet each is found in the step in which it is due.
    #[test]
    fn no_due_pair_is_missed() {
        let shapes = 13;
        let keys: Vec<_> = (0..shapes).flat_map(|a| (a + 1..shapes).map(move |b| (a, b))).collect();
        let mut cache = DistanceCache::default();
        cache.clear(shapes as usize);
        cache.follow(&keys, |_| (0, false));
        // Speeds that change, with some bursts.
        let speed = |shape: u32, step: u32| {
            let phase = f64::from(shape * 7 + step) * 0.37;
            (phase - phase.floor()) * if step % 97 < 3 { 0.2 } else { 0.01 }
        };
        let (mut watched, mut found) = (0, 0);
        for step in 0..1000 {
            let [ways, speeds] =
                [step, step + 1].map(|step| (0..shapes).map(|shape| speed(shape, step)).collect::<Vec<_>>());
            cache.travel(&ways, &speeds, |speed| 2.0 * speed, NONE);
            let all: Vec<_> = (0..keys.len())
                .filter(|&k| cache.bounds[k].until <= cache.sum_ahead(&cache.bounds[k]))
                .collect();
            assert_eq!(due(&mut cache), all, "step {step}");
            (watched, found) = (watched + cache.watched.len(), found + all.len());
            all.iter().for_each(|&k| cache.set_bound(k, 0.1 + 0.05 * k as f64));
        }
        assert!(0 < found && watched < 1000 * keys.len(), "{found} found, {watched} watched");
    }

    #[test]
    fn a_pair_that_waits_is_due_within_the_short_reach_and_listed_within_other_ways() {
        let mut cache = DistanceCache::default();
        cache.clear(3);
        cache.follow(&[(0, 1), (0, 2), (1, 2)], |key| (0, key != (0, 2)));
        for (index, gap) in [1.0, 1.0, 0.0].into_iter().enumerate() {
            cache.set_bound(index, gap);
        }
        cache.travel(&[0.0; 3], &[0.6; 3], |speed| speed, Some(|speed| speed - 0.2));
        // A gap of 1 m: the full reach of both uses it up, the short one does not.
        assert_eq!(due(&mut cache), [1, 2]);
        assert_eq!((cache.waits(0), cache.waits(1)), (true, false));
        assert_eq!(cache.waiting(&[0.6, 0.3, 0.3]).count(), 0);
        // One that is not watched and joins is found in the next step.
        cache.set_bound(0, 1e3);
        assert_eq!(due(&mut cache), [1, 2]);
        cache.set_bound_early(0, 0.5);
        assert_eq!(due(&mut cache), [0, 1, 2]);
        cache.set_bound(0, 1.0);
        // What touches does not wait any more.
        assert_eq!(cache.waiting(&[0.6; 3]).collect::<Vec<_>>(), [(0, 1.0)]);
    }
}
