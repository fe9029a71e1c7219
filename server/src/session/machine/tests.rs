//! The machine, case by case and under random sequences of events.

use super::*;
use palmares_tasks::{Outcome, Reason};

const START: Duration = Duration::from_secs(5);

fn run() -> Playing {
    Playing {
        run_id: "r".into(),
        task: "balls".into(),
        task_hash: "0".repeat(64),
        hand: "h".into(),
        hand_sha256: None,
        seed: Some(1),
        k: None,
        tick_s: 0.01,
        mode: Mode::Lockstep,
        tick: 0,
    }
}

fn result() -> RunResult {
    let outcome = Outcome {
        score: 1.0,
        in_goal: 1,
        outside: 0,
        reason: Reason::SessionOver,
        fault: None,
        ticks: 3,
        sim_time_s: 0.03,
        events: vec![],
        state_hash: "0".repeat(16),
    };
    RunResult::new(run().info(), &run().task_hash, "practice", outcome)
}

fn code<T: std::fmt::Debug>(result: Result<T, Refusal>) -> Code {
    result.expect_err("must be refused").code
}

#[test]
fn the_order_is_kept() {
    let mut machine = Machine::new(None);
    assert_eq!(code(machine.may_step(START, 0, 1, 10)), Code::WrongState);
    assert_eq!(code(machine.stop()), Code::WrongState);
    machine.may_reset(START).expect("idle");
    machine.opened(run(), START);
    assert_eq!(code(machine.may_reset(START)), Code::WrongState);
    assert_eq!(machine.may_step(START, 0, 3, 10), Ok(3));
    machine.stepped(3, START);
    assert_eq!(code(machine.may_step(START, 0, 1, 10)), Code::StaleTick);
    assert_eq!(code(machine.may_step(START, 3, 0, 10)), Code::BadRequest);
    assert_eq!(code(machine.may_step(START, 3, 11, 10)), Code::BadRequest);
    assert_eq!(machine.may_step(START, 3, 10, 10), Ok(10));
    assert!(matches!(machine.stop(), Ok(Stopping::Open)));
    assert!(machine.playing().is_some(), "a stop that fails later finds the run again");
    machine.ended(START, false);
    machine.may_reset(START).expect("idle again");
}

#[test]
fn a_run_closed_by_the_server_keeps_its_result() {
    let mut machine = Machine::new(None);
    machine.opened(run(), START);
    machine.ended(START, false);
    machine.closed(result());
    assert_eq!(code(machine.may_step(START, 0, 1, 10)), Code::WrongState);
    assert_eq!(machine.run_info().map(|info| info.open), Some(false));
    assert!(matches!(machine.stop(), Ok(Stopping::Waiting(result)) if result.score == 1.0));
    assert_eq!(code(machine.stop()), Code::WrongState);
}

#[test]
fn no_tick_beyond_the_sessions_end() {
    let mut machine = Machine::new(Some(1.0));
    machine.opened(run(), START);
    machine.stepped(95, START);
    assert_eq!(machine.may_step(START, 95, 10, 10), Ok(5));
    machine.stepped(100, START);
    assert_eq!(code(machine.may_step(START, 100, 1, 10)), Code::SessionOver);
    machine.ended(START, false);
    machine.closed(result());
    assert_eq!(code(machine.may_step(START, 100, 1, 10)), Code::SessionOver);
    assert_eq!(code(machine.may_reset(START)), Code::SessionOver);
    assert!(machine.stop().is_ok());
}

#[test]
fn each_mode_has_its_own_request() {
    let mut machine = Machine::new(None);
    assert_eq!(code(machine.may_act(START)), Code::WrongState);
    machine.opened(run(), START);
    assert_eq!(code(machine.may_act(START)), Code::WrongState);
    machine.ended(START, false);
    machine.opened(Playing { mode: Mode::Realtime, ..run() }, START);
    assert_eq!(code(machine.may_step(START, 0, 1, 10)), Code::WrongState);
    machine.may_act(START).expect("realtime");
}

#[test]
fn in_a_pause_the_world_does_not_step() {
    let mut machine = Machine::new(Some(10.0));
    machine.opened(run(), START);
    machine.pause(START);
    assert_eq!(code(machine.may_step(START, 0, 1, 10)), Code::WrongState);
    assert!(matches!(machine.stop(), Ok(Stopping::Open)));
    machine.ended(START, false);
    assert_eq!(code(machine.may_reset(START)), Code::WrongState);
    machine.resume(START);
    machine.may_reset(START).expect("goes on");
}

