//! The contact points that rebound in a step, and their speeds: alone by Newton's law of impact, `v_n⁺ = −e
//! v_n⁻`; if several bodies meet, by the sequence of their impacts ([`crate::contact::impact_sequence`]).

use super::dead_blow;
use super::slip_correction::rest_target;
use super::torque_free::free_turn;
use crate::contact::collide::Collision;
use crate::contact::impact_candidate::{FIXED, ImpactBody, ImpactCandidate};
use crate::contact::impact_sequence::ImpactSequence;
use crate::contact::narrow_phase::{ContactPair, ContactPoint, Contacts};
use crate::contact::restitution::{Rebound, rebound};
use crate::model::{Model, Owner};
use crate::solver::island::Island;
use crate::state::State;
use palmares_models::{Mat3, Vec3};

/// Detours up to this part of an object's displacement do not invalidate cached gaps.
const DETOUR: f64 = 0.01;

/// The spring of the contact stops a body that turns by more than this in a step, rad.
pub(super) const MAX_TURN: f64 = 0.01;

/// Rebound of an object within a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ObjectImpact {
    /// Time of the first rebound, s from the start of the step.
    pub time_s: f64,
    /// Displacement that later rebounds in the same step add, m.
    pub detour: Vec3,
    /// Whether it only reaches the surface at the end of the step, and does not separate from it.
    pub stays: bool,
}

impl ObjectImpact {
    /// A single rebound.
    pub(super) fn at(time_s: f64) -> Self {
        ObjectImpact { time_s, detour: Vec3::ZERO, stays: false }
    }

    /// The same with another rebound.
    pub(super) fn or_at(self, time_s: f64) -> Self {
        ObjectImpact { time_s: self.time_s.min(time_s), ..self }
    }
}

/// How the rebounds of an island's points are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rebounds {
    /// Each point has its own.
    Own,
    /// Several impacts within the step, one after the other, went into them.
    Sequence,
}

/// The bodies of a world at the start of a step.
#[derive(Clone, Copy)]
pub(super) struct Bodies<'a> {
    pub model: &'a Model,
    pub state: &'a State,
    /// External force, N, and torque on every object, or empty.
    pub loads: &'a [(Vec3, Vec3)],
}

impl Bodies<'_> {
    /// Acceleration of a free body by gravity and external forces, m/s²; 0 for others.
    pub(super) fn pull(&self, owner: Owner) -> Vec3 {
        on_object(owner).map_or(Vec3::ZERO, |k| pull(self.model, self.loads, k))
    }

    /// Centripetal acceleration of a point of a free body, m/s²: its corners reach a surface sooner or later than their velocities
    /// tell.
    fn turning(&self, owner: Owner, at: Vec3) -> Vec3 {
        let Some(k) = on_object(owner) else { return Vec3::ZERO };
        let (_, angular) = self.state.object_velocity(self.model, k);
        angular.cross(angular.cross(at - self.state.objects[k].translation))
    }
}

/// How contacts act on an object in a step.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Touch {
    /// Some contact pushes.
    pub acts: bool,
    /// Some contact with restitution pushes.
    pub rebounds: bool,
    /// Sum of the normal impulses, N s.
    pub impulse: f64,
}

/// The impacts of a step.
#[derive(Default)]
pub(crate) struct Impacts {
    /// Per object: its rebound, if any.
    pub of_objects: Vec<Option<ObjectImpact>>,
    /// Impacts of several bodies.
    sequence: ImpactSequence,
    /// How contacts act on the objects of an island.
    pub(super) touched: Vec<Touch>,
}

/// Finds the rebounds of an island's points; a sequence of them is in `impacts`. Its computing is added to `spent`.
pub(super) fn find(
    bodies: Bodies<'_>,
    contacts: &mut Contacts,
    island: &Island,
    impacts: &mut Impacts,
    spent: &mut u64,
) -> Rebounds {
    let Bodies { model, state, .. } = bodies;
    let (mut due, mut able) = (false, 0);
    // A body that turns far within a step does not reach the surface where its velocity predicts.
    let turns = |k: usize| state.object_velocity(model, k).1.length() * model.config().step_s > MAX_TURN;
    // A body that already rests on a support tips onto the next: see `support_transfer`.
    let stands = || {
        let points = |&index: &usize| &contacts.points[contacts.pairs[index].points.clone()];
        island.pairs.iter().flat_map(points).any(|point| point.anchor.loaded)
    };
    let lone = island.is_lone_object();
    let alone = lone && !turns(island.objects[0]) && !stands();
    for &index in &island.pairs {
        let pair = &contacts.pairs[index];
        let free = !on_hand(pair);
        if pair.restitution == 0.0 && !alone {
            // A lone body's contacts are rigid or springs.
            if !lone {
                contacts.struck |= strike(bodies, pair, &mut contacts.points[pair.points.clone()]);
            }
            continue;
        }
        for point in &mut contacts.points[pair.points.clone()] {
            point.rebound = rebound_of(bodies, pair, point);
            if pair.restitution > 0.0 {
                due |= free && point.rebound.is_some_and(|rebound| rebound.time_s.is_finite());
                able += usize::from(free);
            }
        }
    }
    // A lone object meets only furniture, all at once.
    if !(due && able > 1 && island.objects.len() > 1) {
        return Rebounds::Own;
    }
    let rebounds = play(bodies, contacts, island, &mut impacts.sequence);
    *spent += impacts.sequence.work;
    rebounds
}

