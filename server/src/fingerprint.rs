//! Fingerprints of a run's actions, to find runs that were played with the same actions, possibly with a delay.
//!
//! The fingerprint is by winnowing (Schleimer, Wilkerson, Aiken 2003): of the hashes of all windows of `GRAM` changes of the action,
//! every `WINDOW` neighbours keep their smallest as a mark. Only changes count: the duration of an action and the time of the first
//! one make no difference. Runs that are equal over `GRAM + WINDOW - 1` changes share a mark; runs that share a mark are equal over
//! `GRAM` changes, up to rounding. A copy with added noise is not found: a match is a hint, no proof.

use palmares_tasks::{Action, BaseTarget};
use std::collections::{BTreeMap, BTreeSet};

/// Changes that are hashed together.
const GRAM: usize = 16;
/// Number of neighbouring hashes of which one is kept.
const WINDOW: usize = 32;
/// A run with fewer changes is idle and has no marks: all idle runs are alike.
const MIN_CHANGES: usize = 4;
/// A common stretch of this length is reported: a second of an action that changes in every tick.
const REPORTED_CHANGES: u64 = 100;
/// A common stretch of this part of the shorter run is reported too.
const REPORTED_PART: f64 = 0.5;

/// The hash of a window of changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Mark {
    /// Hash of the changes from `place` on.
    pub(crate) hash: i64,
    /// Index of its first change in the run.
    pub(crate) place: i64,
}

/// The fingerprint of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Fingerprint {
    /// Number of changes of the action.
    pub(crate) changes: u64,
    /// Each hash once, by place.
    pub(crate) marks: Vec<Mark>,
}

impl Fingerprint {
    /// The fingerprint of the applied actions, tick by tick.
    pub(crate) fn of<'a>(actions: impl Iterator<Item = &'a Action>) -> Self {
        let mut changes: Vec<u64> = actions.map(digest).collect();
        changes.dedup();
        // The action of the first tick is no change.
        let changes = changes.get(1..).unwrap_or_default();
        let mut marks = Vec::new();
        if changes.len() >= MIN_CHANGES {
            let grams: Vec<u64> = changes.windows(GRAM.min(changes.len())).map(hash).collect();
            let mut known = BTreeSet::new();
            for (first, window) in grams.windows(WINDOW.min(grams.len())).enumerate() {
                let smallest = (0..window.len()).rev().min_by_key(|&k| window[k]).unwrap_or(0);
                if known.insert(window[smallest]) {
                    let (hash, place) = (window[smallest].cast_signed(), (first + smallest) as i64);
                    marks.push(Mark { hash, place });
                }
            }
        }
        Fingerprint { changes: changes.len() as u64, marks }
    }

    /// The longest stretch of changes that is shared with another run, from the places of the shared marks in this run and in the other.
    /// It is a lower bound: each end may be up to a window farther out. Repeated changes have a mark at their first place only, so runs
    /// count as equal between two neighbouring marks with the same lag.
    pub(crate) fn longest(&self, shared: &[(i64, i64)]) -> u64 {
        let order: BTreeMap<i64, usize> =
            self.marks.iter().enumerate().map(|(k, mark)| (mark.place, k)).collect();
        // Sorted by lag, then by place.
        let mut shared: Vec<(i64, i64)> = shared.iter().map(|(here, there)| (there - here, *here)).collect();
        shared.sort_unstable();
        let gram = (GRAM as u64).min(self.changes);
        let (mut longest, mut begin) = (0, 0);
        for k in 0..shared.len() {
            let (lag, place) = shared[k];
            let goes_on = k > 0 && {
                let (lag_before, before) = shared[k - 1];
                let next = order.get(&before).zip(order.get(&place)).is_some_and(|(a, b)| a + 1 == *b);
                lag_before == lag && next
            };
            if !goes_on {
                begin = place;
            }
            longest = longest.max((place - begin).unsigned_abs() + gram);
        }
        longest
    }
}