#[test]
fn time_in_which_the_server_fails_costs_nothing() {
    let mut machine = Machine::new(Some(10.0));
    machine.opened(run(), START);
    machine.stepped(300, START);
    let end = START + Duration::from_secs(4);
    let ended = machine.clock().spent(end);
    // The result cannot be stored until after the session's end.
    let later = START + Duration::from_secs(60);
    assert!(machine.clock().is_over(later));
    machine.refund_since(ended, later);
    assert_eq!((machine.clock().left_s(later), machine.clock().refunded_s()), (Some(6.0), 6.0));
    // The run does not pay for it either.
    assert_eq!(machine.run_cost(later), Spent { wall_s: 4.0, simulated_s: 3.0 });
    machine.ended(later, false);
    machine.may_reset(later).expect("in time");
}

#[test]
fn a_reset_costs_time_that_a_void_run_gets_back() {
    let mut machine = Machine::new(Some(25.0)).with_reset_cost(10.0);
    machine.opened(run(), START);
    assert_eq!(machine.clock().left_s(START), Some(15.0));
    // After a crash the run never happened.
    assert_eq!(machine.saved(START).spent, Spent::default());
    machine.ended(START, false);
    assert_eq!(machine.clock().left_s(START), Some(15.0));
    machine.may_reset(START).expect("15 s are left");
    machine.opened(run(), START);
    let taken = machine.run_cost(START);
    assert_eq!(
        (taken, machine.clock().left_s(START)),
        (Spent { wall_s: 10.0, simulated_s: 10.0 }, Some(5.0))
    );
    machine.ended(START, false);
    assert_eq!(code(machine.may_reset(START)), Code::SessionOver, "5 s are left");
    machine.refund_run(taken, START);
    machine.may_reset(START).expect("15 s are left again");
    machine.opened(run(), START);
    machine.ended(START, true);
    assert_eq!(machine.clock().left_s(START), Some(15.0), "void by the server's fault");
}

mod random {
    use super::*;
    use proptest::prelude::*;

    #[derive(Clone, Debug)]
    enum Event {
        Wait(f64),
        Reset,
        Steps(u32),
        Stop,
        Fault,
        VoidEarlier(usize),
        Pause,
        Resume,
        /// The server crashes and starts again after a while.
        Crash(f64),
    }

    fn event() -> impl Strategy<Value = Event> {
        prop_oneof![
            3 => (0.0..20.0).prop_map(Event::Wait),
            3 => Just(Event::Reset),
            6 => (1u32..2000).prop_map(Event::Steps),
            3 => Just(Event::Stop),
            1 => Just(Event::Fault),
            1 => (0usize..5).prop_map(Event::VoidEarlier),
            1 => Just(Event::Pause),
            2 => Just(Event::Resume),
            1 => (0.0..100.0).prop_map(Event::Crash),
        ]
    }

    const LIMIT_S: f64 = 100.0;
    const CLOSE_S: f64 = 1e-5;

    /// A second, simple clock, as the reference: void runs are subtracted.
    #[derive(Default)]
    struct ReferenceClock {
        started: bool,
        paused: bool,
        spent: Spent,
        /// The same when the open run began.
        opened: Option<Spent>,
        /// Cost of ended runs: by this clock, and as stored.
        ended: Vec<(Spent, Spent)>,
    }

    impl ReferenceClock {
        fn end(&mut self) -> Spent {
            self.spent.since(self.opened.take().expect("a run"))
        }

        fn subtract(&mut self, run: Spent) {
            self.spent = self.spent.since(run);
            self.opened = self.opened.map(|opened| opened.since(run));
        }
    }

