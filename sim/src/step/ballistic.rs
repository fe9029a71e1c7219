//! Flight of an object that touches nothing: `x₁ = x₀ + (v₀ + v₁) h/2`, `v₁ = v₀ + h (g + f/m)`, exact under a constant
//! force; its rotation is that of [`super::torque_free`].

use super::torque_free::{omega_at, torque_free};
use crate::model::Model;
use crate::state::State;
use palmares_models::Vec3;

/// Moves an object by a step. `loads` are forces and torques from outside, of every object or of none.
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
