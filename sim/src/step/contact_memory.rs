//! Writes a step's solution back to its contact points: anchors for the next step, and forces for observers.

use super::dead_blow::{after_step, fastest, hold};
use super::forces::StepForces;
use super::impacts::{ObjectImpact, on_object};
use crate::anchor::{Anchor, Pair, stretch_after, stretch_sliding};
use crate::config::Config;
use crate::contact::collide::Collision;
use crate::contact::narrow_phase::{ContactPair, ContactPoint};
use crate::dynamics::spatial::SpatialVelocity;
use crate::model::Model;
use crate::outcome::ContactForce;
use crate::solver::island::Island;
use crate::solver::problem::{Point, Problem};

/// Writes the island's anchors to `pairs`, its contact forces to `forces`, and the times of rebounds to
/// `impacts`.
pub(super) fn remember(
    model: &Model,
    collision: &Collision,
    island: &Island,
    problem: &Problem,
    pairs: &mut [Pair],
    impacts: &mut [Option<ObjectImpact>],
    forces: &mut StepForces,
) {
    let config = model.config();
    let h = config.step_s;
    let blow = fastest(config, &collision.contacts, island, problem);
    // The search has already blanked points that were not worth solving.
    for (&index, solved) in island.pairs.iter().zip(&problem.pairs) {
        let found = &collision.contacts.pairs[index];
        let pair = &mut pairs[found.pair];
        let into_a = collision.poses[pair.key.0 as usize].rotation.inverse();
        let (mut mean, mut loaded) = (Anchor::default(), 0.0);
        let points = &collision.contacts.points[found.points.clone()];
        for (point, contact) in problem.points[solved.first..solved.end].iter().zip(points) {
            let data = &mut pair.manifold.points[contact.point as usize].data;
            if point.impulse[2] <= 0.0 {
                // Surfaces that part out of a blow's overlap are still in it.
                let overlaps = contact.distance + found.initial_overlap + h * point.velocity[2] < 0.0;
                let struck_s = if overlaps { after_step(config, contact.anchor.struck_s) } else { 0.0 };
                *data = Anchor { bearing: contact.anchor.bearing_after(0.0, h), struck_s, ..Anchor::IDLE };
                continue;
            }
            // The instantaneous impulse of a rebound gives no information about the next step.
            if let Some(rebound) = contact.rebound {
                *data = Anchor::IDLE;
                // A rebound that never comes only prevents braking.
                let stays = found.restitution == 0.0;
                for k in [found.a, found.b].into_iter().filter_map(on_object) {
                    if rebound.time_s.is_finite() {
                        let at = ObjectImpact { stays, ..ObjectImpact::at(rebound.time_s) };
                        impacts[k] = Some(impacts[k].map_or(at, |impact| impact.or_at(rebound.time_s)));
                    }
                }
                if stays {
                    forces.contacts.push(contact_force(point, contact, found, pair.key, h));
                }
                continue;
            }
            let mut anchor = bearing(config, point, &contact.anchor, h);
            anchor.stretch = into_a * anchor.stretch;
            anchor.struck_s =
                hold(model, [found.a, found.b], contact, blow, (point.impulse[2], point.velocity[2]));
            *data = anchor;
            loaded += 1.0;
            mean.stretch += anchor.stretch;
            mean.twist += anchor.twist;
            mean.slip += anchor.slip;
            mean.bearing += anchor.bearing;
            mean.struck_s = mean.struck_s.max(anchor.struck_s);
            forces.contacts.push(contact_force(point, contact, found, pair.key, h));
        }
        if loaded > 0.0 {
            mean.stretch /= loaded;
            mean.twist /= loaded;
            mean.slip /= loaded;
            mean.bearing /= loaded;
        }
        pair.mean = mean;
        let origin = collision.poses[pair.key.0 as usize].translation - found.origin;
        let SpatialVelocity { linear, angular } = solved.relative;
        pair.predicted = (loaded > 0.0).then(|| {
            let at_a = linear + angular.cross(origin);
            [into_a * (at_a * h), into_a * (angular * h)]
        });
    }
}

/// Memory of a bearing point after a time h with the impulse of its solution, s, from its memory before; stretches are in world
/// axes.
#[inline(always)]
pub(super) fn bearing(config: &Config, point: &Point, before: &Anchor, h: f64) -> Anchor {
    let tau = config.contact_dissipation_s.max(before.struck_s);
    let [t1, t2, normal] = point.axes;
    let [g1, g2, gn, gs] = point.impulse;
    let mut friction = t1 * g1 + t2 * g2;
    // The law used the stretch's projection on the tangent plane.
    let mut stretched = t1 * before.stretch.dot(t1) + t2 * before.stretch.dot(t2);
    // Stretch and twist are one vector, as slip and spin are one cone: twist is along the normal.
    let spins = point.law.arm > 0.0;
    if spins {
        friction += normal * gs;
        stretched += normal * before.twist;
    }
    let mut stretch = stretch_after(stretched, friction, config.anchor_stiffness, tau, h);
    let slip = point.law.slip_speed(point.velocity, point.impulse);
    if slip > 0.0 {
        stretch = stretch_sliding(stretch, friction, config.anchor_stiffness, h);
    }
    let mut twist = if spins { stretch.dot(normal) } else { 0.0 };
    let stretch = if spins { stretch - normal * twist } else { stretch };
    if spins && slip == 0.0 {
        // The impulse is also that of `twist_damping`.
        twist = before.twist + h * point.velocity[3];
    }
    let normal_force = gn / h;
    let bearing = before.bearing_after(normal_force, h);
    let struck_s = before.struck_s;
    Anchor { known: true, loaded: true, stretch, twist, slip, normal_force, bearing, struck_s }
}

/// A contact in the solution.
pub(super) fn contact_force(
    point: &Point,
    contact: &ContactPoint,
    found: &ContactPair,
    colliders: (u32, u32),
    h: f64,
) -> ContactForce {
    let [normal, friction] = point.parts(point.impulse);
    ContactForce {
        a: found.a,
        b: found.b,
        colliders,
        position: found.origin + point.r,
        friction_at: found.origin + point.friction_r,
        normal: point.axes[2],
        force: (friction + normal) / h,
        torque: point.torque(point.impulse) / h,
        distance: contact.distance,
    }
}