    proptest! {
        #[test]
        fn the_clock_is_fair_in_any_order(
            events in proptest::collection::vec(event(), 1..60),
            cost_s in prop_oneof![Just(0.0), 0.0..20.0],
        ) {
            let mut machine = Machine::new(Some(LIMIT_S)).with_reset_cost(cost_s);
            let (mut now, mut number) = (START, 0u32);
            let mut reference = ReferenceClock::default();
            for event in events {
                let over = machine.clock().is_over(now);
                match event {
                    Event::Wait(seconds) => {
                        now += Duration::from_secs_f64(seconds);
                        if reference.started && !reference.paused && !over {
                            reference.spent.wall_s = (reference.spent.wall_s + seconds).min(LIMIT_S);
                        }
                    }
                    Event::Reset => {
                        let may = machine.may_reset(now);
                        let affordable = !over && machine.clock().left_s(now) > Some(cost_s);
                        prop_assert_eq!(may.is_ok(), reference.opened.is_none() && affordable && !reference.paused);
                        if may.is_ok() {
                            number += 1;
                            machine.opened(Playing { run_id: number.to_string(), ..run() }, now);
                            reference.started = true;
                            reference.opened = Some(reference.spent);
                            reference.spent.wall_s += cost_s;
                            reference.spent.simulated_s += cost_s;
                        }
                    }
                    Event::Steps(repeat) => {
                        let tick = machine.playing().map_or(0, |run| run.tick);
                        if let Ok(ticks) = machine.may_step(now, tick, repeat, 2000) {
                            prop_assert!(!reference.paused && reference.opened.is_some());
                            prop_assert!((1..=repeat).contains(&ticks));
                            machine.stepped(tick + u64::from(ticks), now);
                            reference.spent.simulated_s += f64::from(ticks) * 0.01;
                            // At most the tick that began in time goes beyond the end.
                            let spent = machine.clock().spent(now);
                            prop_assert!(spent.simulated_s <= LIMIT_S + 0.01 + CLOSE_S);
                        }
                    }
                    Event::Stop => {
                        if reference.opened.is_some() {
                            let taken = machine.run_cost(now);
                            let after = machine.after(now, false);
                            machine.ended(now, false);
                            prop_assert_eq!(machine.saved(now), after);
                            let cost = reference.end();
                            reference.ended.push((cost, taken));
                        }
                    }
                    Event::Fault => {
                        if reference.opened.is_some() {
                            let after = machine.after(now, true);
                            machine.ended(now, true);
                            prop_assert_eq!(machine.saved(now), after);
                            let run = reference.end();
                            reference.subtract(run);
                        }
                    }
                    Event::VoidEarlier(index) => {
                        if index < reference.ended.len() {
                            let (cost, taken) = reference.ended.swap_remove(index);
                            machine.refund_run(taken, now);
                            reference.subtract(cost);
                        }
                    }
                    Event::Pause => {
                        machine.pause(now);
                        reference.paused = true;
                    }
                    Event::Resume => {
                        machine.resume(now);
                        reference.paused = false;
                    }
                    Event::Crash(down_s) => {
                        let saved = machine.saved(now);
                        now += Duration::from_secs_f64(down_s);
                        machine = Machine::restored(Some(LIMIT_S), &saved, reference.paused, now)
                            .with_reset_cost(cost_s);
                        if reference.opened.is_some() {
                            let run = reference.end();
                            reference.subtract(run);
                        }
                    }
                }
                let clock = machine.clock();
                let elapsed_s = clock.elapsed_s(now);
                prop_assert!((0.0..=LIMIT_S).contains(&elapsed_s));
                // Refunds change the time, nothing else does.
                let truth_s = reference.spent.counts_s().min(LIMIT_S);
                prop_assert!((elapsed_s - truth_s).abs() < CLOSE_S, "{elapsed_s} {truth_s}");
                prop_assert_eq!(clock.is_over(now), clock.left_s(now) == Some(0.0));
                if clock.is_over(now) {
                    prop_assert_eq!(code(machine.may_reset(now)) == Code::SessionOver, reference.opened.is_none());
                    let tick = machine.playing().map_or(0, |run| run.tick);
                    prop_assert!(machine.may_step(now, tick, 1, 10).is_err());
                }
            }
        }
    }
}

#[test]
fn an_open_run_after_the_end_is_due_at_once() {
    let mut machine = Machine::new(Some(10.0));
    machine.opened(run(), START);
    let after = START + Duration::from_secs(11);
    assert_eq!(machine.next_change(START + Duration::from_secs(4)), Some(Duration::from_secs(6)));
    assert_eq!(machine.next_change(after), Some(Duration::ZERO), "late, but not missed");
    machine.closed(result());
    assert_eq!(machine.next_change(after), None);
}
