//! What all islands of a step read and write.

use super::assemble::Input;
use super::continuous::Continuous;
use super::drive::Drive;
use super::forces::StepForces;
use super::impacts::Impacts;
use crate::bounds::Fault;
use crate::contact::collide::Collision;
use crate::dynamics::hand::HandDynamics;
use crate::model::Model;
use crate::outcome::Outcome;
use crate::state::State;
use palmares_models::Vec3;

/// Dynamics, contacts and loads of a step, and what it tells of itself.
#[derive(Default)]
pub(crate) struct Work {
    pub outcome: Outcome,
    pub fault: Option<Fault>,
    pub forces: StepForces,
    pub dynamics: HandDynamics,
    pub collision: Collision,
    pub drive: Drive,
    pub impacts: Impacts,
    pub continuous: Continuous,
    /// Of every object: force, N, and torque about its centre of mass, N·m, from outside during the next step; empty for
    /// none.
    pub loads: Vec<(Vec3, Vec3)>,
}

impl Work {
    /// What an island's problem is assembled from.
    pub(super) fn input<'a>(&'a self, model: &'a Model, state: &'a State) -> Input<'a> {
        let Work { dynamics, collision, drive, loads, .. } = self;
        Input { model, state, dynamics, contacts: &collision.contacts, drive, loads }
    }
}
