//! Runs with given gravity, masses of links, and pushes on objects, against closed forms.

use crate::training::{hand, task};
use palmares_models::Vec3;
use palmares_tasks::observation::{BodyState, Wrench};
use palmares_tasks::run::{Placement, PushError, PushedPart, Snapshot};
use palmares_tasks::training::{Given, TrainingOptions, open};
use palmares_tasks::{Action, Noise, Run, Seed};

const NOTHING: Wrench = Wrench { force: [0.0; 3], torque: [0.0; 3] };

fn given(given: Given) -> Run {
    let (task, hand) = (task("grasp"), hand("pinch"));
    let options = TrainingOptions::none(&task).give(&hand, given).expect("in bounds");
    open(&task, &hand, Seed::from_u64(5), Noise::None, &options).expect("a scene")
}

fn under(gravity: [f64; 3]) -> Run {
    given(Given { gravity: Some(gravity), ..Given::default() })
}

fn steps(run: &mut Run, ticks: u32) {
    for _ in 0..ticks {
        run.step(&Action::default()).expect("valid");
    }
}

fn object(run: &Run) -> BodyState {
    run.object_states().next().expect("one object")
}

/// Puts the object into the air, far from the hand, at rest.
fn lift(run: &mut Run) {
    let mut body = object(run);
    (body.position[0], body.position[2]) = (1.0, 0.5);
    (body.linear, body.angular) = ([0.0; 3], [0.0; 3]);
    run.place(&Placement { objects: Some(vec![body]), ..Placement::default() }).expect("a pose");
}

/// Momentum, N·s, and angular momentum about the centre of mass, N·m·s, of the object.
fn momenta(run: &Run) -> (Vec3, Vec3) {
    let (model, state) = (run.world().model(), run.world().state());
    let (object, rotation) = (&model.objects()[0], state.objects[0].rotation);
    let (linear, angular) = state.object_velocity(model, 0);
    (linear * object.mass, rotation * (object.inertia * (rotation.inverse() * angular)))
}

#[test]
fn an_object_falls_as_the_gravity_of_its_run_says() {
    for gravity in [[0.0, 0.0, -1.62], [0.5, -0.3, 0.0], [0.0; 3], [0.0, 0.0, -100.0]] {
        let mut run = under(gravity);
        lift(&mut run);
        let before = Vec3::from_array(object(&run).position);
        steps(&mut run, 8);
        let (after, g, t) = (object(&run), Vec3::from_array(gravity), 0.08);
        let fallen = Vec3::from_array(after.position) - before;
        assert!((fallen - g * (0.5 * t * t)).length() < 1e-12, "{gravity:?}: {fallen}");
        assert!((Vec3::from_array(after.linear) - g * t).length() < 1e-12, "{gravity:?}");
        assert_eq!(run.scene().gravity, gravity);
    }
}

/// Objects sleep on the table when a run begins: a gravity that lifts them wakes them.
#[test]
fn an_object_at_rest_rises_where_gravity_points_up() {
    let mut run = under([0.0, 0.0, 1.0]);
    let before = object(&run).position[2];
    steps(&mut run, 20);
    let risen = object(&run).position[2] - before;
    // The table, compressed by the weight, gives it 1 mm at most on top.
    assert!((risen - 0.5 * 0.2 * 0.2).abs() < 1e-3, "{risen}");
}

#[test]
fn a_push_on_a_free_object_gives_its_momentum_and_its_angular_momentum() {
    let mut run = under([0.0; 3]);
    lift(&mut run);
    let (force, torque) = (Vec3::new(0.5, -0.2, 0.3), Vec3::new(1e-3, 2e-3, -5e-4));
    let push = Wrench { force: force.to_array(), torque: torque.to_array() };
    run.push_part(PushedPart::Object(0), push, 0.1).expect("valid");
    // Another push adds up.
    run.push_part(PushedPart::Object(0), Wrench { torque: [0.0; 3], ..push }, 0.05).expect("valid");
    steps(&mut run, 30);
    let (momentum, angular) = momenta(&run);
    assert!((momentum - force * 0.15).length() < 1e-12, "{momentum}");
    assert!((angular - torque * 0.1).length() < 1e-12, "{angular}");
    assert!(run.is_altered());
}

#[test]
fn a_snapshot_in_the_middle_of_a_push_goes_on_with_it() {
    let mut run = under([0.0, 0.0, -3.0]);
    let push = Wrench { force: [0.4, 0.0, 0.0], torque: [0.0, 0.0, 1e-3] };
    run.push_part(PushedPart::Object(0), push, 0.2).expect("valid");
    steps(&mut run, 5);
    let kept = Snapshot::from_bytes(&run.snapshot().to_bytes()).expect("readable");
    let (mut restored, mut fork) = (under([0.0, 0.0, -3.0]), run.fork());
    restored.restore(&kept).expect("of the same run");
    for copy in [&mut run, &mut restored, &mut fork] {
        steps(copy, 30);
        assert!(copy.is_altered());
    }
    assert_eq!(run.state_hash(), restored.state_hash());
    assert_eq!(run.state_hash(), fork.state_hash());
    let other = under([0.0, 0.0, -3.1]).restore(&kept).expect_err("another gravity");
    assert_eq!(other.to_string(), "the snapshot has another task than this run");
}

#[test]
fn a_push_on_an_object_that_is_not_there_is_refused() {
    let mut run = under([0.0; 3]);
    let refused = run.push_part(PushedPart::Object(1), NOTHING, 0.1);
    assert_eq!(refused, Err(PushError::UnknownObject { object: 1, count: 1 }));
    assert_eq!(run.check_push(PushedPart::Object(0), NOTHING, 0.1), Ok(()));
    assert!(!run.is_altered());
}

#[test]
fn masses_of_links_are_factors() {
    let own = hand("pinch");
    let factors: Vec<f64> = (0..own.links.len()).map(|k| 0.5 + k as f64).collect();
    let run = given(Given { link_mass: Some(factors.clone()), ..Given::default() });
    assert!(run.task().is_varied());
    for ((link, own), factor) in run.hand().links.iter().zip(&own.links).zip(factors) {
        assert_eq!(link.inertia.mass, own.inertia.mass * factor);
        assert_eq!(link.inertia.about_com, own.inertia.about_com * factor);
        assert_eq!(link.inertia.com, own.inertia.com);
    }
}
