//! One step: forces and contacts at the start, one convex solve for the velocities at the end, integration.
//!
//! 1. [`prepare`]: dynamics of the hand, then [`collide`].
//! 2. `actuate`: motors and the base's set point follow the command; external forces act.
//! 3. Islands: bodies that touch each other are solved together.
//! 4. For each island, [`island::step`]: the integrator of the highest order that takes the step; or free flight of an object
//!    without contact.
//! 5. [`sleep::update`]: an island that has been still for long enough falls asleep.
//! 6. [`continuous::stop_short`]: fast bodies stop before they pass through others.

mod assemble;
mod ballistic;
mod bdf2;
mod blow_energy;
mod cash_karp;
mod contact_memory;
mod continuous;
mod dead_blow;
mod drive;
mod euler;
mod forces;
mod friction_passes;
mod impacts;
mod integrate;
mod island;
mod joining;
mod known_blows;
mod method;
mod midpoint_correction;
mod momentum;
mod passing;
mod resolve_scratch;
mod rim;
mod rolling;
mod scratch;
mod second_order;
mod sleep;
mod slip_correction;
mod slip_passes;
mod solve;
mod support_transfer;
mod torque_free;
mod twist_damping;
mod work;
mod workspace;

pub(crate) use forces::StepForces;
pub(crate) use scratch::Scratch;
pub use workspace::SharedScratch;

use crate::actuation::base;
use crate::actuation::{clutch, motor};
use crate::bounds::{Fault, hand_work, step_work};
use crate::command::{BaseCommand, Command};
use crate::contact::collide::collide;
use crate::law::{Law, Laws};
use crate::model::Model;
use crate::outcome::{PhaseTimer, StepOutcome, StepPhase};
use crate::state::{BaseReference, State};
use drive::Drive;
use palmares_models::Vec3;
use work::Work;

/// Advances `state` by one step and notifies `timer` at the end of each phase. With a fault the state stays
/// unchanged, unless the fault is found while the step is solved.
pub(crate) fn step(
    model: &Model,
    state: &mut State,
    scratch: &mut Scratch,
    command: &Command,
    timer: &mut impl PhaseTimer,
) {
    prepare(model, state, scratch, timer);
    let spent = scratch.prepared.take().unwrap_or_default();
    let work = &mut scratch.work;
    (work.outcome, work.acted) = (StepOutcome::default(), Laws::default());
    if work.fault.is_some() {
        return;
    }
    actuate(model, state, &mut work.drive, command);
    work.dynamics.add_pushes(model, &work.drive.pushes);
    solve_islands(model, state, scratch, spent);
    if scratch.work.outcome.work > step_work(model.objects().len()) {
        scratch.work.fault = Some(Fault::WorkExhausted);
    }
    state.step += 1;
    timer.ended(StepPhase::Solver);
}

/// The part of a step that does not depend on its command: the hand's dynamics and the search for contacts.
/// Does nothing if already done.
pub(crate) fn prepare(model: &Model, state: &mut State, scratch: &mut Scratch, timer: &mut impl PhaseTimer) {
    if scratch.prepared.is_some() {
        return;
    }
    scratch.prepared = Some(0);
    let Work { dynamics, collision, fault, .. } = &mut scratch.work;
    *fault = fault.or_else(|| state.fault());
    if fault.is_some() {
        return;
    }
    let links = model.hand().map_or(0, |hand| hand.links.len());
    dynamics.update(model, false, state.base, &state.q, &state.v);
    timer.ended(StepPhase::Dynamics);
    let spent = collide(model, state, dynamics, collision, hand_work(links, model.hand_dofs()));
    scratch.prepared = Some(spent);
    if spent > step_work(model.objects().len()) {
        *fault = Some(Fault::WorkExhausted);
    }
    timer.ended(StepPhase::Collision);
}

/// Motors and the base's set point follow the command.
fn actuate(model: &Model, state: &mut State, drive: &mut Drive, command: &Command) {
    let Some(hand) = model.hand() else { return };
    drive.pushes.clear();
    drive.pushes.extend_from_slice(&command.pushes);
    drive.servo_on = command.base != BaseCommand::Free;
    drive.bolted = drive.servo_on && model.config().base.bolted;
    if !drive.servo_on {
        let [linear, angular] = [&state.v[..3], &state.v[3..6]].map(Vec3::from_slice);
        state.reference = BaseReference { pose: state.base, linear, angular };
    }
    base::advance(model.config(), state.base, &mut state.reference, &command.base);
    clutch::advance(hand, state);
    for (motor, effort) in state.motors.iter_mut().zip(&command.effort) {
        motor.effort = effort.clamp(0.0, 1.0);
    }
    let step_s = model.config().step_s;
    for (i, motor) in hand.motors.iter().enumerate() {
        let mut motor_state = state.motors[i];
        let sigma = command.sigma.get(i).copied().unwrap_or(motor_state.command);
        motor::advance(motor, &mut motor_state, sigma, step_s, |change| {
            // It moves with the solution of the step.
            if motor.slows() { 0.0 } else { clutch::allowed(hand, i, change, state) }
        });
        state.motors[i] = motor_state;
    }
}

/// Partitions the bodies into islands and steps each; `spent` is the computing of the step up to here.
fn solve_islands(model: &Model, state: &mut State, scratch: &mut Scratch, spent: u64) {
    let mut islands = std::mem::take(&mut scratch.islands);
    let work = &mut scratch.work;
    islands.update(model, &work.collision.contacts);
    joining::at_once(model, state, work, &mut islands);
    work.continuous.begin(state);
    work.forces.begin(&state.sleep);
    work.impacts.of_objects.resize(model.objects().len(), None);
    let points = &work.collision.contacts.points;
    work.outcome =
        StepOutcome { converged: true, points: points.len(), work: spent, ..StepOutcome::default() };
    for point in points {
        work.outcome.penetration_m = work.outcome.penetration_m.max(-point.distance);
    }
    let (mut solved, mut coupled) = (0, 0);
    for island in islands.list_mut() {
        if let (false, [object]) = (island.hand, island.objects.as_slice())
            && state.sleep[*object].asleep
        {
            continue;
        }
        if scratch.work.outcome.work > step_work(model.objects().len()) {
            break;
        }
        if !island.hand && island.pairs.is_empty() {
            ballistic::fly(model, state, &scratch.work.loads, island.objects[0]);
        } else {
            // Lone objects all have the same ordering: they share the first solver, which stays in the
            // processor's cache.
            coupled += usize::from(!island.is_lone_object());
            let slot = if island.is_lone_object() { 0 } else { coupled };
            island::step(model, state, scratch, island, slot);
            solved += 1;
        }
        sleep::update(model, state, island);
    }
    let Work { continuous, collision, outcome, acted, .. } = &mut scratch.work;
    let stopped = continuous::stop_short(model, state, continuous, collision, &mut outcome.work);
    acted.insert_if(Law::ContinuousMotion, stopped);
    scratch.work.loads.clear();
    scratch.work.outcome.islands = solved;
    scratch.work.outcome.asleep = state.sleep.iter().filter(|sleep| sleep.asleep).count();
    scratch.islands = islands;
}
