//! Sensors of whole runs: reading them changes nothing, readings do not depend on other readings, and errors are as declared.

use palmares_models::hand::Hand;
use palmares_tasks::image::CameraImage;
use palmares_tasks::run::Run;
use palmares_tasks::{Action, BaseTarget, Noise, Seed, Sensing, Task};

const CAMERAS: [&str; 5] = ["box_a", "box_b.rgb", "wrist", "wrist.rgb", "box_a.bodies"];

fn run(hand: &str, seed: u64, noise: Noise) -> Run {
    let task = Task::builtin().into_iter().find(|task| task.name == "balls").expect("balls");
    let hand = Hand::builtin(hand).expect("built in");
    Run::new(task, hand, Seed::from_u64(seed)).expect("a scene").with_noise(noise)
}

/// The action of a tick: the hand goes down into the balls while it opens and closes.
fn action(tick: u64, run: &Run) -> Action {
    let phase = tick as f64 * 0.01;
    let base = BaseTarget::Twist { linear: [0.05 * libm::sin(phase), 0.0, -0.12], angular: [0.0, 0.0, 0.1] };
    let sigma = 0.5 - 0.5 * libm::cos(3.0 * phase);
    Action { base: Some(base), hand: Some(vec![sigma; run.hand().motors.len()]), effort: None }
}

fn images(run: &mut Run, cameras: &[&str]) -> Vec<CameraImage> {
    let wanted: Vec<String> = cameras.iter().map(|name| (*name).to_owned()).collect();
    let shots = run.shots(&wanted, Sensing::Truth).expect("cameras of this run");
    run.expose(&shots).iter().map(|exposure| exposure.render().clone()).collect()
}

/// Plays 200 ticks; `ask` looks, or does not, after each.
fn played(noise: Noise, mut ask: impl FnMut(u64, &mut Run)) -> Run {
    let mut run = run("softhand_skin", 3, noise);
    for tick in 0..200 {
        ask(tick, &mut run);
        let action = action(tick, &run);
        run.step(&action).expect("valid");
    }
    run
}

#[test]
fn a_run_goes_the_same_way_whoever_looks() {
    let expected = played(Noise::None, |_, _| {}).state_hash();
    for noise in [Noise::None, Noise::Real] {
        let unseen = played(noise, |_, _| {});
        assert_eq!(unseen.state_hash(), expected, "{noise:?}");
        let watched = played(noise, |tick, run| {
            run.observe(Sensing::Truth);
            if tick % 20 == 0 {
                images(run, &CAMERAS);
            }
        });
        assert_eq!(watched.state_hash(), expected, "{noise:?} with all cameras");
        let now_and_then = played(noise, |tick, run| {
            if (tick * 7919) % 31 == 0 {
                images(run, &CAMERAS[..(tick % 5) as usize]);
                run.observe(Sensing::Sensors);
            }
        });
        assert_eq!(now_and_then.state_hash(), expected, "{noise:?} with some");
    }
}

#[test]
fn noise_belongs_to_run_and_tick_and_not_to_earlier_observations() {
    let mut last = Vec::new();
    let mut observed = played(Noise::Real, |tick, run| {
        if tick % 9 == 0 {
            run.observe(Sensing::Sensors);
            last = images(run, &["wrist", "box_a"]);
            let wanted = ["wrist".to_owned()];
            let shots = run.shots(&wanted, Sensing::Sensors).expect("a camera");
            run.upcoming(&shots).iter().for_each(|exposure| drop(exposure.render().clone()));
        }
    });
    let mut silent = played(Noise::Real, |_, _| {});
    assert_eq!(observed.observe(Sensing::Sensors), silent.observe(Sensing::Sensors));
    assert_eq!(images(&mut observed, &CAMERAS), images(&mut silent, &CAMERAS));
    assert_eq!(images(&mut observed, &["wrist"])[0], last[0], "the same image until the next comes");
    for _ in 0..4 {
        observed.step(&Action::default()).expect("valid");
    }
    assert_ne!(images(&mut observed, &["wrist"])[0], last[0]);
    // Without noise the same reading is another one.
    let mut ideal = played(Noise::None, |_, _| {});
    assert_ne!(ideal.observe(Sensing::Sensors).hand, silent.observe(Sensing::Sensors).hand);
    assert_ne!(images(&mut ideal, &["wrist"]), images(&mut silent, &["wrist"]));
    // Another run has other noise, though nothing is different before the cameras but the balls.
    let wrist = |seed| run("softhand", seed, Noise::Real).observe(Sensing::Sensors).hand.of("wrist").to_vec();
    assert_ne!(wrist(3), wrist(4));
    assert_eq!(wrist(3), wrist(3));
}

