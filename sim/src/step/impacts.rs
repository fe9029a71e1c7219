//! Which contact points rebound in a step, and how fast: alone by Newton's law of impact, where several bodies meet as
//! the cascade of their impacts leaves them.

use super::free::free_turn;
use super::pose::rest_target;
use crate::contact::impact::{Rebound, rebound};
use crate::contact::narrow::{ContactPair, ContactPoint};
use crate::contact::touch::{Body, FIXED, Touch};
use crate::model::{Model, Owner};
use crate::solver::island::Island;
use crate::solver::problem::Problem;
use crate::world::World;
use palmares_models::{Mat3, Vec3};

/// Rebounds that together give more than this part of what they exchange are taken back.
const GAIN: f64 = 1e-5;

/// Detours up to this part of an object's way need not be thought of where gaps are remembered.
const DETOUR: f64 = 0.01;

/// When an object rebounds within a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Met {
    /// For the first time, s from the start of the step.
    pub time_s: f64,
    /// What later rebounds in the same step add to its way, m.
    pub detour: Vec3,
}

impl Met {
    /// A single rebound.
    pub(super) fn at(time_s: f64) -> Self {
        Met { time_s, detour: Vec3::ZERO }
    }

    /// The same with another rebound.
    pub(super) fn or_at(self, time_s: f64) -> Self {
        Met { time_s: self.time_s.min(time_s), ..self }
    }
}

impl World {
    /// Finds the rebounds of an island's points. True if more than one impact within the step went into them.
    pub(super) fn find_rebounds(&mut self, island: &Island) -> bool {
        let (mut due, mut able) = (false, 0);
        for &index in &island.pairs {
            let pair = &self.work.contacts.pairs[index];
            if pair.restitution == 0.0 {
                continue;
            }
            let free = !on_hand(pair);
            for point in &mut self.work.contacts.points[pair.points.clone()] {
                point.rebound = rebound_of(&self.model, pair, point);
                due |= free && point.rebound.is_some_and(|rebound| rebound.time_s.is_finite());
                able += usize::from(free);
            }
        }
        // A lone object has furniture to meet, at once.
        due && able > 1 && island.objects.len() > 1 && self.play_impacts(island)
    }

    fn play_impacts(&mut self, island: &Island) -> bool {
        let mut cascade = std::mem::take(&mut self.work.cascade);
        let config = self.model.config();
        let h = config.step_s;
        cascade.clear();
        cascade.bodies.extend(island.objects.iter().map(|&k| self.free_body(k)));
        let slot = |owner: Owner| match owner {
            Owner::Object(k) => island.objects.binary_search(&k).unwrap_or(FIXED),
            Owner::Static | Owner::Link(_) => FIXED,
        };
        let contacts = &mut self.work.contacts;
        for &index in &island.pairs {
            let pair = &contacts.pairs[index];
            if pair.restitution == 0.0 || on_hand(pair) {
                continue;
            }
            let bodies = [slot(pair.a), slot(pair.b)];
            for (place, point) in pair.points.clone().zip(&contacts.points[pair.points.clone()]) {
                let arms = bodies.map(|body| match cascade.bodies.get(body) {
                    Some(body) => pair.origin + point.r - body.center,
                    None => Vec3::ZERO,
                });
                let mut touch = Touch::new(bodies, point.normal, arms, point.distance + pair.excess, place);
                touch.gravity = config.gravity * (falls(pair.b) - falls(pair.a));
                touch.restitution = pair.restitution;
                touch.load = if point.anchor.loaded { point.anchor.normal_force * h } else { 0.0 };
                cascade.touches.push(touch);
            }
        }
        let several = cascade.play(h, config.rebound_speed);
        self.outcome.work += cascade.work;
        // Back in the order of the contacts.
        cascade.touches.sort_unstable_by_key(|touch| touch.place);
        let mut touches = cascade.touches.iter();
        for &index in if several { island.pairs.as_slice() } else { &[] } {
            let pair = &contacts.pairs[index];
            if pair.restitution == 0.0 || on_hand(pair) {
                continue;
            }
            for (point, touch) in contacts.points[pair.points.clone()].iter_mut().zip(&mut touches) {
                let [_, end] = cascade.velocities(touch, h);
                let velocity = end.dot(touch.normal);
                // Those that will meet in a later step go on as they are.
                let missed = || touch.misses() && velocity < rest_target(config, pair, point).0;
                let time_s = touch.hit().or_else(|| missed().then_some(f64::INFINITY));
                point.rebound = time_s.map(|time_s| Rebound { time_s, velocity });
            }
        }
        self.work.cascade = cascade;
        several
    }

