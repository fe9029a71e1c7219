//! Late and inexact actions.

use crate::action::{Action, BaseTarget};
use crate::run::Run;
use crate::seed::Seed;
use crate::sensing::Noise;
use crate::task::Task;
use crate::training::ActionErrors;
use crate::training::{TrainingOptions, open};
use palmares_models::hand::Hand;

fn run(actions: ActionErrors) -> Run {
    let task = Task::builtin().into_iter().find(|task| task.name == "grasp").expect("built in");
    let hand = Hand::builtin("softhand").expect("built in");
    let options = TrainingOptions::none(&task).action_errors(actions).expect("in bounds");
    open(&task, &hand, Seed::from_u64(1), Noise::None, &options).expect("a scene")
}

fn up() -> Action {
    let base = BaseTarget::Twist { linear: [0.0, 0.0, 0.1], angular: [0.0; 3] };
    Action { base: Some(base), hand: Some(vec![0.5]), effort: None }
}

#[test]
fn a_late_action_arrives_after_its_delay_also_in_a_continued_run() {
    let mut late = run(ActionErrors { delay: [3, 3], noise: 0.0 });
    let first = late.applied().clone();
    for _ in 0..2 {
        late.step(&up()).expect("valid");
        assert_eq!(late.applied(), &first);
    }
    let mut other = run(ActionErrors { delay: [3, 3], noise: 0.0 });
    let bytes = late.snapshot().to_bytes();
    other.restore(&crate::run::Snapshot::from_bytes(&bytes).expect("whole")).expect("the same run");
    for run in [&mut late, &mut other] {
        run.step(&up()).expect("valid");
        assert_eq!(run.applied(), &first);
        run.step(&up()).expect("valid");
        assert_eq!(run.applied().hand, Some(vec![0.5]));
    }
    assert_eq!(late.state_hash(), other.state_hash());
}

#[test]
fn delays_fill_their_range_and_errors_have_their_deviation() {
    let task = Task::builtin().into_iter().find(|task| task.name == "grasp").expect("built in");
    let options = |actions| TrainingOptions::none(&task).action_errors(actions).expect("in bounds");
    let drawn: std::collections::BTreeSet<u32> = (0..40)
        .map(|seed| {
            let options = options(ActionErrors { delay: [1, 4], noise: 0.0 });
            let task = task.varied(Seed::from_u64(seed), 0, &options);
            task.variation().expect("varied").action_delay()
        })
        .collect();
    assert_eq!(drawn, (1..=4).collect());
    let mut noisy = run(ActionErrors { delay: [0, 0], noise: 0.1 });
    let mut squares = 0.0;
    for _ in 0..200 {
        noisy.step(&up()).expect("valid");
        let Some([sigma]) = noisy.applied().hand.as_deref() else { panic!("one motor") };
        squares += (sigma - 0.5) * (sigma - 0.5);
    }
    let deviation = (squares / 200.0_f64).sqrt();
    assert!((deviation - 0.1).abs() < 0.015, "{deviation}");
}

#[test]
fn action_errors_out_of_bounds_are_refused() {
    let check = |delay, noise| ActionErrors { delay, noise }.check().expect_err("bad");
    assert_eq!(check([3, 2], 0.0), "action_delay: found [3, 2]; wanted 0 to 100, ascending");
    assert_eq!(check([0, 101], 0.0), "action_delay: found [0, 101]; wanted 0 to 100, ascending");
    assert_eq!(check([0, 0], f64::NAN), "action_noise: found NaN; wanted 0 to 1");
}