/// Plays the impacts of an island's free bodies. If there were several, every point has the rebound that it ends with.
fn play(
    bodies: Bodies<'_>,
    contacts: &mut Contacts,
    island: &Island,
    sequence: &mut ImpactSequence,
) -> Rebounds {
    let Bodies { model, state, .. } = bodies;
    let config = model.config();
    let h = config.step_s;
    sequence.clear();
    sequence.bodies.extend(island.objects.iter().map(|&k| free_body(model, state, k)));
    let slot = |owner: Owner| match owner {
        Owner::Object(k) => island.objects.binary_search(&k).unwrap_or(FIXED),
        Owner::Static | Owner::Link(_) => FIXED,
    };
    for &index in &island.pairs {
        let pair = &contacts.pairs[index];
        if pair.restitution == 0.0 || on_hand(pair) {
            continue;
        }
        let slots = [slot(pair.a), slot(pair.b)];
        for (place, point) in pair.points.clone().zip(&contacts.points[pair.points.clone()]) {
            let arms = slots.map(|body| match sequence.bodies.get(body) {
                Some(body) => pair.origin + point.r - body.center,
                None => Vec3::ZERO,
            });
            let mut candidate =
                ImpactCandidate::new(slots, point.normal, arms, point.distance + pair.initial_overlap, place);
            candidate.gravity = bodies.pull(pair.b) - bodies.pull(pair.a);
            candidate.restitution = pair.restitution;
            candidate.load = if point.anchor.loaded { point.anchor.normal_force * h } else { 0.0 };
            sequence.candidates.push(candidate);
        }
    }
    let several = sequence.play(h, config.rebound_speed);
    // Restores the order of the contacts.
    sequence.candidates.sort_unstable_by_key(|candidate| candidate.place);
    let mut candidates = sequence.candidates.iter();
    for &index in if several { island.pairs.as_slice() } else { &[] } {
        let pair = &contacts.pairs[index];
        if pair.restitution == 0.0 || on_hand(pair) {
            continue;
        }
        for (point, candidate) in contacts.points[pair.points.clone()].iter_mut().zip(&mut candidates) {
            let [_, end] = sequence.velocities(candidate, h);
            let velocity = end.dot(candidate.normal);
            // Points that will meet in a later step continue unchanged.
            let missed = || candidate.misses() && velocity < rest_target(config, pair, point).0;
            let time_s = candidate.hit().or_else(|| missed().then_some(f64::INFINITY));
            let impulse = if pair.friction == 0.0 { candidate.impulse } else { 0.0 };
            point.rebound = time_s.map(|time_s| {
                let rebound = Rebound { impulse, ..Rebound::new(time_s, velocity) };
                with_slip(bodies, pair, point, rebound)
            });
        }
    }
    if several { Rebounds::Sequence } else { Rebounds::Own }
}

pub(super) fn free_body(model: &Model, state: &State, k: usize) -> ImpactBody {
    let object = &model.objects()[k];
    let (linear, angular) = state.object_velocity(model, k);
    let rotation = state.objects[k].rotation;
    let inverse = model.object_inertia_inverse(k);
    // Inertia and spin as in the step's problem.
    let (_, turn) = free_turn(rotation, angular, object.inertia, inverse, model.config().step_s);
    let (rotation, angular) = turn.unwrap_or((rotation, angular));
    let r = Mat3::from_quat(rotation);
    let center = state.objects[k].translation;
    ImpactBody::new(center, 1.0 / object.mass, r * inverse * r.transpose(), [linear, angular])
}

/// Gives the objects the paths of a sequence. Cached gaps rely on no body moving farther than the faster of its velocities allows:
/// a detour beyond [`DETOUR`] discards them.
pub(super) fn follow_paths(model: &Model, collision: &mut Collision, island: &Island, impacts: &mut Impacts) {
    let h = model.config().step_s;
    let Impacts { of_objects, sequence, .. } = impacts;
    let mut astray = false;
    for (&k, body) in island.objects.iter().zip(&sequence.bodies) {
        if let Some((time_s, detour)) = body.detour() {
            of_objects[k] = Some(ObjectImpact { time_s, detour, stays: false });
            astray |= detour.length() > DETOUR * h * body.start[0].length();
        }
    }
    if astray {
        collision.distances.forget();
    }
}

