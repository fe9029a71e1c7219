//! Invariants of every referee, for any objects in any order.

use palmares_models::{Pose, Vec3};
use palmares_tasks::referee::ObjectSnapshot;
use palmares_tasks::task::{Rules, Task};
use proptest::prelude::*;
use std::sync::Arc;

fn task(name: &str) -> Arc<Task> {
    Task::builtin().into_iter().find(|task| task.name == name).expect("built in")
}

/// Any position: in either region, between them, far away, and sometimes not finite.
fn position(task: &Task) -> BoxedStrategy<[f64; 3]> {
    let regions: Vec<_> = task.regions().map(|(_, corners)| corners).collect();
    let inside = (prop::sample::select(regions), prop::array::uniform3(0.0..=1.0f64))
        .prop_map(|((low, high), part)| std::array::from_fn(|k| low[k] + part[k] * (high[k] - low[k])));
    let anywhere = prop::array::uniform3(-3.0..3.0f64);
    let odd = prop::array::uniform3(prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(0.0)]);
    prop_oneof![12 => inside, 6 => anywhere, 1 => odd].boxed()
}

fn sightings(task: &Task) -> BoxedStrategy<Vec<ObjectSnapshot>> {
    let in_hand =
        prop_oneof![4 => prop::array::uniform3(0.0..0.01f64), 1 => prop::array::uniform3(-0.2..0.2f64)];
    let one = (position(task), in_hand, any::<bool>()).prop_map(|(position, in_hand, at_rest)| {
        let frame = Pose::from_translation(Vec3::from_array(position));
        ObjectSnapshot { position, in_hand, at_rest, frame }
    });
    prop::collection::vec(one, task.objects.count).boxed()
}

fn story(name: &'static str) -> BoxedStrategy<(Arc<Task>, Vec<Vec<ObjectSnapshot>>)> {
    let task = task(name);
    prop::collection::vec(sightings(&task), 2..60).prop_map(move |frames| (Arc::clone(&task), frames)).boxed()
}

