//! URDF and `hand.toml`: a hand that is within the limits makes some ticks in a small scene.

use crate::parts::{self, Seeds};
use palmares_models::hand::Hand;
use palmares_models::measure::HandLimits;
use palmares_models::read::{self, LoadOptions, Loaded};
use palmares_tasks::{Action, BaseTarget, Run, Seed, Sensing, Task, inspect};
use std::path::Path;
use std::sync::{Arc, OnceLock};

/// A task that is built quickly.
pub(crate) const TASK: &str = include_str!("../../tasks/tests/cube.toml");

pub(crate) fn run(data: &[u8]) -> bool {
    let files = parts::split(data);
    let text = |wanted: &str| {
        let (_, content) = files.iter().find(|(name, _)| name == wanted)?;
        std::str::from_utf8(content).ok()
    };
    let Some(urdf) = text("hand.urdf") else { return false };
    let settings = text("hand.toml").map(|text| (Path::new("hand.toml"), text));
    let loaded = read::from_text((Path::new("hand.urdf"), urdf), settings, None, &LoadOptions::default());
    loaded.is_ok_and(play_within_limits)
}

/// Plays a hand if it is within the limits; whether it is.
pub(crate) fn play_within_limits(Loaded { hand, sources, .. }: Loaded) -> bool {
    static SMALL: OnceLock<Arc<Task>> = OnceLock::new();
    let limits = HandLimits::default();
    let within = inspect::beyond_limits(&hand, &sources, &limits).is_empty();
    hand.describe();
    hand.content_hash();
    if within {
        let task = SMALL.get_or_init(|| Arc::new(Task::parse("task.toml", TASK).expect("a valid task")));
        play(task.clone(), Arc::new(hand));
    }
    within
}

/// Plays some ticks. A world may fail, but it says so before a number is not finite.
pub(crate) fn play(task: Arc<Task>, hand: Arc<Hand>) {
    let motors = hand.motors.len();
    let Ok(mut run) = Run::new(task, hand, Seed([7; 32])) else { return };
    let twist = BaseTarget::Twist { linear: [0.2, 0.0, -0.5], angular: [0.0, 1.0, 0.0] };
    let actions = [
        Action { base: None, hand: Some(vec![1.0; motors]), effort: None },
        Action { base: Some(twist), hand: Some(vec![0.0; motors]), effort: None },
        Action::default(),
    ];
    for action in &actions {
        run.step(action).expect("the action fits");
        if !run.healthy() {
            break;
        }
        assert!(run.world().state().is_finite(), "a healthy world has a number that is not finite");
        assert!(run.score().is_finite());
        let mut row = vec![0.0; run.sensor_table().dimension()];
        run.read_sensors_into(&mut row);
        assert!(row.iter().all(|x| x.is_finite()), "a sensor is not finite: {row:?}");
        run.observe(Sensing::Truth);
    }
}

pub(crate) fn seeds() -> Seeds {
    let hand = |urdf: &str, settings: &str| {
        parts::joined(&[("hand.urdf", urdf.as_bytes()), ("hand.toml", settings.as_bytes())])
    };
    macro_rules! builtin {
        ($name:literal) => {
            hand(
                include_str!(concat!("../../models/hands/", $name, "/hand.urdf")),
                include_str!(concat!("../../models/hands/", $name, "/hand.toml")),
            )
        };
    }
    vec![
        ("pinch".into(), builtin!("pinch")),
        ("reflex".into(), builtin!("reflex")),
        ("two".into(), hand(include_str!("../inputs/two.urdf"), include_str!("../inputs/two.toml"))),
    ]
}
