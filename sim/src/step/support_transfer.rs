//! A lone object that tips from one support to another within a step.
//!
//! Implicit Euler applies the contacts at a step's end during the whole step. A block that rocks onto its
//! other edge would be supported by that edge from the start of the step, and the load of the old edge until
//! the impact would be lost: the angular velocity after the impact is off by up to `h Δα`, with the
//! difference Δα, rad/s², of gravity's effect about either edge. So the part s of a step before the first new
//! point is hit proceeds without the new points. Solved without them, the step has the impulses γ₀, N·s, and
//! then, in the signs of [`crate::solver`],
//!
//! `A (v − v*) = s Jᵀ γ₀ + Jᵀ γ`, `s = min φ / (−u_n h)`
//!
//! with the gap φ, m, of the new points and their normal velocity u_n, m/s, without the hit. A point's law
//! gives `γ + s γ₀`, that is, γ for the target `v̂ − s R γ₀`. While all supports continue to bear this is the
//! solution of the plain step; a support that lets go has carried its share.
//!
//! A block of 40 x 120 mm keeps `1 − 3/2 sin² α = 0.850` of its angular velocity in an impact (Housner 1963,
//! *The behavior of inverted pendulum structures during earthquakes*, α from the vertical to the diagonal).
//! Over the first three impacts, steps of 0.25 to 4 ms give 0.832 to 0.848; without this file 0.72 to 0.85.
//! In the hand, where many points are hit in one step, the correction changed more outcomes of grasps from
//! step to step than it saved, so it is limited to lone objects.

use super::solve::solve;
use super::work::Work;
use crate::contact::narrow_phase::Contacts;
use crate::law::Law;
use crate::model::{Model, Owner};
use crate::solver::island::Island;
use crate::solver::newton::Newton;
use crate::solver::problem::Problem;

/// Scratch memory of a transfer.
#[derive(Default)]
pub(crate) struct SupportTransfer {
    /// Points that are hit, by their indices in the problem, and their gaps, m.
    hits: Vec<(usize, f64)>,
    /// v̂ of every point, m/s.
    targets: Vec<[f64; 4]>,
    /// s γ₀ of every point, N·s.
    carried: Vec<[f64; 4]>,
    /// Velocities without the hit.
    unhit: Vec<f64>,
}

/// Solves a step again in which a lone object is hit at new points, if old points would carry less than their
/// load until then. `problem` is solved, `v` its solution. True if it was solved again: its points then have
/// their total load in the step, and its momentum and rolling resistance are those of the second solve.
pub(super) fn transfer(
    model: &Model,
    work: &mut Work,
    island: &Island,
    (problem, newton): (&mut Problem, &mut Newton),
    v: &mut [f64],
    scratch: &mut SupportTransfer,
) -> bool {
    let h = model.config().step_s;
    let alone = island.is_lone_object() && model.has(Law::SupportTransfer);
    if !alone || !is_due(&work.collision.contacts, island, problem, h, &mut scratch.hits) {
        return false;
    }
    work.acted.insert(Law::SupportTransfer);
    let SupportTransfer { hits, targets, carried, unhit } = scratch;
    targets.clear();
    targets.extend(problem.points.iter().map(|point| point.law.target));
    for &(k, _) in &*hits {
        problem.points[k].law.target[2] = f64::NEG_INFINITY;
    }
    unhit.clear();
    unhit.extend_from_slice(v);
    solve(model, work, problem, newton, unhit);
    let mut part = 1.0;
    for &(k, gap) in &*hits {
        let point = &mut problem.points[k];
        part = (gap / (-point.velocity[2] * h).max(gap)).min(part);
        point.law.target = targets[k];
    }
    carry(problem, part, carried);
    solve(model, work, problem, newton, v);
    for ((point, target), carried) in problem.points.iter_mut().zip(targets).zip(carried) {
        point.law.target = *target;
        for (impulse, carried) in point.impulse.iter_mut().zip(carried) {
            *impulse += *carried;
        }
    }
    true
}

/// Finds the points that are hit. True if a loaded point carries less in the solution than in the last step,
/// up to the first hit.
fn is_due(
    contacts: &Contacts,
    island: &Island,
    problem: &Problem,
    h: f64,
    hits: &mut Vec<(usize, f64)>,
) -> bool {
    hits.clear();
    let mut part = 1.0;
    let points = || {
        island.pairs.iter().zip(&problem.pairs).flat_map(|(&index, solved)| {
            let pair = &contacts.pairs[index];
            let found = contacts.points[pair.points.clone()].iter();
            (solved.first..solved.end).zip(found.map(move |point| (point, pair.initial_overlap)))
        })
    };
    for (k, (point, overlap)) in points() {
        let gap = point.distance + overlap;
        if point.rebound.is_some() {
            return false;
        }
        if !point.anchor.loaded && problem.points[k].impulse[2] > 0.0 && gap > 0.0 {
            hits.push((k, gap));
            part = (gap / (-point.approach * h).max(gap)).min(part);
        }
    }
    !hits.is_empty()
        && points().any(|(k, (point, _))| {
            point.anchor.loaded && problem.points[k].impulse[2] < part * h * point.anchor.normal_force
        })
}

/// Adds the points' impulses in the first `part` of the step to the momentum of the lone object, and
/// subtracts them from their laws.
fn carry(problem: &mut Problem, part: f64, carried: &mut Vec<[f64; 4]>) {
    carried.clear();
    let Problem { objects, pairs, points, momentum, .. } = problem;
    let center = objects[0].center;
    for pair in pairs {
        let sign = if matches!(pair.b, Owner::Object(_)) { 1.0 } else { -1.0 };
        pair.rolling.limit *= 1.0 - part;
        for point in &mut points[pair.first..pair.end] {
            let [t1, t2, n, s] = point.impulse.map(|impulse| part * impulse);
            carried.push([t1, t2, n, s]);
            let law = &mut point.law;
            law.target[0] -= t1 / law.tangential;
            law.target[1] -= t2 / law.tangential;
            law.target[2] -= n / law.normal;
            law.target[3] -= s / law.tangential;
            let [normal, friction] = point.parts([t1, t2, n, s]).map(|part| part * sign);
            let arm = pair.origin - center;
            let moment = (arm + point.r).cross(normal) + (arm + point.friction_r).cross(friction);
            let moment = moment + point.torque([t1, t2, n, s]) * sign;
            let force = normal + friction;
            let wrench = [force.x, force.y, force.z, moment.x, moment.y, moment.z];
            momentum.iter_mut().zip(wrench).for_each(|(momentum, x)| *momentum += x);
        }
    }
}
