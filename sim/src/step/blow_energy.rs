//! Blows of an island with friction add no energy.
//!
//! Newton's law, `v_n⁺ = −e v_n⁻`, together with Coulomb's can add energy where slip turns round in a blow, or where a body is hit in
//! several points (Kane and Levinson 1985; Stronge 1991). The plastic solution with impulses p₀, in which no point rebounds, always
//! takes energy: `½ p₀·(u⁻ + u⁺) ≤ 0`, with the velocities u of the points before and after. So does every
//!
//! `p(s) = p₀ + s (p₁ − p₀)`, `0 ≤ s ≤ 1`
//!
//! whose work W(s), a quadratic function, is at most 0; p₁ is the solution with the rebounds of Newton's law. The island takes the
//! largest such s. Impulses stay in the friction cone, and bodies do not approach, because both hold for p₀ and p₁.

use super::impacts::{Bodies, on_object};
use super::resolve_scratch::Blend;
use super::solve::solve;
use super::work::Work;
use crate::contact::narrow_phase::ContactPair;
use crate::dynamics::spatial::SpatialVelocity;
use crate::law::Law;
use crate::model::{Model, Owner};
use crate::solver::island::Island;
use crate::solver::newton::Newton;
use crate::solver::problem::{PairProblem, Problem};
use crate::state::State;
use palmares_models::Vec3;

/// Work up to this part of the exchanged work is rounding.
const ROUNDING: f64 = 1e-12;

/// Replaces the solution of a step by the blend of it and the plastic one, if its rebounds add energy.
pub(super) fn limit(
    model: &Model,
    state: &State,
    work: &mut Work,
    island: &Island,
    (problem, newton): (&mut Problem, &mut Newton),
    v: &mut Vec<f64>,
) {
    if !model.rebounds() || !model.has(Law::BlowEnergy) {
        return;
    }
    let mut blend = std::mem::take(&mut work.blend);
    blend.times.clear();
    blend.times.resize(island.objects.len(), f64::INFINITY);
    if time_rebounds(work, island, problem, &mut blend.times) {
        let [done, exchanged] = work_of((model, state), work, island, problem, &blend.times, v, None);
        if done > ROUNDING * exchanged {
            work.acted.insert(Law::BlowEnergy);
            take_plastic(model, state, work, island, (problem, newton), v, &mut blend);
        }
    }
    work.blend = blend;
}

/// Solves the step without rebounds, and blends.
fn take_plastic(
    model: &Model,
    state: &State,
    work: &mut Work,
    island: &Island,
    (problem, newton): (&mut Problem, &mut Newton),
    v: &mut Vec<f64>,
    blend: &mut Blend,
) {
    blend.v.clone_from(v);
    blend.rebounding.clear();
    blend.rebounding.extend(problem.points.iter().map(|point| [point.impulse, point.velocity]));
    let Work { collision, loads, .. } = &*work;
    let (bodies, h) = (Bodies { model, state, loads }, model.config().step_s);
    for (&index, solved) in island.pairs.iter().zip(&problem.pairs) {
        let pair = &collision.contacts.pairs[index];
        let points = &collision.contacts.points[pair.points.clone()];
        for (point, found) in problem.points[solved.first..solved.end].iter_mut().zip(points) {
            if let Some(rebound) = found.rebound.filter(|rebound| rebound.time_s.is_finite()) {
                let pull = (bodies.pull(pair.b) - bodies.pull(pair.a)).dot(found.normal);
                point.law.target = [0.0, 0.0, pull * (h - rebound.time_s), 0.0];
            }
        }
    }
    solve(model, work, problem, newton, v);
    time_rebounds(work, island, problem, &mut blend.times);
    let s = largest_part(model, state, work, island, problem, v, blend);
    let mix = |plastic: &mut f64, rebounding: f64| *plastic += s * (rebounding - *plastic);
    v.iter_mut().zip(&blend.v).for_each(|(v, with)| mix(v, *with));
    for (point, [impulse, velocity]) in problem.points.iter_mut().zip(&blend.rebounding) {
        point.impulse.iter_mut().zip(impulse).for_each(|(p, with)| mix(p, *with));
        point.velocity.iter_mut().zip(velocity).for_each(|(u, with)| mix(u, *with));
    }
}

/// The largest part s of the rebounds whose work W(s) is at most 0.
fn largest_part(
    model: &Model,
    state: &State,
    work: &Work,
    island: &Island,
    problem: &Problem,
    v: &[f64],
    blend: &Blend,
) -> f64 {
    let work_at =
        |s: f64| work_of((model, state), work, island, problem, &blend.times, v, Some((s, blend)))[0];
    let [none, half, all] = [0.0, 0.5, 1.0].map(work_at);
    if all <= 0.0 {
        return 1.0;
    }
    if none >= 0.0 {
        return 0.0;
    }
    // W(s) = a s² + b s + c with c < 0 < W(1): one root is between.
    let (a, b, c) = (2.0 * (none + all - 2.0 * half), 4.0 * half - 3.0 * none - all, none);
    let root = (b * b - 4.0 * a * c).max(0.0).sqrt();
    let s = if b >= 0.0 { -2.0 * c / (b + root) } else { (root - b) / (2.0 * a) };
    s.clamp(0.0, 1.0) * (1.0 - ROUNDING)
}

