//! Surfaces that only pass each other hold nobody.
//!
//! Contacts are predicted along the normal of the start of the step, as if the surfaces had no end. A body that falls past the edge
//! of a table would be held by the plane that continues the edge. So the motions of two shapes are compared where a pair that bore
//! nothing would carry force across a gap: first with the velocities without contact; shapes that do not meet are left out, and the
//! step is solved again. If they meet with the velocities of that solution, they take part again.

use super::impacts::pull;
use super::resolve_scratch::Passing;
use super::solve::solve;
use super::work::Work;
use crate::contact::advancement::{self, Moving, Sweep};
use crate::contact::narrow_phase::ContactPair;
use crate::dynamics::spatial::SpatialVelocity;
use crate::law::Law;
use crate::model::{Model, Owner};
use crate::solver::island::Island;
use crate::solver::newton::Newton;
use crate::solver::problem::Problem;
use crate::state::State;
use palmares_models::{Pose, Vec3};

/// A smaller gap between free bodies is none, m.
const GAP_M: f64 = 1e-5;

/// Surfaces that move by less than this in a step pass nothing, m.
const WAY_M: f64 = 1e-4;

/// Shapes that overlap by at most this on their way do not meet, m.
const TOUCH_M: f64 = 2e-6;

/// Largest number of solves after which left out pairs that meet take part again; then all do.
const PASSES: usize = 3;

/// Leaves the pairs of a solved step out that only pass each other, and solves it again.
pub(super) fn leave_out(
    model: &Model,
    state: &State,
    work: &mut Work,
    island: &Island,
    (problem, newton): (&mut Problem, &mut Newton),
    v: &mut [f64],
) {
    let acts = |problem: &Problem, work: &Work, k: usize| {
        // In the hand, surfaces within the onset of dissipation count as touching.
        let touching_m = if island.hand { model.config().contact_onset_m } else { GAP_M };
        let pair = &work.collision.contacts.pairs[island.pairs[k]];
        acts_across_a_gap(work, pair, (problem, k), (touching_m, model.config().step_s))
    };
    if !model.has(Law::Passing) || !(0..island.pairs.len()).any(|k| acts(problem, work, k)) {
        return;
    }
    let mut passing = std::mem::take(&mut work.passing);
    let Passing { left_out, rejoined, targets, links } = &mut passing;
    left_out.clear();
    rejoined.clear();
    targets.clear();
    targets.extend(problem.points.iter().map(|point| point.law.target));
    let mut spent = 0;
    for pass in 0..=PASSES {
        // Without those left out, others that bore nothing may carry force: before that is settled, no motion counts.
        for _ in 0..=PASSES {
            let before = left_out.len();
            for k in 0..island.pairs.len() {
                let pair = &work.collision.contacts.pairs[island.pairs[k]];
                if acts(problem, work, k)
                    && !rejoined.contains(&k)
                    && !meet(model, state, work, pair, &mut spent, |owner| free(model, state, work, owner))
                {
                    left_out.push(k);
                }
            }
            if left_out.len() == before {
                break;
            }
            left_out[before..].iter().for_each(|&k| open(problem, k));
            solve(model, work, problem, newton, v);
        }
        if left_out.is_empty() {
            break;
        }
        work.acted.insert(Law::Passing);
        if let (true, Some(hand)) = (island.hand, model.hand()) {
            work.dynamics.kin.velocities(hand, &v[..problem.hand_dofs], links);
        }
        let count = left_out.len();
        left_out.retain(|&k| {
            let pair = &work.collision.contacts.pairs[island.pairs[k]];
            let motion = |owner| match owner {
                Owner::Link(i) if island.hand => link(work, i, links[i]),
                _ => solved_motion(model, state, work, island, problem, v, owner),
            };
            let meet = pass == PASSES || meet(model, state, work, pair, &mut spent, motion);
            if meet {
                let solved = &problem.pairs[k];
                for point in solved.first..solved.end {
                    problem.points[point].law.target = targets[point];
                }
                rejoined.push(k);
            }
            !meet
        });
        if left_out.len() == count {
            break;
        }
        solve(model, work, problem, newton, v);
    }
    work.outcome.work += spent;
    work.passing = passing;
}