#[test]
fn pictures_of_real_cameras_come_at_their_rate_and_late() {
    let (mut ticks, mut period) = (Vec::new(), None);
    let run = played(Noise::Real, |tick, run| {
        let image = &images(run, &["wrist"])[0];
        // 66 ms are 7 ticks, 1/30 s is 3 and a third.
        assert!(image.tick <= tick.saturating_sub(7) || image.tick == 0, "{} at {tick}", image.tick);
        assert!(tick - image.tick < 7 + 4, "{} at {tick}", image.tick);
        ticks.push(image.tick);
        period = Some(run.task().tick_s);
    });
    ticks.dedup();
    let expected: Vec<u64> = (0..ticks.len() as u64)
        .map(|frame| (frame as f64 / 30.0 / period.expect("a run") - 1e-9).ceil() as u64)
        .collect();
    assert_eq!(ticks, expected);
    let mut ideal = run;
    ideal = ideal.with_noise(Noise::None);
    assert_eq!(images(&mut ideal, &["wrist"])[0].tick, 200);
}

/// A hand that hangs still: every reading scatters as declared about its own constant error.
#[test]
fn readings_scatter_as_declared() {
    let mut still = run("reflex", 5, Noise::Real);
    let action = Action { base: None, hand: Some(vec![0.0; 4]), effort: None };
    for _ in 0..100 {
        still.step(&action).expect("valid");
    }
    let (mut wrench, mut joints, mut tension) = (vec![Vec::new(); 6], Vec::new(), Vec::new());
    let count = 2000;
    for _ in 0..count {
        still.step(&action).expect("valid");
        let hand = still.observe(Sensing::Sensors).hand;
        for (axis, x) in hand.of("wrist").iter().enumerate() {
            wrench[axis].push(*x);
        }
        joints.push(hand.of("encoders")[0]);
        tension.push(hand.column("motors", "tension")[0]);
    }
    let deviation = |x: &[f64]| {
        let mean = x.iter().sum::<f64>() / x.len() as f64;
        (x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / x.len() as f64).sqrt()
    };
    // The standard error of a deviation is 1/√(2n) of it. The zero of the wrist wanders: by less than 0.06 N in 20 s.
    let expect = |found: f64, declared: f64, more: f64| {
        let error = 5.0 * declared / (2.0 * f64::from(count)).sqrt();
        assert!(found > declared - error && found < declared + error + more, "{found}, declared {declared}");
    };
    for (axis, readings) in wrench.iter().enumerate() {
        let declared = [0.1, 0.1, 0.1, 0.005, 0.005, 0.003][axis];
        expect(deviation(readings), declared, if axis < 3 { 0.02 } else { 0.0025 });
    }
    let sensors = &still.hand().sensors;
    let encoder = sensors.joints.as_ref().expect("encoders");
    expect(deviation(&joints), encoder.noise.hypot(encoder.resolution / 12f64.sqrt()), 0.0);
    let limit: f64 =
        still.hand().tendons.iter().find(|tendon| tendon.weight(0) != 0.0).expect("one").force_limit;
    expect(deviation(&tension), sensors.motors.tension_noise * limit, 0.0);
}

#[test]
fn only_the_truth_has_the_body_of_each_pixel() {
    let run = run("softhand", 1, Noise::None);
    let wanted = ["box_a.bodies".to_owned()];
    assert!(run.shots(&wanted, Sensing::Truth).is_ok());
    assert!(run.shots(&wanted, Sensing::Sensors).is_err());
    let unknown = run.shots(&["eye".to_owned()], Sensing::Truth).expect_err("no such camera").to_string();
    assert!(unknown.contains("box_a") && unknown.contains("wrist"), "{unknown}");
}

/// Winding a tendon up stores energy in the joints' springs: unwinding gives a part of it back, and what friction took is
/// lost.
#[test]
fn a_motor_works_when_it_closes_and_gets_less_back() {
    let mut run = run("softhand", 1, Noise::None);
    let mut work = |sigma: f64| {
        for _ in 0..300 {
            run.step(&Action { base: None, hand: Some(vec![sigma]), effort: None }).expect("valid");
        }
        run.telemetry().motors[0].motor_work_j
    };
    let (closed, opened) = (work(1.0), work(0.0));
    assert!(closed > 0.1, "{closed}");
    assert!(opened > 0.0 && opened < closed, "{closed} {opened}");
}