/// Whether a point of an island rebounds within the step.
pub(super) fn any_within(collision: &Collision, island: &Island) -> bool {
    let Contacts { pairs, points, .. } = &collision.contacts;
    let within = |point: &ContactPoint| point.rebound.is_some_and(|rebound| rebound.time_s.is_finite());
    island.pairs.iter().any(|&index| points[pairs[index].points.clone()].iter().any(within))
}

/// Acceleration of an object by gravity and external forces, m/s².
pub(super) fn pull(model: &Model, loads: &[(Vec3, Vec3)], object: usize) -> Vec3 {
    let force = loads.get(object).map_or(Vec3::ZERO, |(force, _)| *force);
    model.config().gravity + force / model.objects()[object].mass
}

/// The object of a body, if it is one.
pub(super) fn on_object(owner: Owner) -> Option<usize> {
    match owner {
        Owner::Object(k) => Some(k),
        Owner::Static | Owner::Link(_) => None,
    }
}

pub(super) fn on_hand(pair: &ContactPair) -> bool {
    matches!((pair.a, pair.b), (Owner::Link(_), _) | (_, Owner::Link(_)))
}

/// The rebound of a contact point in this step, if it makes one.
fn rebound_of(bodies: Bodies<'_>, pair: &ContactPair, point: &ContactPoint) -> Option<Rebound> {
    if point.anchor.loaded {
        return None;
    }
    let config = bodies.model.config();
    let acceleration = (bodies.pull(pair.b) - bodies.pull(pair.a)).dot(point.normal);
    let at = pair.origin + point.r;
    let turning = (bodies.turning(pair.b, at) - bodies.turning(pair.a, at)).dot(point.normal);
    let gap = point.distance;
    let (h, least) = (config.step_s, config.rebound_speed);
    let found = rebound(pair.restitution, gap, point.approach, (acceleration, turning), h, least);
    let found = found.or_else(|| {
        // A point that will meet in a later step must not be braked in this one: the contact's dissipation sets
        // in before surfaces meet. It continues unchanged, as a rebound that never comes.
        let velocity = point.approach + h * acceleration;
        let misses = pair.restitution > 0.0 && velocity.min(point.approach) < -least && gap > 0.0;
        misses.then_some(Rebound::new(f64::INFINITY, velocity))
    })?;
    Some(with_slip(bodies, pair, point, found))
}

/// Starts the dead blows of a pair's points; true if there is any.
fn strike(bodies: Bodies<'_>, pair: &ContactPair, points: &mut [ContactPoint]) -> bool {
    let mut any = false;
    for point in points {
        if dead_blow::strike(bodies.model, [pair.a, pair.b], point) {
            any = true;
            if !on_hand(pair) {
                let (rest, _) = rest_target(bodies.model.config(), pair, point);
                // With the slip before it, the law would lift the surfaces, or hold them too late.
                point.anchor.slip = with_slip(bodies, pair, point, Rebound::new(0.0, rest)).slip;
            }
        }
    }
    any
}

/// A rebound with the slip after it, for two bodies that meet only in this point. W, 1/kg, is the velocity
/// per impulse at the point. The normal impulse is `p = (v⁺ − v⁻)/(W_nn − μ W_nt)`, and Coulomb's impulse μ p
/// reduces the slip by `W_tt μ p`.
fn with_slip(free: Bodies<'_>, pair: &ContactPair, point: &ContactPoint, found: Rebound) -> Rebound {
    let Bodies { model, state, .. } = free;
    let (normal, h) = (point.normal, model.config().step_s);
    let bodies = [(pair.a, -1.0), (pair.b, 1.0)]
        .map(|(owner, sign)| on_object(owner).map(|k| (free_body(model, state, k), sign)));
    let yielding = |direction: Vec3| {
        bodies.iter().flatten().fold(Vec3::ZERO, |sum, (body, _)| {
            let arm = pair.origin + point.friction_r - body.center;
            sum + direction * body.inverse_mass + (body.inverse_inertia * arm.cross(direction)).cross(arm)
        })
    };
    // Without the impact, at the end of the step.
    let mut velocity = (free.pull(pair.b) - free.pull(pair.a)) * h;
    let jump = found.velocity - point.approach - velocity.dot(normal);
    for (body, sign) in bodies.iter().flatten() {
        let arm = pair.origin + point.friction_r - body.center;
        velocity += (body.start[0] + body.start[1].cross(arm)) * *sign;
    }
    let of_normal = yielding(normal);
    let across = velocity - normal * velocity.dot(normal);
    let before = across.length();
    let mu = pair.friction;
    let Some(direction) = across.try_normalize() else { return found };
    if on_hand(pair) || mu == 0.0 {
        return Rebound { slip: before, ..found };
    }
    let (nn, nt, tt) = (of_normal.dot(normal), of_normal.dot(direction), yielding(direction).dot(direction));
    // Change of the slip with the required normal velocity.
    let change = (nt - mu * tt) / (nn - mu * nt).max(0.1 * nn);
    let slip = (before + change * jump.max(0.0)).clamp(0.0, before);
    Rebound { slip, gain: (1.0 - mu * change).clamp(0.5, 10.0), ..found }
}

