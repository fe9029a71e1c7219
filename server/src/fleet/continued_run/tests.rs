//! Runs that are built again from what a host has stored of them.

use super::*;
use crate::archive::{Archive, Keys};
use crate::fleet::shipped_tick::encode;
use palmares_protocol::Mode;
use palmares_replay::verify;
use palmares_tasks::{Action, BaseTarget, Noise, Reason, Seed};
use palmares_worlds::compute::admission::Admission;
use palmares_worlds::compute::open_worlds::WorldRequest;
use palmares_worlds::compute::scheduler::{Scheduler, Urgency};
use std::time::Instant;
use tempfile::TempDir;

/// A run as a host has stored it.
struct Stored {
    continued: ContinuedRun,
    states: Vec<StateHash>,
}

fn action(tick: u64, motors: usize) -> Action {
    let t = 0.01 * tick as f64;
    let position = [0.1 * t.sin(), 0.0, (0.8 - 0.3 * t).max(0.2)];
    let base = BaseTarget::Pose { position, quat_xyzw: [0.0, 1.0, 0.0, 0.1] };
    Action { base: Some(base), hand: Some(vec![(0.3 * t).min(1.0); motors]), effort: None }
}

/// A run of this many ticks, with the snapshot of one of them.
fn stored(ticks: u64, snapshot_at: Option<u64>) -> Stored {
    let (task, hand) = (Task::builtin().remove(0), Hand::builtin("pinch").expect("a hand of the program"));
    let seed = Seed::from_u64(5);
    let header =
        Header { noise: Noise::Real, ..Header::new("run_1", "crabs", &task, &hand, seed, 1_700_000_000_000) };
    let mut run = Run::new(task.clone(), hand.clone(), seed).expect("scene").with_noise(header.noise);
    let (mut rows, mut states, mut group, mut snapshot) = (Vec::new(), Vec::new(), Vec::new(), None);
    while run.tick() < ticks {
        run.step(&action(run.tick(), hand.motors.len())).expect("valid");
        let (action, events) = (run.applied().clone(), run.events().to_vec());
        states.push(StateHash::of(&run));
        group.push(ShippedTick { action, state: StateHash::of(&run), events });
        if group.len() == 11 || run.tick() == ticks {
            let from_tick = run.tick() as i64 - group.len() as i64;
            rows.push(StoredTicks { from_tick, ticks: group.len() as i64, body: encode(&group) });
            group.clear();
        }
        if Some(run.tick()) == snapshot_at {
            snapshot = Some(run.snapshot().to_bytes());
        }
    }
    let continued = ContinuedRun { header, task, hand, shipped: ShippedRun { ticks: rows, snapshot } };
    Stored { continued, states }
}

/// A snapshot of another tick than it says, as a damaged cache would be: of another run.
fn snapshot_of_another_seed() -> Vec<u8> {
    let (task, hand) = (Task::builtin().remove(0), Hand::builtin("pinch").expect("a hand of the program"));
    let mut run = Run::new(task, hand, Seed::from_u64(6)).expect("scene").with_noise(Noise::Real);
    run.step(&Action::default()).expect("valid");
    run.snapshot().to_bytes()
}

#[test]
fn a_run_is_built_again_at_its_last_stored_tick_with_any_snapshot_or_none() {
    let last = |stored: Stored| {
        let run = stored.continued.build(None).expect("the same run");
        assert_eq!((run.tick(), Some(StateHash::of(&run))), (60, stored.states.last().copied()));
    };
    for at in [None, Some(1), Some(59), Some(60)] {
        last(stored(60, at));
    }
    for bytes in [b"".to_vec(), b"rubbish".to_vec(), snapshot_of_another_seed()] {
        let mut damaged = stored(60, None);
        damaged.continued.shipped.snapshot = Some(bytes);
        last(damaged);
    }
    // A snapshot of a tick that is not stored: the client has not seen more than 25 of those.
    let mut ahead = stored(80, Some(75));
    ahead.continued.shipped.ticks.truncate(5);
    let run = ahead.continued.build(None).expect("the same run");
    assert_eq!((run.tick(), StateHash::of(&run)), (55, ahead.states[54]));
    let none = stored(0, None).continued.build(None).expect("the same run");
    assert_eq!(none.tick(), 0);
}

