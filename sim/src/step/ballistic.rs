//! Free flight of an object without contact: `x₁ = x₀ + (v₀ + v₁) h/2`, `v₁ = v₀ + h (g + f/m)`, exact under
//! a constant force; [`super::torque_free`] gives its rotation.

use super::torque_free::{omega_at, torque_free};
use crate::model::Model;
use crate::state::State;
use palmares_models::Vec3;

/// Moves an object by a step. `loads` are the external forces and torques of every object, or empty.
pub(super) fn fly(model: &Model, state: &mut State, loads: &[(Vec3, Vec3)], object: usize) {
    let config = model.config();
    let (h, at) = (config.step_s, model.object_dofs(object));
    let (before, mut omega) = state.object_velocity(model, object);
    let inverse = model.object_inertia_inverse(object);
    let mut after = before + config.gravity * h;
    if let Some((force, torque)) = loads.get(object) {
        after += *force * (h / model.objects()[object].mass);
        omega += omega_at(state.objects[object].rotation, inverse, *torque * h);
    }
    let pose = &mut state.objects[object];
    let (rotation, angular) = torque_free(pose.rotation, omega, model.objects()[object].inertia, inverse, h);
    pose.translation += (before + after) * (0.5 * h);
    pose.rotation = rotation;
    let v = &mut state.v[at..at + 6];
    v[..3].copy_from_slice(&after.to_array());
    v[3..].copy_from_slice(&angular.to_array());
}

#[cfg(test)]
mod tests {
    use crate::{Command, Config, Model, State, World};
    use palmares_models::object::Object;
    use palmares_models::shape::Shape;
    use palmares_models::{Pose, Vec3};
    use std::sync::Arc;

    /// With any step, a thrown ball is on its parabola, and its spin stays.
    #[test]
    fn a_thrown_ball_is_on_its_parabola_at_every_step() {
        let (start, thrown, spin) =
            (Vec3::new(0.1, 0.2, 3.0), Vec3::new(1.0, -0.5, 4.0), Vec3::new(3.0, 2.0, 1.0));
        for step_s in [1e-3, 16e-3] {
            let mut model = Model::new(Config::with_step(step_s), None).expect("an empty world");
            let parts = vec![(Pose::IDENTITY, Shape::Sphere { radius: 0.05 })];
            model
                .add_object(Arc::new(Object::new("ball", parts, 0.3, 0.5, 0.0).expect("a ball")))
                .expect("it fits");
            let at = Pose::translation(start.x, start.y, start.z);
            let mut state = State::at_rest(&model, Pose::IDENTITY, &[at]);
            state.v = [thrown.to_array(), spin.to_array()].concat();
            let gravity = model.config().gravity;
            let mut world = World::new(Arc::new(model), state);
            let command = Command::stay(world.model(), Pose::IDENTITY);
            for _ in 0..(0.8 / step_s) as u32 {
                world.step(&command);
                let t = world.state().time_s(world.model());
                let expected = start + thrown * t + gravity * (0.5 * t * t);
                let (velocity, angular) = world.state().object_velocity(world.model(), 0);
                assert!((world.state().objects[0].translation - expected).length() < 1e-12, "{t} s");
                assert!((velocity - thrown - gravity * t).length() < 1e-12, "{t} s");
                assert!((angular - spin).length() < 1e-12, "{t} s: {angular}");
            }
        }
    }
}
