//! Sleep: an island without the hand that has been slow for long enough, and does not accelerate, stops. It
//! costs nothing until something touches it.
//!
//! The acceleration follows from the displacements x₁ and x₂ in two successive thirds of that time T: `a = (x₂ − x₁)/(T/3)²`. So a
//! body that rolls up a slope and turns back accelerates also where it stops. In a settling heap the velocities change as much, but
//! not twice in the same direction.

use crate::config::Config;
use crate::model::Model;
use crate::solver::island::Island;
use crate::state::{Sleep, State};
use std::array::from_fn;

/// Changes of a mean velocity up to this are rounding, m/s.
const ROUNDING: f64 = 1e-5;

/// Those of a settling heap are up to this at the surfaces, m/s.
const NOISE: f64 = 2e-4;

/// A motion whose velocity changes by at most this part of the change before dies away, towards the sum of a geometric series.
const DECAY: f64 = 0.7;

/// A body that moves on evenly, faster than this part of the limits of speed, is not at rest.
const CREEP: f64 = 0.25;

/// Counts the steps an island has been still, and stops it after enough of them.
pub(super) fn update(model: &Model, state: &mut State, island: &Island) {
    let config = model.config();
    if !config.sleeping {
        return;
    }
    let third = (config.sleep_after_s / config.step_s / 3.0).ceil() as u32;
    let mut all = !island.hand && !island.pairs.is_empty();
    for &k in &island.objects {
        let (linear, angular) = state.object_velocity(model, k);
        let at = model.object_dofs(k);
        let (sleep, v) = (&mut state.sleep[k], &state.v[at..at + 6]);
        let still = linear.length_squared() < config.sleep_linear.powi(2)
            && angular.length_squared() < config.sleep_angular.powi(2);
        if !still {
            *sleep = Sleep::default();
            all = false;
            continue;
        }
        let now = (sleep.still_steps / third).min(2) as usize;
        sleep.moved[now].iter_mut().zip(v).for_each(|(moved, v)| *moved += config.step_s * v);
        sleep.still_steps += 1;
        if sleep.still_steps == 3 * third {
            sleep.rests =
                rests(config, &sleep.moved, f64::from(third) * config.step_s, model.object_radius(k));
            sleep.moved = [sleep.moved[1], sleep.moved[2], [0.0; 6]];
            sleep.still_steps = 2 * third;
        }
        all &= sleep.rests;
    }
    if all {
        for &k in &island.objects {
            let at = model.object_dofs(k);
            state.v[at..at + 6].fill(0.0);
            state.sleep[k] = Sleep { asleep: true, ..Sleep::default() };
        }
    }
}

/// Whether a body with these displacements, m and rad, in three successive times, s, is at rest.
fn rests(config: &Config, moved: &[[f64; 6]; 3], time_s: f64, radius: f64) -> bool {
    let mean = |k: usize, part: usize| -> [f64; 3] { from_fn(|i| moved[k][3 * part + i] / time_s) };
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let gained = |k: usize, part: usize| -> [f64; 3] {
        let [before, after] = [k, k + 1].map(|k| mean(k, part));
        from_fn(|i| after[i] - before[i])
    };
    let parts = [
        (config.sleep_linear, config.sleep_acceleration, 1.0),
        (config.sleep_angular, config.sleep_angular_acceleration, 1.0 / radius),
    ];
    parts.into_iter().enumerate().all(|(part, (speed, acceleration, times))| {
        let (mean, earlier, gain) = (mean(2, part), gained(0, part), gained(1, part));
        let size = dot(gain, gain).sqrt();
        let slow = acceleration * time_s;
        let before = dot(earlier, earlier).sqrt();
        let again = dot(gain, earlier) > 0.5 * size * before;
        let steady = size <= slow + times * ROUNDING || size <= slow + times * NOISE && !again;
        let dies = size <= DECAY * before && {
            let rest = size / (before - size);
            let end: [f64; 3] = from_fn(|i| mean[i] + rest * gain[i]);
            dot(end, end).sqrt() <= CREEP * speed
        };
        steady && dot(mean, mean).sqrt() <= CREEP * speed || dies
    })
}

#[cfg(test)]
mod tests {
    use crate::{Command, Config, Model, State, World};
    use palmares_models::object::Object;
    use palmares_models::shape::Shape;
    use palmares_models::{Pose, Vec3};
    use std::sync::Arc;

    #[test]
    fn a_box_at_rest_sleeps_wakes_when_it_is_hit_and_stands() {
        let mut model = Model::new(Config::default(), None).expect("no hand");
        model.add_ground(0.0, 0.5);
        for name in ["below", "above"] {
            let cube = Shape::Box { half_extents: [0.05; 3], rounding: 0.0 };
            let object = Object::new(name, vec![(Pose::IDENTITY, cube)], 1.0, 0.5, 0.0).expect("sound");
            model.add_object(Arc::new(object)).expect("it fits");
        }
        let poses = [Pose::translation(0.0, 0.0, 0.05), Pose::translation(0.0, 0.0, 2.0)];
        let state = State::at_rest(&model, Pose::IDENTITY, &poses);
        let mut world = World::new(Arc::new(model), state);
        let command = Command::stay(world.model(), Pose::IDENTITY);
        for _ in 0..500 {
            world.step(&command);
        }
        assert!(world.state().sleep[0].asleep && !world.state().sleep[1].asleep);
        assert_eq!(world.state().object_velocity(world.model(), 0), (Vec3::ZERO, Vec3::ZERO));
        let mut woke = false;
        for _ in 0..200 {
            world.step(&command);
            woke |= !world.state().sleep[0].asleep;
        }
        assert!(woke, "the upper box has fallen on it");
        // It rests on the body that it slept on.
        for _ in 0..500 {
            world.step(&command);
        }
        let height = |k: usize| world.state().objects[k].translation.z;
        assert!(
            (height(0) - 0.05).abs() < 1e-4 && (height(1) - 0.15).abs() < 2e-4,
            "{} {}",
            height(0),
            height(1)
        );
    }

    /// A box on the ground.
    fn resting(step_s: f64) -> World {
        let mut model = Model::new(Config::with_step(step_s), None).expect("no hand");
        model.add_ground(0.0, 0.5);
        let cube = Shape::Box { half_extents: [0.05; 3], rounding: 0.0 };
        let object = Object::new("cube", vec![(Pose::IDENTITY, cube)], 1.0, 0.5, 0.0).expect("sound");
        model.add_object(Arc::new(object)).expect("it fits");
        let state = State::at_rest(&model, Pose::IDENTITY, &[Pose::translation(0.0, 0.0, 0.05)]);
        World::new(Arc::new(model), state)
    }

    #[test]
    fn longer_steps_take_over_the_time_of_stillness() {
        let (mut exact, mut coarse) = (resting(0.001), resting(0.005));
        let command = Command::stay(exact.model(), Pose::IDENTITY);
        for _ in 0..100 {
            exact.step(&command);
        }
        let still = exact.state().sleep[0].still_steps;
        assert!(still > 50 && !exact.state().sleep[0].asleep, "{still}");
        coarse.resume_from_steps(&exact.snapshot(), 0.001);
        assert_eq!(coarse.state().sleep[0].still_steps, still / 5);
        coarse.step(&command);
        assert!(!coarse.state().sleep[0].asleep);
    }
}