#[cfg(test)]
mod tests {
    use crate::{Command, Config, Model, State, World};
    use palmares_models::hand::Hand;
    use palmares_models::object::Object;
    use palmares_models::shape::Shape;
    use palmares_models::{Pose, Vec3};
    use std::sync::Arc;

    const RADIUS: f64 = 0.05;
    const STEP_S: f64 = 1e-3;

    /// Elastic balls in a row without weight, by positions and velocities along x; after one step.
    fn after_a_step(balls: &[(f64, f64)]) -> World {
        after_a_step_with(None, balls)
    }

    /// The same with a hand at rest far below.
    fn after_a_step_with(hand: Option<Arc<Hand>>, balls: &[(f64, f64)]) -> World {
        let config = Config { gravity: Vec3::ZERO, ..Config::with_step(STEP_S) };
        let mut model = Model::new(config, hand).expect("a sound world");
        for _ in balls {
            let parts = vec![(Pose::IDENTITY, Shape::Sphere { radius: RADIUS })];
            let ball = Object::new("ball", parts, 0.2, 0.0, 0.0).expect("a ball").with_restitution(1.0);
            model.add_object(Arc::new(ball)).expect("it fits");
        }
        let at: Vec<Pose> = balls.iter().map(|(x, _)| Pose::translation(*x, 0.0, 0.0)).collect();
        let below = Pose::translation(0.0, 0.0, -1.0);
        let mut state = State::at_rest(&model, below, &at);
        for (ball, (_, speed)) in balls.iter().enumerate() {
            state.v[model.object_dofs(ball)] = *speed;
        }
        let mut world = World::new(Arc::new(model), state);
        world.step(&Command::stay(world.model(), below));
        world
    }

    fn speeds(world: &World) -> Vec<f64> {
        let at = |ball| world.state().v[world.model().object_dofs(ball)];
        (0..world.state().objects.len()).map(at).collect()
    }

    /// A rebounding contact is a million times as stiff as its balls are heavy, so that each impact lacks a
    /// millionth.
    const LACKING: f64 = 3e-6;

    fn assert_near(found: &[f64], expected: &[f64]) {
        assert!(
            found.iter().zip(expected).all(|(a, b)| (a - b).abs() < LACKING),
            "{found:?}, not {expected:?}"
        );
    }

    /// Two balls 0.4 mm apart meet after 0.4 of a step, and end where an exact impact would take them.
    #[test]
    fn an_impact_within_a_step_is_at_its_time() {
        let gap = 0.4e-3;
        let world = after_a_step(&[(0.0, 1.0), (2.0 * RADIUS + gap, 0.0)]);
        assert_near(&speeds(&world), &[0.0, 1.0]);
        let x = |ball: usize| world.state().objects[ball].translation.x;
        assert_near(&[x(0), x(1)], &[gap, 2.0 * RADIUS + gap + 0.6e-3]);
    }

    /// A ball that strikes a row of two within a step stops, and the last of the row moves on.
    #[test]
    fn impacts_that_follow_within_a_step_are_played_in_their_order() {
        let world = after_a_step(&[(0.0, 1.0), (2.0 * RADIUS + 0.2e-3, 0.0), (4.0 * RADIUS + 0.4e-3, 0.0)]);
        assert_near(&speeds(&world), &[0.0, 0.0, 1.0]);
    }

    /// The detour of such a row discards the known gaps, those of a hand beside it, too; its next step finds them again.
    #[test]
    fn a_row_that_is_struck_beside_a_hand_moves_on() {
        let hand = Hand::builtin("softhand").expect("it is built in");
        let row = [(0.0, 1.0), (2.0 * RADIUS + 0.2e-3, 0.0), (4.0 * RADIUS + 0.4e-3, 0.0)];
        let mut world = after_a_step_with(Some(hand), &row);
        let command = Command::stay(world.model(), world.state().base);
        for _ in 0..3 {
            world.step(&command);
            assert_near(&speeds(&world), &[0.0, 0.0, 1.0]);
        }
    }

    #[test]
    fn what_meets_in_a_later_step_is_not_braked_in_this_one() {
        let world = after_a_step(&[(0.0, 1.0), (2.0 * RADIUS + 1.05e-3, 0.0)]);
        assert_near(&speeds(&world), &[1.0, 0.0]);
    }
}
