//! Numbers that are given, and longer steps.

use crate::seed::Seed;
use crate::sensing::Noise;
use crate::task::Task;
use crate::training::{Given, TrainingOptions, open};
use palmares_models::hand::Hand;
use std::sync::Arc;

fn balls() -> Arc<Task> {
    Task::builtin().into_iter().find(|task| task.name == "balls").expect("built in")
}

#[test]
fn what_is_given_is_in_the_run_and_wins_over_what_is_drawn() {
    let task = balls();
    let hand = Hand::builtin("softhand").expect("built in");
    let (name, [low, _]) = (hand.uncertain[0].name.clone(), hand.uncertain[0].range.ends());
    let mass: Vec<f64> = (0..task.objects.count).map(|k| 0.5 + 0.1 * k as f64).collect();
    let given = Given { mass: Some(mass.clone()), hand: [(name, low)].into(), ..Given::default() };
    let drawn = TrainingOptions::none(&task)
        .randomise(&task, &hand, &["mass", "friction", "hand"])
        .expect("declared");
    let masses = |options: &TrainingOptions| -> Vec<f64> {
        let run = open(&task, &hand, Seed::from_u64(1), Noise::None, options).expect("a scene");
        run.scene().bodies.iter().filter(|body| body.free).map(|body| body.mass).collect()
    };
    let own = masses(&TrainingOptions::none(&task));
    let options = drawn.give(&hand, given).expect("in bounds");
    for ((mass, own), factor) in masses(&options).iter().zip(own).zip(mass) {
        assert!((mass / own - factor).abs() < 1e-12);
    }
    assert_eq!(options.hand_numbers(&hand, Seed::from_u64(1))[0], Some(low));
    assert!(!options.vary_nothing());
}

#[test]
fn a_longer_step_is_another_task_and_divides_the_tick() {
    let task = balls();
    let hand = Hand::builtin("softhand").expect("built in");
    for (step_s, steps) in [(0.002, 5), (0.004, 3), (0.01, 1)] {
        let options = TrainingOptions::none(&task).longest_step(step_s).expect("allowed");
        let run = open(&task, &hand, Seed::from_u64(1), Noise::None, &options).expect("a scene");
        assert_eq!(run.task().steps_per_tick(), steps);
        assert!(run.task().is_varied());
        assert_ne!(run.task().content_hash(), task.content_hash());
    }
    for step_s in [0.0005, 0.02, f64::NAN] {
        let error = TrainingOptions::none(&task).longest_step(step_s).expect_err("out of range");
        assert!(error.ends_with("wanted 1 to 10"), "{error}");
    }
    assert!(TrainingOptions::none(&task).longest_step(task.step_s).expect("its own").vary_nothing());
}

#[test]
fn numbers_that_cannot_be_given_are_refused() {
    let hand: Arc<Hand> = Hand::builtin("softhand").expect("built in");
    let check = |given: Given| given.check(&hand).expect_err("bad");
    let mass = check(Given { mass: Some(vec![1.0, -2.0]), ..Given::default() });
    assert_eq!(mass, "mass: found -2; wanted 0.01 to 100");
    let gravity = check(Given { gravity: Some([0.0, 0.0, -200.0]), ..Given::default() });
    assert_eq!(gravity, "gravity: found -200 m/s²; wanted -100 to 100");
    let gravity = check(Given { gravity: Some([f64::NAN, 0.0, 0.0]), ..Given::default() });
    assert_eq!(gravity, "gravity: found NaN m/s²; wanted -100 to 100");
    let links = hand.links.len();
    let heavy = check(Given { link_mass: Some(vec![1000.0; links]), ..Given::default() });
    assert_eq!(heavy, "link_mass: found 1000; wanted 0.01 to 100");
    let few = check(Given { link_mass: Some(vec![1.0]), ..Given::default() });
    assert_eq!(few, format!("link_mass: found 1 factors; hand `softhand` has {links} links"));
    let name = check(Given { hand: [("slip".to_owned(), 1.0)].into(), ..Given::default() });
    assert!(name.starts_with("found hand_slip; hand `softhand` has in [uncertain] of its hand.toml: hand_"));
    let far = check(Given { hand: [(hand.uncertain[0].name.clone(), 1e9)].into(), ..Given::default() });
    assert!(far.contains("found 1000000000; wanted "), "{far}");
}
