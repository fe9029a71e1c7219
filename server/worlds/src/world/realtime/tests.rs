//! A realtime world, ticked by the test.

use super::*;
use crate::compute::tick_phase::TickPhases;
use crate::world::stub::{Stub, stub_world};
use palmares_models::builtin::builtin_hands;
use palmares_tasks::BaseTarget;

fn live(stub: Stub) -> Arc<RealtimeWorld> {
    live_with(stub, None)
}

fn live_with(stub: Stub, gate: Option<Gate>) -> Arc<RealtimeWorld> {
    let hand = builtin_hands()[0].clone();
    let now = Instant::now();
    let (pace, tick_phase) = (Pace::new(now, 0.01), TickPhases::new(now).next());
    Arc::new(RealtimeWorld::new(stub_world(stub).0, hand, pace, tick_phase, false, gate, Scheduler::new(1)))
}

fn moving(speed: f64) -> Action {
    let base = BaseTarget::Twist { linear: [speed, 0.0, 0.0], angular: [0.0; 3] };
    Action { base: Some(base), hand: None, effort: None }
}

#[test]
fn actions_take_effect_at_the_tick_they_were_promised() {
    let live = live(Stub::default());
    assert_eq!(live.act(moving(0.1), vec![]), Ok(1));
    assert_eq!(live.act(moving(0.2), vec![]), Ok(1), "the later one counts");
    live.tick(0);
    live.tick(0);
    assert_eq!(live.act(moving(0.3), vec![]), Ok(3));
    live.tick(0);
    let streamed: Vec<(u64, Action)> = std::iter::from_fn(|| live.pop())
        .map(|s| (s.observation.tick, s.observation.applied_action))
        .collect();
    assert_eq!(streamed, [(1, moving(0.2)), (2, Action::default()), (3, moving(0.3))]);
    assert_eq!(live.stats().tempo.missed, 1);
}

#[test]
fn what_a_controller_leaves_out_keeps_what_came_before_in_the_same_tick() {
    let live = live(Stub::default());
    let still = Action { base: None, hand: Some(vec![]), effort: None };
    assert!(live.act(still.clone(), vec![]).is_err(), "the hand has a motor");
    live.act(moving(0.1), vec![]).expect("fits");
    live.act(Action::default(), vec![]).expect("fits");
    live.tick(0);
    assert_eq!(live.pop().expect("a tick").observation.applied_action, moving(0.1));
}

#[test]
fn a_client_that_does_not_read_does_not_slow_the_world() {
    let live = live(Stub::default());
    let ticks = STREAM_LENGTH as u64 + 10;
    for _ in 0..ticks {
        assert!(live.tick(0).is_some());
    }
    assert_eq!((live.tick_now(), live.stats().dropped), (ticks, 10));
    let oldest = live.oldest_waiting();
    let first = live.pop().expect("waits");
    assert_eq!(oldest, Some(first.observation.tick));
    assert_eq!(first.observation.tick, 11);
    live.keep_last();
    assert_eq!(live.pop().map(|last| last.observation.tick), Some(ticks));
    assert!(live.pop().is_none());
}

#[test]
fn the_hand_of_a_silent_controller_holds_its_place() {
    let live = live(Stub::default());
    live.act(moving(0.1), vec![]).expect("fits");
    let mut applied = Vec::new();
    for _ in 0..crate::compute::pace::HOLD_TICKS + 3 {
        live.tick(0);
        applied.push(live.pop().expect("a tick").observation.applied_action);
    }
    let still: Vec<usize> = (0..applied.len()).filter(|&k| applied[k].base.is_some()).collect();
    assert_eq!(still, [0, crate::compute::pace::HOLD_TICKS as usize + 1]);
    assert_eq!(applied[still[1]].base, moving(0.0).base);
}

#[test]
fn the_end_of_the_run_is_the_last_tick() {
    let live = live(Stub { over_at: 3, ..Stub::default() });
    assert!(live.tick(0).is_some() && live.tick(0).is_some());
    assert_eq!(live.over(), None);
    assert!(live.tick(0).is_none());
    assert_eq!(live.over(), Some(Reason::TimeLimit));
}