#[test]
fn a_difference_names_the_tick_and_missing_or_damaged_ticks_are_refused() {
    let error = |change: &dyn Fn(&mut ContinuedRun)| {
        let mut continued = stored(40, Some(20)).continued;
        change(&mut continued);
        continued.build(None).map(|run| run.tick()).expect_err("changed").to_string()
    };
    let in_row = |continued: &mut ContinuedRun, row: usize, change: &dyn Fn(&mut Vec<ShippedTick>)| {
        let body = &mut continued.shipped.ticks[row].body;
        let mut ticks = decode(body).expect("ticks");
        change(&mut ticks);
        *body = encode(&ticks);
    };
    assert_eq!(
        error(&|run| in_row(run, 2, &|ticks| ticks[3].state.0 ^= 1)),
        "tick 26 has another state than on the earlier host"
    );
    assert_eq!(
        error(&|run| in_row(run, 2, &|ticks| ticks[3].action.hand = Some(vec![7.0, 7.0]))),
        "tick 26 has another action than on the earlier host"
    );
    assert_eq!(
        error(&|run| in_row(run, 2, &|ticks| ticks[3].action.hand = Some(vec![f64::NAN]))),
        "tick 26 has another action than on the earlier host"
    );
    assert_eq!(
        error(&|run| in_row(run, 1, &|ticks| drop(ticks.pop()))),
        "the ticks after tick 11: 10 instead of 11"
    );
    assert_eq!(
        error(&|run| drop(run.shipped.ticks.remove(1))),
        "the ticks after tick 11 are missing; the next are those after tick 22"
    );
    assert_eq!(
        error(&|run| run.shipped.ticks[1].body[0] = 9),
        "the ticks after tick 11: their encoding is 9, and this program reads 1 and 2"
    );
    assert_eq!(error(&|run| run.header.engine.push('x')), "the run has another engine than this server");
    assert_eq!(error(&|run| run.header.hand_hash.push('x')), "the run has another hand than this server");
}

#[tokio::test]
async fn a_run_continues_with_its_recording_and_its_replay_is_verified() {
    let folder = TempDir::new().expect("a folder");
    let archive = Archive::open(folder.path(), Keys::random(), 0).expect("opens");
    let (background, scheduler) = (Background::new(2), Scheduler::new(1));
    let admission = Admission::default();
    let request = WorldRequest { session_id: "s", mode: Mode::Lockstep, official: true };
    // Twice: an earlier process on this host has left an unfinished file.
    for ticks in [100, 150] {
        let Stored { continued, states } = stored(ticks, Some(ticks - 30));
        let motors = continued.hand.motors.len();
        let (recorder, recording) = archive.record(continued.header.clone());
        let admitted = admission.force(request, Instant::now());
        let opened =
            continued.open(admitted, &background, Some(recorder), vec![]).await.expect("the same run");
        assert_eq!(opened.observation.tick, ticks);
        let mut world = opened.world;
        if ticks == 100 {
            drop(world);
            continue;
        }
        for tick in ticks..210 {
            let permit = scheduler.permit(Urgency::lockstep(true, Instant::now())).await;
            world.tick(&action(tick, motors), &permit).expect("valid");
        }
        let outcome = world.finish(&background, Reason::Stopped).await.expect("sound");
        let file = recording.file().await.expect("recorded").expect("has ticks");
        let replay = palmares_replay::read(&std::fs::read(&file.path).expect("file")).expect("sound");
        assert_eq!((replay.outcome.ticks, outcome.ticks), (210, 210));
        let first: Vec<Option<StateHash>> = replay.actions.iter().map(|tick| tick.state).take(150).collect();
        assert_eq!(first, states.into_iter().map(Some).collect::<Vec<_>>());
        assert_eq!(verify(&replay, &[]).expect("the same again").ticks, 210);
    }
}
