//! A base that is bolted to its set point.

use crate::state::BaseReference;
use crate::{BaseCommand, Command, Config, Model, State, World};
use palmares_models::hand::Hand;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Rotation, Vec3};
use std::sync::Arc;

fn model(objects: &[f64]) -> Model {
    let mut hand = Hand::clone(&Hand::builtin("softhand").expect("it is built in"));
    hand.gravity_compensation = false;
    let mut config = Config::default();
    config.base.bolted = true;
    let mut model = Model::new(config, Some(Arc::new(hand))).expect("a hand");
    for mass in objects {
        let ball = Shape::Sphere { radius: 0.03 };
        let ball =
            Object::new("ball", vec![(Pose::IDENTITY, ball)], *mass, 0.8, 0.0).expect("a sound object");
        model.add_object(Arc::new(ball)).expect("it fits");
    }
    model
}

fn weight(model: &Model) -> f64 {
    let links = model.hand().expect("a hand").links.iter();
    9.81 * links.map(|link| link.inertia.mass).sum::<f64>()
}

#[test]
fn the_mount_carries_the_hand() {
    let model = model(&[]);
    let weight = weight(&model);
    let state = State::at_rest(&model, Pose::IDENTITY, &[]);
    let mut world = World::new(Arc::new(model), state);
    let mut command = Command::stay(world.model(), Pose::IDENTITY);
    command.sigma[0] = 0.5;
    for _ in 0..3000 {
        assert!(world.step(&command).converged);
        assert_eq!(world.state().base, Pose::IDENTITY);
    }
    let ([x, y, z], _) = world.servo_wrench();
    assert!(x.abs() < 1e-4 && y.abs() < 1e-4 && (z - weight).abs() < 1e-4, "{x} {y} {z}, not {weight}");
}

#[test]
fn a_ball_that_falls_on_the_hand_does_not_move_its_base() {
    let model = model(&[2.0]);
    let weight = weight(&model) + 2.0 * 9.81;
    let level = Pose::from_rotation(Rotation::from_rotation_y(std::f64::consts::FRAC_PI_2));
    let state = State::at_rest(&model, level, &[Pose::translation(0.09, 0.0, 0.2)]);
    let mut world = World::new(Arc::new(model), state);
    let command = Command::stay(world.model(), level);
    let mut most: f64 = 0.0;
    for _ in 0..400 {
        assert!(world.step(&command).converged);
        assert_eq!(world.state().base, level);
        most = most.max(world.servo_wrench().0[2]);
    }
    assert!(most > 1.5 * weight, "{most} N: the mount takes the blow");
}

#[test]
fn a_path_is_followed_exactly_and_left_when_the_base_is_let_go() {
    let model = model(&[]);
    let state = State::at_rest(&model, Pose::IDENTITY, &[]);
    let h = model.config().step_s;
    let mut world = World::new(Arc::new(model), state);
    let mut command = Command::stay(world.model(), Pose::IDENTITY);
    let (linear, angular) = (Vec3::new(0.3, 0.0, -0.1), Vec3::new(0.0, 0.5, 0.0));
    for k in 1..=100 {
        let time = f64::from(k) * h;
        let pose = Pose::from_parts(linear * time, Rotation::from_scaled_axis(angular * time));
        command.base = BaseCommand::Exact(BaseReference { pose, linear, angular });
        assert!(world.step(&command).converged);
        assert_eq!(world.state().base, pose);
        let v = &world.state().v;
        let error = (Vec3::new(v[0], v[1], v[2]) - linear).length()
            + (Vec3::new(v[3], v[4], v[5]) - angular).length();
        assert!(error < 1e-12, "{error:e}");
    }
    command.base = BaseCommand::Free;
    let high = world.state().base.translation.z;
    for _ in 0..200 {
        assert!(world.step(&command).converged);
    }
    assert!(world.state().base.translation.z < high - 0.15, "it falls");
    assert_eq!(world.servo_wrench(), ([0.0; 3], [0.0; 3]));
}
