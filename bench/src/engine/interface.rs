//! What every engine does: steps a scene and mirrors it into a [`State`].

use anyhow::Result;
use palmares_models::{Mat3, Vec3};
use palmares_sim::{Command, ContactForce, Model, State, StepOutcome, World};
use std::sync::Arc;

/// Contacts at least this stiff, N/m, stand for rigid bodies: peers get what serves them best there.
pub const RIGID: f64 = 1e9;

/// What a step cost.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cost {
    /// CPU time of the stepping thread, less what reading the clock cost, s.
    pub total_s: f64,
    /// Wall time by phase (dynamics, collision, solver), s; zeros where the engine does not tell. Only the
    /// ratios are used.
    pub phases_s: [f64; 3],
}

/// Something that steps a scene.
pub trait Engine {
    /// The scene.
    fn model(&self) -> &Arc<Model>;
    /// One step of the length the engine was made with.
    fn step(&mut self, command: &Command) -> Result<Cost>;
    /// Poses, coordinates, velocities and tensions now.
    fn state(&self) -> &State;
    /// Sets poses and velocities by hand; the engine goes on from them.
    fn state_mut(&mut self) -> &mut State;
    /// Lets a force and a torque about its centre of mass act on an object during the next step, in the world's axes:
    /// by default as the impulse they have over it, which is what a semi-implicit engine makes of them.
    fn push(&mut self, object: usize, force: Vec3, torque: Vec3) {
        let model = Arc::clone(self.model());
        let h = model.config().step_s;
        let turn = Mat3::from_quat(self.state().objects[object].rotation);
        let kick = turn * (model.object_inertia_inverse(object) * (turn.transpose() * torque)) * h;
        let speed = force * (h / model.objects()[object].mass);
        let at = model.object_dofs(object);
        let change = speed.to_array().into_iter().chain(kick.to_array());
        for (v, change) in self.state_mut().v[at..at + 6].iter_mut().zip(change) {
            *v += change;
        }
    }
    /// How the last step went. Peers fill in the deepest overlap and whether all numbers are finite.
    fn outcome(&self) -> StepOutcome;
    /// Touching contacts of the last step and their forces; none where the engine does not tell.
    fn contacts(&mut self) -> Result<Vec<ContactForce>> {
        Ok(self.world().map_or(Vec::new(), |world| world.contact_forces().to_vec()))
    }
    /// Our own world, for figures that only it has (contact forces, joint residuals).
    fn world(&self) -> Option<&World> {
        None
    }
}
