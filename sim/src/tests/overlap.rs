//! Shapes that start with an overlap.

use crate::{Command, Config, Model, State, World};
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Vec3};
use std::sync::Arc;

/// Two half-overlapping cubes, one of them sunk into the floor, separate slowly and come to rest next to each
/// other.
#[test]
fn deep_overlap_is_taken_back_slowly() {
    for step_s in [0.25e-3, 1e-3, 4e-3, 8e-3] {
        let mut model = Model::new(Config::with_step(step_s), None).expect("an empty world");
        let floor = Shape::Box { half_extents: [1.0, 1.0, 0.1], rounding: 0.0 };
        model.add_static("floor", &floor, Pose::translation(0.0, 0.0, -0.1), 0.5).expect("a floor");
        let cube = Shape::Box { half_extents: [0.03; 3], rounding: 0.0 };
        let object =
            Arc::new(Object::new("cube", vec![(Pose::IDENTITY, cube)], 0.2, 0.5, 0.0).expect("a cube"));
        model.add_object(Arc::clone(&object)).expect("it fits");
        model.add_object(object).expect("it fits");
        let at = [Pose::translation(0.0, 0.0, 0.02), Pose::translation(0.03, 0.0, 0.031)];
        let state = State::at_rest(&model, Pose::IDENTITY, &at);
        let mut world = World::new(Arc::new(model), state);
        let command = Command::stay(world.model(), Pose::IDENTITY);
        let mut fastest = 0.0f64;
        for _ in 0..(2.0 / step_s) as u32 {
            assert!(world.step(&command).converged);
            for v in world.state().v.as_chunks::<6>().0 {
                fastest = fastest.max(Vec3::new(v[0], v[1], v[2]).length());
            }
        }
        assert!(world.outcome().penetration_m < 3e-4, "h {step_s}: {:e}", world.outcome().penetration_m);
        assert!(fastest < 0.6, "h {step_s}: {fastest} m/s");
    }
}

/// Faces of parts that cover each other are cut into ever more pieces: a scene of many such parts is refused, not computed
/// for minutes.
#[test]
fn parts_that_cover_each_other_too_often_are_refused() {
    let turned = |k: usize| {
        Pose::from_parts(
            Vec3::ZERO,
            palmares_models::Rotation::from_scaled_axis(Vec3::new(0.1, 0.2, 0.3) * k as f64),
        )
    };
    let cylinder = Shape::Cylinder { half_length: 0.05, radius: 0.03 };
    let round = |points: usize| {
        let point = |k: usize| {
            let z = 1.0 - 2.0 * (k as f64 + 0.5) / points as f64;
            let (sin, cos) = libm::sincos(2.4 * k as f64);
            let across = 0.05 * (1.0 - z * z).sqrt();
            [across * cos, across * sin, 0.05 * z]
        };
        Shape::Hull { points: (0..points).map(point).collect(), rounding: 0.0 }
    };
    let of = |parts: Vec<(Pose, Shape)>| {
        let mut model = Model::new(Config::default(), None).expect("an empty world");
        model.add_object(Arc::new(Object::new("burr", parts, 1.0, 0.5, 0.0).expect("a burr"))).map(drop)
    };
    of((0..4).map(|k| (turned(k), cylinder.clone())).collect()).expect("few parts are fine");
    let error = of((0..32).map(|k| (turned(k), round(60))).collect()).expect_err("too much work");
    let said = error.to_string();
    assert!(matches!(error, crate::model::ModelError::Overlaps { work, .. } if work < 100_000_000), "{said}");
    assert!(said.starts_with("burr: its shapes up to number") && said.contains("only touch"), "{said}");
}
