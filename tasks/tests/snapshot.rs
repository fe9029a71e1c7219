//! A run continues from a snapshot as it did before, bit for bit, with the same outputs.

use flate2::Compression;
use flate2::read::DeflateDecoder;
use flate2::write::DeflateEncoder;
use palmares_models::hand::Hand;
use palmares_tasks::run::{Snapshot, SnapshotError};
use palmares_tasks::{Action, BaseTarget, Noise, Run, Seed, Sensing, Task};
use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use sha2::{Digest, Sha256};
use std::io::{Read, Write};
use std::sync::Arc;

fn run(task: &str, hand: &str, seed: u64, noise: Noise) -> Run {
    let task = Task::builtin().into_iter().find(|known| known.name == task).expect("built in");
    let hand = Hand::builtin(hand).expect("built in");
    Run::new(Arc::clone(&task), hand, Seed::from_u64(seed)).expect("a scene").with_noise(noise)
}

/// Goes into the objects, closes, comes up.
fn action(tick: u64, motors: usize) -> Action {
    let height = 0.24 + 0.1 * (tick as f64 / 60.0).cos().max(0.0);
    let position = [0.02 * (tick % 7) as f64, 0.0, height];
    Action {
        base: Some(BaseTarget::Pose { position, quat_xyzw: [0.0, 1.0, 0.0, 0.0] }),
        hand: Some(vec![(tick as f64 / 40.0).sin().abs(); motors]),
        effort: None,
    }
}

/// The outputs of a run in `ticks` ticks.
fn events_of(run: &mut Run, ticks: u64) -> Vec<(String, u64, String)> {
    let motors = run.hand().motors.len();
    let wrist = run.shots(&["wrist".to_owned()], Sensing::Truth).unwrap_or_default();
    (0..ticks)
        .map(|_| {
            run.step(&action(run.tick(), motors)).expect("taken");
            let pictures: Vec<_> =
                if run.tick().is_multiple_of(20) { run.expose(&wrist) } else { Vec::new() };
            let pictures: Vec<_> = pictures.iter().map(|picture| picture.render().clone()).collect();
            (
                format!("{:?} {pictures:?}", run.observe(Sensing::Truth)),
                run.digest(),
                format!("{:?}", run.telemetry()),
            )
        })
        .collect()
}

#[test]
fn a_run_goes_on_from_a_snapshot_as_it_went_on_before() {
    for (task, hand, noise) in [
        ("balls", "softhand", Noise::Real),
        ("balls", "softhand_skin", Noise::Real),
        ("grasp", "reflex", Noise::None),
        ("shelf", "softhand", Noise::None),
    ] {
        let mut first = run(task, hand, 3, noise);
        events_of(&mut first, 60);
        let snapshot = first.snapshot();
        let here = format!("{:?}", first.observe(Sensing::Truth));
        let mut fork = first.fork();
        let bytes = snapshot.to_bytes();
        println!("{task}, {hand}: {} bytes", bytes.len());
        assert!(task != "balls" || bytes.len() <= 30_000, "{} bytes", bytes.len());
        let expected = events_of(&mut first, 60);
        assert_eq!(events_of(&mut fork, 60), expected, "{task}, {hand}: a fork");
        first.restore(&snapshot).expect("its own");
        assert_eq!(format!("{:?}", first.observe(Sensing::Truth)), here, "{task}, {hand}: observed at once");
        assert_eq!(events_of(&mut first, 60), expected, "{task}, {hand}: from memory");
        let mut other = run(task, hand, 3, noise);
        other.restore(&Snapshot::from_bytes(&bytes).expect("readable")).expect("the same scene");
        assert_eq!(events_of(&mut other, 60), expected, "{task}, {hand}: from {} bytes", bytes.len());
        let outcome = |run: &mut Run| run.finish(palmares_tasks::Reason::Stopped);
        assert_eq!(outcome(&mut other), outcome(&mut first), "{task}, {hand}: the count");
    }
}

#[test]
fn a_snapshot_of_another_run_changes_nothing() {
    let mut own = run("balls", "softhand", 1, Noise::None);
    let before = own.digest();
    for (task, hand, seed, noise, what) in [
        ("grasp", "softhand", 1, Noise::None, "task"),
        ("balls", "reflex", 1, Noise::None, "hand"),
        ("balls", "softhand", 2, Noise::None, "seed"),
        ("balls", "softhand", 1, Noise::Real, "noise"),
    ] {
        let other = run(task, hand, seed, noise).snapshot();
        assert_eq!(own.restore(&other), Err(SnapshotError::Other { what }));
        assert_eq!(own.digest(), before);
    }
}