/// Lets the `k`-th pair of a problem bear nothing.
fn open(problem: &mut Problem, k: usize) {
    let solved = &problem.pairs[k];
    for point in &mut problem.points[solved.first..solved.end] {
        point.law.target[2] = f64::NEG_INFINITY;
    }
}

/// Whether the `k`-th pair of a problem bore nothing and carries force, and only across a gap of more than
/// `touching_m`, which its surfaces have the speed to pass.
#[inline(always)]
fn acts_across_a_gap(
    work: &Work,
    pair: &ContactPair,
    (problem, k): (&Problem, usize),
    (touching_m, step_s): (f64, f64),
) -> bool {
    let solved = &problem.pairs[k];
    let points = &work.collision.contacts.points[pair.points.clone()];
    let (mut acts, mut far) = (false, false);
    for (point, found) in problem.points[solved.first..solved.end].iter().zip(points) {
        if found.anchor.loaded || found.distance + pair.initial_overlap <= touching_m {
            return false;
        }
        acts |= point.impulse[2] > 0.0;
        // A point without load slips as fast as the surfaces move.
        far |= (found.approach.powi(2) + found.anchor.slip.powi(2)).sqrt() * step_s > WAY_M;
    }
    acts && far
}

/// Whether the shapes of a pair meet in a step with these motions of their bodies.
fn meet(
    model: &Model,
    state: &State,
    work: &Work,
    pair: &ContactPair,
    spent: &mut u64,
    motion: impl Fn(Owner) -> SpatialVelocity,
) -> bool {
    let (i, j) = state.pairs[pair.pair].key;
    let [a, b] = [i, j].map(|i| &model.colliders()[i as usize]);
    if !(a.bounding_radius.is_finite() && b.bounding_radius.is_finite()) {
        return true;
    }
    let h = model.config().step_s;
    let sweep = |owner: Owner| {
        let SpatialVelocity { linear, angular } = motion(owner);
        let start = match owner {
            Owner::Static => Pose::IDENTITY,
            Owner::Link(i) => work.dynamics.kin.pose[i],
            Owner::Object(k) => state.objects[k],
        };
        Sweep { start, way: linear * h, turn: angular * h }
    };
    let (of_a, of_b) = (sweep(a.owner), sweep(b.owner));
    let (a, b) = (Moving { shape: a, sweep: &of_a }, Moving { shape: b, sweep: &of_b });
    advancement::meet(a, b, TOUCH_M, spent)
}

/// Mean velocity of a body in the step without contacts, at its own origin.
fn free(model: &Model, state: &State, work: &Work, owner: Owner) -> SpatialVelocity {
    match owner {
        Owner::Static => SpatialVelocity::ZERO,
        Owner::Link(i) => link(work, i, work.dynamics.recursion.velocity[i]),
        Owner::Object(k) => {
            let (linear, angular) = state.object_velocity(model, k);
            let fallen = pull(model, &work.loads, k) * (0.5 * model.config().step_s);
            SpatialVelocity { linear: linear + fallen, angular }
        }
    }
}

/// A link's velocity, from that at the base's origin.
fn link(work: &Work, i: usize, at_base: SpatialVelocity) -> SpatialVelocity {
    at_base.moved(work.dynamics.kin.pose[i].translation - work.dynamics.kin.origin)
}

/// Velocity of a body in the solution, at its own origin.
fn solved_motion(
    model: &Model,
    state: &State,
    work: &Work,
    island: &Island,
    problem: &Problem,
    v: &[f64],
    owner: Owner,
) -> SpatialVelocity {
    match owner {
        Owner::Object(k) => match island.objects.binary_search(&k) {
            Ok(slot) => {
                let own = &v[problem.hand_dofs + 6 * slot..][..6];
                let [linear, angular] = [&own[..3], &own[3..]].map(Vec3::from_slice);
                SpatialVelocity { linear, angular }
            }
            Err(_) => free(model, state, work, owner),
        },
        _ => free(model, state, work, owner),
    }
}
