//! Shared data of all islands of a step.

use super::assemble::Input;
use super::continuous::Continuous;
use super::drive::Drive;
use super::forces::StepForces;
use super::impacts::Impacts;
use super::resolve_scratch::{Blend, Joining, Passing};
use super::second_order::SecondOrder;
use crate::actuation::friction::Passes;
use crate::bounds::Fault;
use crate::contact::collide::Collision;
use crate::dynamics::hand::HandDynamics;
use crate::law::Laws;
use crate::model::Model;
use crate::outcome::StepOutcome;
use crate::state::State;
use palmares_models::Vec3;

/// Dynamics, contacts and loads of a step, and its results.
#[derive(Default)]
pub(crate) struct Work {
    pub outcome: StepOutcome,
    /// Laws that acted in the step and whose action does not show in its contacts.
    pub acted: Laws,
    pub fault: Option<Fault>,
    pub forces: StepForces,
    pub dynamics: HandDynamics,
    pub collision: Collision,
    pub drive: Drive,
    pub impacts: Impacts,
    pub joining: Joining,
    /// Repeated solves for the friction of cables.
    pub friction_passes: Passes,
    pub second_order: SecondOrder,
    pub continuous: Continuous,
    pub passing: Passing,
    pub blend: Blend,
    /// Per object: external force, N, and torque about its centre of mass, N·m, during the next step; empty
    /// for none.
    pub loads: Vec<(Vec3, Vec3)>,
}

impl Work {
    /// Inputs of an island's problem.
    pub(super) fn input<'a>(&'a self, model: &'a Model, state: &'a State) -> Input<'a> {
        let Work { dynamics, collision, drive, loads, .. } = self;
        Input { model, state, dynamics, contacts: &collision.contacts, drive, loads }
    }
}