/// Whether a common stretch of two runs with these numbers of changes is reported to the organizer.
pub(crate) fn is_reportable(longest: u64, changes: (u64, u64)) -> bool {
    longest >= REPORTED_CHANGES
        || longest > 0 && longest as f64 >= REPORTED_PART * changes.0.min(changes.1) as f64
}

/// The hash of an action, with positions rounded to 0.1 mm, all else to a thousandth.
fn digest(action: &Action) -> u64 {
    let round = |x: f64, steps: f64| ((x * steps).round() as i64).cast_unsigned();
    let mut words = Vec::with_capacity(12);
    match &action.base {
        None => words.push(0),
        Some(BaseTarget::Pose { position, quat_xyzw }) => {
            words.push(1);
            words.extend(position.map(|x| round(x, 1e4)));
            // q and -q are one orientation.
            let rounded = quat_xyzw.map(|x| (x * 1e3).round());
            let sign = rounded.iter().rev().find(|x| **x != 0.0).map_or(1.0, |x| x.signum());
            words.extend(rounded.map(|x| round(sign * x, 1.0)));
        }
        Some(BaseTarget::Twist { linear, angular }) => {
            words.push(2);
            words.extend(linear.iter().chain(angular).map(|x| round(*x, 1e3)));
        }
        Some(BaseTarget::Joints { joints }) => {
            words.push(3);
            words.extend(joints.iter().map(|x| round(*x, 1e3)));
        }
    }
    words.extend(action.hand.iter().flatten().map(|x| round(*x, 1e3)));
    hash(&words)
}