    fn free_body(&self, k: usize) -> Body {
        let object = &self.model.objects()[k];
        let (linear, angular) = self.state.object_velocity(&self.model, k);
        let rotation = self.state.objects[k].rotation;
        let inverse = self.model.object_inertia_inverse(k);
        // Inertia and spin as the step's problem sees them.
        let (_, turn) = free_turn(rotation, angular, object.inertia, inverse, self.model.config().step_s);
        let (rotation, angular) = turn.unwrap_or((rotation, angular));
        let r = Mat3::from_quat(rotation);
        let center = self.state.objects[k].translation;
        Body::new(center, 1.0 / object.mass, r * inverse * r.transpose(), [linear, angular])
    }

    /// Lets the objects take the ways of the cascade, if its rebounds gave no energy in the step's solution. What the
    /// cascade knows nothing of, a hand or a loaded wall behind a ball, may have made them press harder than they should:
    /// then every point is left to its own rebound, and the answer is false.
    pub(super) fn keep_cascade(&mut self, island: &Island, problem: &Problem) -> bool {
        let (h, gravity) = (self.model.config().step_s, self.model.config().gravity);
        let work = &mut self.work;
        let (mut given, mut exchanged) = (0.0, 0.0);
        let mut touches = work.cascade.touches.iter();
        for (&index, solved) in island.pairs.iter().zip(&problem.pairs) {
            let pair = &work.contacts.pairs[index];
            if pair.restitution == 0.0 || on_hand(pair) {
                continue;
            }
            let seen = &work.contacts.points[pair.points.clone()];
            for ((point, seen), touch) in
                problem.points[solved.first..solved.end].iter().zip(seen).zip(&mut touches)
            {
                if seen.rebound.is_none() {
                    continue;
                }
                let ([t1, t2, n], [g1, g2, gn], [v1, v2, vn]) = (point.axes, point.impulse, point.velocity);
                let [start, _] = work.cascade.velocities(touch, h);
                // An impulse works with the mean of the velocities before and after; gravity had its part until then.
                let pull = gravity * (falls(pair.b) - falls(pair.a));
                let after = t1 * v1 + t2 * v2 + n * vn - pull * h;
                let mean = (start + after) * 0.5 + pull * touch.hit().unwrap_or(h);
                given += (t1 * g1 + t2 * g2 + n * gn).dot(mean);
                exchanged += 0.5 * gn * (start.dot(n).abs() + after.dot(n).abs());
            }
        }
        if given > GAIN * exchanged {
            for &index in &island.pairs {
                let pair = &work.contacts.pairs[index];
                for point in &mut work.contacts.points[pair.points.clone()] {
                    point.rebound = rebound_of(&self.model, pair, point);
                }
            }
            return false;
        }
        let mut astray = false;
        for (&k, body) in island.objects.iter().zip(&work.cascade.bodies) {
            if let Some((time_s, detour)) = body.detour() {
                work.met[k] = Some(Met { time_s, detour });
                astray |= detour.length() > DETOUR * h * body.start[0].length();
            }
        }
        // Gaps are remembered because nothing goes farther than the faster of its velocities takes it.
        if astray {
            work.near.forget(self.model.colliders().len());
        }
        true
    }
}

fn on_hand(pair: &ContactPair) -> bool {
    matches!((pair.a, pair.b), (Owner::Link(_), _) | (_, Owner::Link(_)))
}

/// Gravity accelerates free objects alone.
fn falls(owner: Owner) -> f64 {
    f64::from(u8::from(matches!(owner, Owner::Object(_))))
}

/// The rebound of a contact point in this step, if it makes one.
fn rebound_of(model: &Model, pair: &ContactPair, point: &ContactPoint) -> Option<Rebound> {
    if pair.restitution == 0.0 || point.anchor.loaded {
        return None;
    }
    let config = model.config();
    let acceleration = config.gravity.dot(point.normal) * (falls(pair.b) - falls(pair.a));
    let gap = point.distance + pair.excess;
    let (h, least) = (config.step_s, config.rebound_speed);
    let velocity = point.approach + h * acceleration;
    // What will meet in a later step must not be braked in this one: the contact's dissipation sets in before surfaces
    // touch. It goes on as it is, as a rebound that never comes.
    if point.approach < -least && gap + h * velocity >= 0.0 {
        let braked = velocity < rest_target(config, pair, point).0;
        return braked.then_some(Rebound { time_s: f64::INFINITY, velocity });
    }
    rebound(pair.restitution, gap, point.approach, acceleration, h, least)
}