/// The place of an object after an event.
fn place_after(kind: &str) -> &'static str {
    match kind {
        "in_goal" => "goal",
        "outside" => "outside",
        "left_goal" | "back_inside" => "start",
        other => panic!("no such event: {other}"),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]
    /// Goals are reported in their order, each once, and they alone give count and score. A restored referee gives the same.
    #[test]
    fn arranging_is_reported_goal_by_goal((task, frames) in story("pan")) {
        let Rules::Arrange(rules) = &task.rules else { panic!("a pan and its lid are arranged") };
        let mut referee = task.referee(&frames[0]);
        let mut reported: Vec<String> = Vec::new();
        for (k, frame) in frames.iter().enumerate().skip(1) {
            let mut other = task.referee(&frames[0]);
            other.restore(&referee.state());
            // Longer than any goal is to last.
            let events = referee.watch(120 * k as u64, frame);
            prop_assert_eq!(&other.watch(120 * k as u64, frame), &events);
            reported.extend(events.into_iter().map(|event| event.kind));
            let reached = &rules.goals[..reported.len()];
            prop_assert!(reached.iter().map(|goal| &goal.name).eq(&reported), "{:?}", reported);
            let points: f64 = reached.iter().map(|goal| goal.points).sum();
            prop_assert!((referee.score() - points).abs() < 1e-12);
            prop_assert_eq!(referee.count().in_goal as usize, reported.len());
            prop_assert_eq!(referee.complete(), reported.len() == rules.goals.len());
        }
    }

    /// Events alone give the count; the count alone gives the score; the final result is that of a last frame at rest.
    #[test]
    fn collecting((task, frames) in prop_oneof![story("balls"), story("shelf")]) {
        let Rules::Collect(rules) = &task.rules else { panic!("objects are collected") };
        let n = task.objects.count;
        let mut referee = task.referee(&frames[0]);
        let mut places = vec!["start"; n];
        for (tick, frame) in frames.iter().enumerate() {
            for event in referee.watch(tick as u64, frame) {
                prop_assert_eq!(event.tick, tick as u64);
                let object = event.object.expect("it is about an object");
                let now = place_after(&event.kind);
                prop_assert_ne!(places[object], now, "nothing happened, yet it was noted");
                if event.kind == "left_goal" { prop_assert_eq!(places[object], "goal"); }
                if event.kind == "back_inside" { prop_assert_eq!(places[object], "outside"); }
                if now != "start" { prop_assert!(frame[object].at_rest); }
                places[object] = now;
            }
            let number = |place| places.iter().filter(|p| **p == place).count() as u32;
            let count = referee.count();
            prop_assert_eq!((count.in_goal, count.outside), (number("goal"), number("outside")));
            let score = rules.in_goal * f64::from(count.in_goal) + rules.outside * f64::from(count.outside);
            prop_assert_eq!(referee.score(), score);
            prop_assert_eq!(referee.complete(), count.in_goal as usize == n);
            prop_assert_eq!(referee.shaking(tick as u64), None);
        }
        // Shown the same once more, all at rest, the referee's running count is the verdict.
        let last: Vec<ObjectSnapshot> =
            frames[frames.len() - 1].iter().map(|object| ObjectSnapshot { at_rest: true, ..*object }).collect();
        let _ = referee.watch(frames.len() as u64, &last);
        let (count, score) = referee.final_result(&last);
        prop_assert_eq!(count, referee.count());
        prop_assert_eq!(score, referee.score());
        prop_assert!(count.in_goal + count.outside <= n as u32);
        prop_assert!(referee.watch(frames.len() as u64 + 1, &last).is_empty(), "the same again is no news");
    }

    /// The order of objects in the scene gives no advantage.
    #[test]
    fn the_order_of_objects_does_not_matter((task, frames) in story("shelf"), turn in 0usize..10) {
        let turned: Vec<Vec<ObjectSnapshot>> = frames
            .iter()
            .map(|frame| {
                let mut frame = frame.clone();
                frame.rotate_left(turn);
                frame
            })
            .collect();
        let (mut a, mut b) = (task.referee(&frames[0]), task.referee(&turned[0]));
        for (tick, (x, y)) in frames.iter().zip(&turned).enumerate() {
            let _ = (a.watch(tick as u64, x), b.watch(tick as u64, y));
            prop_assert_eq!(a.count(), b.count());
        }
    }

    /// Points only grow, in the order of the stages, and are never more than there are.
    #[test]
    fn holding((task, frames) in story("grasp"), pace in 1u64..120) {
        let Rules::Hold(rules) = &task.rules else { panic!("grasp is about holding") };
        let points = &rules.points;
        let most = points.lifted + points.held + points.shaken + points.firm + points.quick;
        let mut referee = task.referee(&frames[0]);
        let (mut score, mut kinds) = (0.0, Vec::new());
        for (k, frame) in frames.iter().enumerate() {
            // Each frame lasts a while, so that holds and shakes come about.
            for i in 0..pace {
                let tick = 1 + k as u64 * pace + i;
                let over = referee.complete();
                for event in referee.watch(tick, frame) {
                    prop_assert!(!over, "{} after the end", event.kind);
                    kinds.push(event.kind);
                }
                prop_assert!(referee.score() >= score && referee.score() <= most + 1e-12);
                score = referee.score();
                if let Some((t, _)) = referee.shaking(tick) {
                    prop_assert!(t <= 3.0 * rules.shake.axis_s);
                    prop_assert!(!referee.complete());
                }
            }
        }
        let first = |kind: &str| kinds.iter().position(|k| k == kind);
        prop_assert!(kinds.iter().filter(|k| *k == "lifted").count() <= 1);
        prop_assert!(kinds.iter().filter(|k| *k == "held").count() <= 1);
        if let Some(held) = first("held") { prop_assert!(first("lifted").is_some_and(|l| l < held)); }
        if let Some(shaken) = first("shaken") {
            prop_assert!(first("held").is_some_and(|h| h < shaken));
            prop_assert!(score >= points.lifted + points.held + points.shaken);
            prop_assert_eq!(referee.count().in_goal, 1);
        } else {
            prop_assert_eq!(referee.count().in_goal, 0);
        }
        prop_assert_eq!(referee.final_result(&frames[0]), (referee.count(), referee.score()));
    }
}
