//! The interface of an engine: it steps a scene and mirrors it into a [`State`].

use anyhow::Result;
use palmares_models::{Mat3, Vec3};
use palmares_sim::{Command, ContactForce, Model, State, StepOutcome, World};
use std::fmt::Debug;
use std::sync::Arc;

/// Contacts at least this stiff, N/m, represent rigid bodies: peers get the settings that serve them best there.
pub const RIGID: f64 = 1e9;

/// The time of a step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cost {
    /// CPU time of the stepping thread, less that of reading the clock and of what an adapter adds that its engine has not, s.
    pub total_s: f64,
    /// Wall time by phase (dynamics, collision, solver), s; zeros where the engine does not report
    /// it. Only the ratios are used.
    pub phases_s: [f64; 3],
}

/// An engine with its settings, which a case starts for each of its scenes.
pub trait EngineFactory: Debug + Sync {
    /// Name of the engine, as on the command line.
    fn name(&self) -> &'static str;
    /// Name of its settings, as on the command line.
    fn settings(&self) -> &'static str;
    /// An engine about to take its first step from `state`.
    ///
    /// # Errors
    /// The engine cannot simulate this scene, or cannot be started.
    fn start(&self, model: Arc<Model>, state: State) -> Result<Box<dyn Engine>>;
}

/// An engine that steps one scene.
pub trait Engine {
    /// The scene.
    fn model(&self) -> &Arc<Model>;
    /// One step of the length the engine was made with.
    fn step(&mut self, command: &Command) -> Result<Cost>;
    /// Poses, coordinates, velocities and tensions now.
    fn state(&self) -> &State;
    /// Poses and velocities to set; the engine continues from them.
    fn state_mut(&mut self) -> &mut State;
    /// Applies a force and a torque about its centre of mass to an object during the next step, in the world's axes. The
    /// default applies their impulse over the step, as a semi-implicit engine does.
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
    /// The outcome of the last step. Peers fill in the deepest overlap and whether all numbers are finite.
    fn outcome(&self) -> StepOutcome;
    /// Touching contacts of the last step and their forces; empty where the engine does not report them.
    fn contacts(&mut self) -> Result<Vec<ContactForce>> {
        Ok(self.world().map_or(Vec::new(), |world| world.contact_forces().to_vec()))
    }
    /// Our own world, for figures that only it has (contact forces, joint residuals).
    fn world(&self) -> Option<&World> {
        None
    }
}