#[test]
fn a_world_that_breaks_says_so_and_ticks_no_more() {
    for stub in [Stub { unsound_at: 2, ..Stub::default() }, Stub { panic_at: 2, ..Stub::default() }] {
        let live = live(stub);
        assert!(live.tick(0).is_some());
        assert!(live.tick(0).is_none());
        assert_eq!(live.over(), Some(Reason::WorldFault));
        let streamed: Vec<Observation> = std::iter::from_fn(|| live.pop()).map(|s| s.observation).collect();
        let [first, last] = streamed.as_slice() else { panic!("{streamed:?}") };
        assert_eq!((first.tick, first.truncated), (1, false));
        assert_eq!((last.tick, last.truncated, last.reason.as_deref()), (1, true, Some("world_fault")));
        assert!(last.events.is_empty(), "they were streamed before");
    }
    let live = live(Stub { unsound_at: 1, ..Stub::default() });
    assert!(live.tick(0).is_none());
    let last = live.pop().expect("also in the first tick").observation;
    assert_eq!((last.tick, last.reason.as_deref()), (0, Some("world_fault")));
}

#[test]
fn in_a_pause_nothing_ticks_and_afterwards_it_goes_on_once() {
    let pacer = Pacer::start(1);
    let live = live(Stub::default());
    assert!(live.tick(0).is_some());
    live.pause();
    assert!(live.tick(0).is_none(), "the old entry is ignored");
    live.resume(&pacer);
    live.resume(&pacer);
    assert!(live.tick(0).is_none(), "and stays so");
    while live.tick_now() < 4 {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    assert!(live.take(None).is_some());
}

#[test]
fn a_run_that_is_cut_short_says_why_in_its_last_observation() {
    let live = live(Stub::default());
    live.tick(0);
    assert!(live.take(Some(Reason::SessionOver)).is_some());
    assert!(live.tick(0).is_none());
    assert!(live.take(Some(Reason::SessionOver)).is_none());
    let streamed: Vec<(u64, bool)> =
        std::iter::from_fn(|| live.pop()).map(|s| (s.observation.tick, s.observation.truncated)).collect();
    assert_eq!(streamed, [(1, false), (1, true)]);
}

#[test]
fn no_tick_begins_after_the_end_of_the_session_unless_it_gets_more_time() {
    let live = live(Stub::default());
    assert!(live.tick(0).is_some());
    // As late as a busy machine likes: the tick before was made in time, this one is not.
    live.end_at(Some(Instant::now()));
    for _ in 0..3 {
        assert!(live.tick(0).expect("it tries again") > Instant::now());
        assert_eq!(live.tick_now(), 1);
    }
    live.end_at(Some(Instant::now() + std::time::Duration::from_secs(60)));
    assert!(live.tick(0).is_some());
    live.end_at(None);
    assert!(live.tick(0).is_some());
    assert_eq!(live.tick_now(), 3);
}

#[test]
fn a_world_with_too_many_unstored_ticks_stands_until_they_are_stored() {
    use crate::world::backlog::{Backlog, MAX_UNSTORED};
    let backlog = Backlog::new();
    let live = live_with(Stub::default(), Some(backlog.gate().clone()));
    let play = || {
        for _ in 0..MAX_UNSTORED {
            assert!(live.tick(0).is_some());
            backlog.add(live.tick_now());
        }
    };
    play();
    let before = live.ticking.lock().pace.due();
    for stood in 1..4 {
        let later = live.tick(0).expect("it tries again");
        assert!(later >= before + stood * std::time::Duration::from_millis(10));
        assert_eq!(live.tick_now(), MAX_UNSTORED);
    }
    assert!(backlog.gate().take_stood() >= std::time::Duration::from_millis(30));
    assert!(backlog.gate().take_stood().is_zero(), "given back once");
    let late = live.stats().tempo.late;
    assert!(backlog.take().is_some());
    backlog.confirm();
    play();
    assert_eq!(live.tick_now(), 2 * MAX_UNSTORED);
    assert_eq!(live.stats().tempo.late, late, "ticks before they were due");
    backlog.lose();
    assert!(live.tick(0).is_none(), "its next owner continues it");
}