/// Lowers the times of an island's objects to their first rebound with an impulse; true if there is any.
fn time_rebounds(work: &Work, island: &Island, problem: &Problem, times: &mut [f64]) -> bool {
    let mut any = false;
    for (&index, solved) in island.pairs.iter().zip(&problem.pairs) {
        let pair = &work.collision.contacts.pairs[index];
        if pair.restitution == 0.0 {
            continue;
        }
        let points = &work.collision.contacts.points[pair.points.clone()];
        for (point, found) in problem.points[solved.first..solved.end].iter().zip(points) {
            let Some(rebound) = found.rebound else { continue };
            if !rebound.time_s.is_finite() || point.impulse[2] <= 0.0 {
                continue;
            }
            any = true;
            for k in [pair.a, pair.b].into_iter().filter_map(on_object) {
                if let Ok(slot) = island.objects.binary_search(&k) {
                    times[slot] = times[slot].min(rebound.time_s);
                }
            }
        }
    }
    any
}

/// The energy that an island gains in its rebounds, and the sum of what goes to and fro in them, J. `with` are the impulses and
/// velocities to which a part s of the way from the solution leads. Free bodies: the change of their kinetic energy, less what
/// springs of other contacts return, if they held anything. With the hand: the work of the rebounding points.
fn work_of(
    (model, state): (&Model, &State),
    work: &Work,
    island: &Island,
    problem: &Problem,
    times: &[f64],
    v: &[f64],
    with: Option<(f64, &Blend)>,
) -> [f64; 2] {
    let mixed = |i: usize| with.map_or(v[i], |(s, blend)| v[i] + s * (blend.v[i] - v[i]));
    let h = model.config().step_s;
    let bodies = Bodies { model, state, loads: &work.loads };
    let (mut by_rebounds, mut returned, mut exchanged) = (0.0, 0.0, 0.0);
    for (&index, solved) in island.pairs.iter().zip(&problem.pairs) {
        let pair = &work.collision.contacts.pairs[index];
        let before = start_velocity((model, state), work, island, problem, solved, pair);
        let mut pulls = [Vec3::ZERO; 2];
        for (sign, owner) in [(-1.0, pair.a), (1.0, pair.b)] {
            let slot = on_object(owner).and_then(|k| island.objects.binary_search(&k).ok());
            let time = slot.map_or(0.0, |slot| times[slot].min(h));
            let pull = bodies.pull(owner) * sign;
            // Gravity until the blow, and after it.
            pulls[0] += pull * time;
            pulls[1] += pull * (time - h);
        }
        let points = &work.collision.contacts.points[pair.points.clone()];
        for (k, found) in (solved.first..solved.end).zip(points) {
            let point = &problem.points[k];
            let ([mut impulse, mut velocity], axes) = ([point.impulse, point.velocity], point.axes);
            if let Some((s, with)) = with {
                for i in 0..4 {
                    impulse[i] += s * (with.rebounding[k][0][i] - impulse[i]);
                    velocity[i] += s * (with.rebounding[k][1][i] - velocity[i]);
                }
            }
            let start = [before.at(point.friction_r), before.at(point.friction_r), before.at(point.r)];
            let mut own = 0.0;
            for i in 0..3 {
                let mean = 0.5 * (velocity[i] + axes[i].dot(start[i] + pulls[0] + pulls[1]));
                own += impulse[i] * mean;
            }
            if found.rebound.is_some() {
                by_rebounds += own;
                exchanged += impulse[2].abs() * velocity[2].abs() + own.abs();
            } else if found.anchor.loaded || found.distance < 0.0 {
                returned += own.max(0.0);
            }
        }
    }
    if island.hand {
        return [by_rebounds, exchanged];
    }
    [gain((model, state), &work.loads, problem, times, mixed) - returned, exchanged]
}

/// Change of the kinetic energy of an island's objects in their rebounds, J: gravity acts before and after them.
fn gain(
    (model, state): (&Model, &State),
    loads: &[(Vec3, Vec3)],
    problem: &Problem,
    times: &[f64],
    v: impl Fn(usize) -> f64,
) -> f64 {
    let bodies = Bodies { model, state, loads };
    let h = model.config().step_s;
    let mut gain = 0.0;
    for (slot, object) in problem.objects.iter().enumerate() {
        let pull = bodies.pull(Owner::Object(object.object));
        let time = times[slot].min(h);
        let (linear, angular) = state.object_velocity(model, object.object);
        let at = problem.hand_dofs + 6 * slot;
        let [after, turns] = [at, at + 3].map(|at| Vec3::new(v(at), v(at + 1), v(at + 2)));
        let before = [linear + pull * time, object.turn.map_or(angular, |(_, omega)| omega)];
        let after = [after + pull * (time - h), turns];
        // As products of sums and differences: the small change of large energies.
        gain += 0.5 * object.mass * (after[0] - before[0]).dot(after[0] + before[0]);
        gain += 0.5 * (object.inertia * (after[1] - before[1])).dot(after[1] + before[1]);
    }
    gain
}

/// Velocity of B against A at the pair's origin at the start of the step. Objects turn as in the step's problem.
fn start_velocity(
    (model, state): (&Model, &State),
    work: &Work,
    island: &Island,
    problem: &Problem,
    solved: &PairProblem,
    pair: &ContactPair,
) -> SpatialVelocity {
    let of = |owner: Owner| match owner {
        Owner::Static => SpatialVelocity::ZERO,
        Owner::Link(i) => work.dynamics.recursion.velocity[i].moved(solved.origin - work.dynamics.kin.origin),
        Owner::Object(k) => {
            let Ok(slot) = island.objects.binary_search(&k) else { return SpatialVelocity::ZERO };
            let object = &problem.objects[slot];
            let (linear, angular) = state.object_velocity(model, k);
            let angular = object.turn.map_or(angular, |(_, omega)| omega);
            SpatialVelocity { linear, angular }.moved(solved.origin - object.center)
        }
    };
    of(pair.b) - of(pair.a)
}