/// FNV-1a over words with a final mix. The hashes are stored, so this must not change.
fn hash(words: &[u64]) -> u64 {
    let mut h: u64 = 0xcbf2_9ce4_8422_2325;
    for word in words {
        h = (h ^ word).wrapping_mul(0x0000_0100_0000_01b3);
        h ^= h >> 29;
    }
    h = (h ^ (h >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    h = (h ^ (h >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    h ^ (h >> 31)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// The actions of a controller that fetches one ball after another: it moves to the ball and closes, then moves to the box and
    /// opens; `speed` in m per tick. The ramps at the box are the same in every run.
    pub(crate) fn fetching(balls: &[[f64; 3]], speed: f64) -> Vec<Action> {
        let mut actions = Vec::new();
        let mut at = [0.0, 0.0, 0.75];
        let say = |at: [f64; 3], sigma: f64, actions: &mut Vec<Action>| {
            let base = BaseTarget::Pose { position: at, quat_xyzw: [0.0, 1.0, 0.0, 0.0] };
            actions.push(Action { base: Some(base), hand: Some(vec![sigma, sigma]), effort: None });
        };
        for ball in balls {
            for (to, from_sigma, to_sigma) in [(*ball, 0.0, 1.0), ([0.7, 0.0, 0.6], 1.0, 0.0)] {
                let way: f64 = (0..3).map(|k| (to[k] - at[k]) * (to[k] - at[k])).sum::<f64>().sqrt();
                let ticks = (way / speed).ceil().max(1.0);
                for tick in 1..=ticks as u32 {
                    let part = f64::from(tick) / ticks;
                    let along = [0, 1, 2].map(|k| at[k] + part * (to[k] - at[k]));
                    say(along, from_sigma, &mut actions);
                }
                at = to;
                for tick in 1..=50 {
                    let part = f64::from(tick) / 50.0;
                    say(at, from_sigma + part * (to_sigma - from_sigma), &mut actions);
                }
            }
        }
        actions
    }

    /// Balls of a scene.
    pub(crate) fn balls(seed: u32) -> Vec<[f64; 3]> {
        let mut x = seed.wrapping_mul(2_654_435_761).wrapping_add(1);
        let mut number = move || {
            x = x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(x >> 8) / f64::from(1u32 << 24) - 0.5
        };
        (0..6).map(|_| [0.4 * number(), 0.4 * number(), 0.25 + 0.1 * number()]).collect()
    }

    fn compared(a: &[Action], b: &[Action]) -> (u64, bool) {
        let (a, b) = (Fingerprint::of(a.iter()), Fingerprint::of(b.iter()));
        let places: BTreeMap<i64, i64> = b.marks.iter().map(|mark| (mark.hash, mark.place)).collect();
        let both = a.marks.iter().filter_map(|mark| Some((mark.place, *places.get(&mark.hash)?)));
        let longest = a.longest(&both.collect::<Vec<_>>());
        (longest, is_reportable(longest, (a.changes, b.changes)))
    }

    #[test]
    fn the_same_actions_are_found_whole() {
        let run = fetching(&balls(1), 0.004);
        let (longest, reported) = compared(&run, &run);
        // Not counted: the first tick, up to a window at each end, and the last movement, 50 ticks of opening at the box, which repeats.
        assert!(
            reported && longest as usize + 1 + 2 * WINDOW + 50 >= run.len(),
            "{longest} of {}",
            run.len()
        );
    }

    #[test]
    fn a_shift_and_longer_pauses_make_no_difference() {
        let run = fetching(&balls(1), 0.004);
        let mut later = vec![run[0].clone(); 37];
        later.extend(
            run.iter().enumerate().flat_map(|(k, action)| {
                std::iter::repeat_n(action.clone(), if k % 100 == 0 { 5 } else { 1 })
            }),
        );
        assert_eq!(compared(&run, &later), compared(&run, &run));
        // A part of it in a run of another kind.
        let mut part = fetching(&balls(9), 0.003);
        part.extend_from_slice(&run[500..900]);
        let (longest, reported) = compared(&part, &run);
        assert!(reported && (400 - 2 * WINDOW as u64..=400).contains(&longest), "{longest}");
    }

    #[test]
    fn the_other_quaternion_of_an_orientation_is_the_same() {
        let run = fetching(&balls(1), 0.004);
        let mut other = run.clone();
        for action in &mut other {
            if let Some(BaseTarget::Pose { quat_xyzw, .. }) = &mut action.base {
                *quat_xyzw = quat_xyzw.map(|x| -x);
            }
        }
        assert_eq!(compared(&run, &other), compared(&run, &run));
    }

    #[test]
    fn honest_runs_are_not_reported() {
        // The same program in other scenes shares only its movements at the box.
        for (a, b) in [(1, 2), (3, 4), (5, 6), (7, 8)] {
            let (longest, reported) = compared(&fetching(&balls(a), 0.004), &fetching(&balls(b), 0.004));
            assert!(!reported && longest < 60, "{longest}");
        }
        // Another program in the same scene.
        let (longest, reported) = compared(&fetching(&balls(1), 0.004), &fetching(&balls(1), 0.0037));
        assert!(!reported && longest < 60, "{longest}");
    }

    #[test]
    fn idle_runs_are_like_none() {
        let still = vec![Action { base: None, hand: Some(vec![0.0, 0.0]), effort: None }; 5000];
        let closed = vec![Action { base: None, hand: Some(vec![1.0, 1.0]), effort: None }; 5000];
        let once = [&still[..100], &closed[..]].concat();
        assert_eq!(Fingerprint::of(still.iter()), Fingerprint::default());
        assert_eq!(Fingerprint::of(once.iter()), Fingerprint { changes: 1, marks: Vec::new() });
        assert_eq!(compared(&once, &once), (0, false));
        assert_eq!(Fingerprint::of([].iter()), Fingerprint::default());
    }

    #[test]
    fn a_few_commands_are_compared_as_a_whole() {
        let commands = |n: usize, last: f64| -> Vec<Action> {
            let sigma = |k: usize| if k == n { last } else { 0.1 + 0.07 * k as f64 };
            (0..=n)
                .flat_map(|k| vec![Action { base: None, hand: Some(vec![sigma(k)]), effort: None }; 80])
                .collect()
        };
        for n in [4, 10, 15, 16, 20] {
            assert!(compared(&commands(n, 0.01), &commands(n, 0.01)).1, "{n}");
        }
        assert!(!compared(&commands(10, 0.01), &commands(10, 0.02)).1);
    }
}
