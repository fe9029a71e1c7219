//! Likeness of made-up runs: copies in disguise, and runs of their own.

use super::path::{Path, Recorder};
use super::{Likeness, compare};
use palmares_tasks::{Action, BaseTarget};

/// The share from which the server lists a pair.
const LISTED_SHARE: f64 = 0.55;
/// The palm looks down.
const DOWN: [f64; 4] = [0.0, 1.0, 0.0, 0.0];

/// The actions of a controller that fetches one ball after another: it moves to the ball and closes, then moves to the box and
/// opens; `speed` in m per tick. The ramps at the box are the same in every run.
fn fetching(balls: &[[f64; 3]], speed: f64) -> Vec<Action> {
    let mut actions = Vec::new();
    let mut at = [0.0, 0.0, 0.75];
    let say = |at: [f64; 3], sigma: f64, actions: &mut Vec<Action>| {
        let base = BaseTarget::Pose { position: at, quat_xyzw: DOWN };
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
fn balls(seed: u32) -> Vec<[f64; 3]> {
    let mut x = seed.wrapping_mul(2_654_435_761).wrapping_add(1);
    let mut number = move || {
        x = x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(x >> 8) / f64::from(1u32 << 24) - 0.5
    };
    (0..6).map(|_| [0.4 * number(), 0.4 * number(), 0.25 + 0.1 * number()]).collect()
}

/// Numbers in −1 to 1.
fn numbers(seed: u32) -> impl FnMut() -> f64 {
    let mut x = seed;
    move || {
        x = x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(x >> 8) / f64::from(1u32 << 23) - 1.0
    }
}

/// The path of a hand that is where its actions say.
fn path(actions: &[Action]) -> Path {
    let mut recorder = Recorder::new(0.01);
    for action in actions {
        let Some(BaseTarget::Pose { position, quat_xyzw }) = &action.base else { panic!("{action:?}") };
        let hand = action.hand.as_deref().unwrap_or_default();
        recorder.add(*position, *quat_xyzw, hand.iter().sum::<f64>() / (hand.len() as f64));
    }
    recorder.finish()
}

/// The actions with other positions (m) and other σ.
fn changed(actions: &[Action], mut change: impl FnMut(&mut [f64; 3], &mut [f64])) -> Vec<Action> {
    let mut actions = actions.to_vec();
    for action in &mut actions {
        if let (Some(BaseTarget::Pose { position, .. }), Some(hand)) = (&mut action.base, &mut action.hand) {
            change(position, hand);
        }
    }
    actions
}

fn noisy(actions: &[Action], noise_mm: f64) -> Vec<Action> {
    let mut number = numbers(1);
    changed(actions, |position, hand| {
        for x in position {
            *x += 1e-3 * noise_mm * number();
        }
        for sigma in hand {
            *sigma += 1e-2 * noise_mm * number();
        }
    })
}

/// Every n-th action, n times.
fn every(actions: &[Action], n: usize) -> Vec<Action> {
    actions.chunks(n).flat_map(|chunk| vec![chunk[0].clone(); n]).collect()
}

fn late(actions: &[Action], ticks: usize) -> Vec<Action> {
    [vec![actions[0].clone(); ticks], actions.to_vec()].concat()
}

fn aside(actions: &[Action], mm: f64) -> Vec<Action> {
    changed(actions, |position, _| {
        for (x, part) in position.iter_mut().zip([0.6, -0.64, 0.48]) {
            *x += 1e-3 * mm * part;
        }
    })
}

#[test]
fn the_same_run_is_wholly_alike() {
    let run = path(&fetching(&balls(1), 0.004));
    let same = Likeness { share: 1.0, distance_mm: 0.0, shift_s: 0.0, offset_mm: 0.0 };
    assert_eq!(compare(&run, &run), Some(same));
}

#[test]
fn a_copy_is_found_in_any_disguise() {
    let run = fetching(&balls(1)[..2], 0.004);
    let slower: Vec<Action> = run.iter().flat_map(|action| vec![action.clone(); 2]).collect();
    let pausing: Vec<Action> = run
        .iter()
        .enumerate()
        .flat_map(|(k, action)| vec![action.clone(); if k % 100 == 0 { 80 } else { 1 }])
        .collect();
    let turned = changed(&run, |_, _| ());
    let mut copies = vec![("slower", slower, 3.0), ("pausing", pausing, 3.0), ("turned", turned, 0.1)];
    copies.extend(
        [(0.1, 1.0), (0.3, 1.0), (1.0, 1.0), (3.0, 3.0)]
            .map(|(mm, at_most)| ("noise", noisy(&run, mm), at_most)),
    );
    copies.extend([2, 5].map(|n| ("every", every(&run, n), 1.0)));
    copies.extend([1, 10, 50].map(|ticks| ("late", late(&run, ticks), 1.0)));
    copies.extend([1.0, 3.0, 10.0].map(|mm| ("aside", aside(&run, mm), 1.0)));
    let all = every(&noisy(&late(&aside(&run, 3.0), 10), 1.0), 2);
    copies.push(("all", all, 2.0));
    let run = path(&run);
    for (name, copy, at_most) in copies {
        let found = compare(&run, &path(&copy)).expect(name);
        assert!(found.share > 0.95 && found.distance_mm <= at_most, "{name}: {found:?}");
        let back = compare(&path(&copy), &run).expect(name);
        assert!(back.share > 0.95 && back.distance_mm <= at_most, "{name}, the other way round: {back:?}");
    }
}

#[test]
fn delay_and_offset_of_a_copy_are_reported() {
    let run = fetching(&balls(1), 0.004);
    let found = compare(&path(&run), &path(&late(&aside(&run, 7.0), 50))).expect("alike");
    assert!((found.shift_s - 0.5).abs() < 0.1 && (found.offset_mm - 7.0).abs() < 0.5, "{found:?}");
}

#[test]
fn a_part_of_another_run_counts_with_its_length() {
    let run = fetching(&balls(1), 0.004);
    let own = fetching(&balls(9), 0.003);
    let part = [&own[..own.len() / 3], &run[run.len() / 4..]].concat();
    let found = compare(&path(&run), &path(&part)).expect("alike");
    assert!((0.6..0.85).contains(&found.share) && found.distance_mm < 1.0, "{found:?}");
}

#[test]
fn runs_of_their_own_are_not_listed() {
    let scene = balls(1);
    let reversed: Vec<[f64; 3]> = scene.iter().rev().copied().collect();
    let higher: Vec<[f64; 3]> = scene.iter().map(|[x, y, z]| [*x, *y, z + 0.06]).collect();
    let wider: Vec<[f64; 3]> = scene.iter().map(|[x, y, z]| [x + 0.05, y - 0.05, *z]).collect();
    let run = path(&fetching(&scene, 0.004));
    for (name, other) in [
        ("another order", reversed),
        ("from above", higher),
        ("from the side", wider),
        ("another scene", balls(2)),
    ] {
        let share = compare(&run, &path(&fetching(&other, 0.004))).map_or(0.0, |found| found.share);
        assert!(share < LISTED_SHARE, "{name}: {share}");
    }
}

#[test]
fn a_run_that_hardly_moves_is_not_compared() {
    let idle = Action {
        base: Some(BaseTarget::Pose { position: [0.0; 3], quat_xyzw: DOWN }),
        hand: Some(vec![0.0]),
        effort: None,
    };
    let still = path(&vec![idle; 5000]);
    assert!(!still.is_comparable() && !Path::default().is_comparable());
    // Noise alone makes no path.
    let noise = noisy(&late(&fetching(&balls(1), 0.004)[..1], 3000), 3.0);
    assert!(!path(&noise).is_comparable());
    assert!(path(&fetching(&balls(1)[..1], 0.004)).is_comparable());
    assert_eq!(compare(&Path::default(), &still), None);
}

#[test]
fn a_path_is_the_same_after_it_was_stored() {
    for balls in [&balls(1)[..1], &[balls(1), balls(2), balls(3), balls(4), balls(5), balls(6)].concat()[..]]
    {
        let run = path(&fetching(balls, 0.004));
        let text = run.to_text();
        assert!(text.len() <= 61_000, "{}", text.len());
        assert_eq!(Path::of_text(&text).as_ref(), Some(&run));
    }
    for broken in ["", "AAAA", "no base64!", "AACAPwAA"] {
        assert_eq!(Path::of_text(broken), None, "{broken}");
    }
}