#[test]
fn bytes_that_are_no_snapshot_are_refused() {
    let bytes = run("balls", "softhand", 1, Noise::None).snapshot().to_bytes();
    println!("{} bytes", bytes.len());
    assert!(bytes.len() <= 30_000, "{} bytes", bytes.len());
    let refused = |bytes: &[u8]| assert!(Snapshot::from_bytes(bytes).is_err(), "{} bytes", bytes.len());
    for length in [0, 1, 20, 60, bytes.len() / 2, bytes.len() - 1] {
        refused(&bytes[..length]);
    }
    for place in (0..bytes.len()).step_by(97) {
        let mut changed = bytes.clone();
        changed[place] ^= 1;
        refused(&changed);
    }
    refused(&[bytes.as_slice(), b"x"].concat());
}

/// The unpacked content of a snapshot's bytes.
fn unpacked(bytes: &[u8], head: usize) -> Vec<u8> {
    let mut whole = Vec::new();
    DeflateDecoder::new(&bytes[head..]).read_to_end(&mut whole).expect("packed");
    whole
}

/// Bytes that hold something else, under the digest of what they hold.
fn forged(head: &[u8], whole: &[u8]) -> Vec<u8> {
    let mut packer = DeflateEncoder::new(Vec::new(), Compression::fast());
    packer.write_all(whole).expect("memory takes it");
    let body = packer.finish().expect("memory takes it");
    let digest = Sha256::digest(&body);
    [head, digest.as_slice(), &body].concat()
}

/// A number from 0 to before `end`.
fn below(random: &mut ChaCha12Rng, end: usize) -> usize {
    random.next_u32() as usize % end
}

/// Up to three bytes changed, left out or put in.
fn damaged(whole: &[u8], random: &mut ChaCha12Rng) -> Vec<u8> {
    let mut changed = whole.to_vec();
    for _ in 0..1 + below(random, 3) {
        let place = below(random, changed.len());
        match below(random, 4) {
            0 => changed[place] ^= 1 << below(random, 8),
            1 => changed[place] = [0, 1, 0x7f, 0x80, 0xff][below(random, 5)],
            2 => drop(changed.remove(place)),
            _ => changed.insert(place, random.next_u32() as u8),
        }
    }
    changed
}

/// Changed bytes with a valid digest give a run in another state, or an error; nothing panics.
#[test]
fn forged_snapshots_are_refused_or_harmless() {
    const DIGEST: usize = 32;
    let mut random = ChaCha12Rng::seed_from_u64(1);
    let (mut unreadable, mut unfit, mut went_on) = (0, 0, 0);
    for (task, hand, noise) in [("balls", "softhand", Noise::Real), ("grasp", "reflex", Noise::None)] {
        let mut own = run(task, hand, 3, noise);
        events_of(&mut own, 60);
        let bytes = own.snapshot().to_bytes();
        let head = 1 + bytes.iter().position(|byte| *byte == b'\n').expect("a first line");
        let whole = unpacked(&bytes, head + DIGEST);
        for _ in 0..600 {
            let changed = damaged(&whole, &mut random);
            let Ok(snapshot) = Snapshot::from_bytes(&forged(&bytes[..head], &changed)) else {
                unreadable += 1;
                continue;
            };
            if own.restore(&snapshot).is_err() {
                unfit += 1;
                continue;
            }
            went_on += 1;
            for _ in 0..3 {
                let motors = own.hand().motors.len();
                own.step(&action(own.tick(), motors)).expect("taken");
            }
            let shots = own.shots(&["wrist".to_owned()], Sensing::Truth).unwrap_or_default();
            own.expose(&shots);
            let _ = format!("{:?} {:?}", own.observe(Sensing::Truth), own.telemetry());
            own.finish(palmares_tasks::Reason::Stopped);
        }
    }
    println!("{unreadable} unreadable, {unfit} unfit, {went_on} went on");
    assert!(unreadable > 0 && unfit > 0 && went_on > 0);
}

/// Fingers that close on each other: a box met another one up to half a millimetre late where the distance of the two was wrong, and
/// from a snapshot at another moment than without one.
#[test]
fn a_hand_that_touches_itself_continues_from_any_tick() {
    let (task, hand) = (Task::builtin().remove(0), Hand::builtin("pinch").expect("a hand of the program"));
    let action = |tick: u64| {
        let hand = if (tick / 30).is_multiple_of(2) { vec![0.4, 0.6] } else { vec![0.7, 0.2] };
        Action { base: None, hand: Some(hand), effort: None }
    };
    let mut run = Run::new(task, hand, Seed::from_u64(5)).expect("scene");
    let (mut digests, mut forks) = (Vec::new(), Vec::new());
    while run.tick() < 230 {
        if run.tick().is_multiple_of(6) {
            forks.push(run.fork());
        }
        run.step(&action(run.tick())).expect("valid");
        digests.push(run.digest());
    }
    for mut fork in forks {
        let from = fork.tick();
        while fork.tick() < 230 {
            fork.step(&action(fork.tick())).expect("valid");
            let tick = fork.tick();
            assert_eq!(fork.digest(), digests[tick as usize - 1], "tick {tick}, from tick {from}");
        }
    }
}
