//! The laws of contact, read off the solved steps of a heap.

use super::case::{Case, Finding};
use super::random_heap::{heaps_of_thirty, thirty};
use super::scene::velocity;
use super::setup::{Setup, steps};
use crate::audit::Audit;
use crate::case_report::Figure;
use crate::engine::Engine;
use crate::recorder::Recorder;
use anyhow::{Context, Result};
use palmares_models::Vec3;
use palmares_models::object::Object;
use palmares_sim::model::pair_friction;
use palmares_sim::{Owner, State};
use std::sync::Arc;

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::new(
        "thirty_objects",
        "30 objects of 10 g to 5 kg fall into a box and are kicked; nothing escapes",
        thirty_objects,
    ),
    Case::ours(
        "contact_residuals",
        "Signorini's and Coulomb's laws and Newton's second, at every contact of the heap",
        contact_residuals,
    ),
    Case::ours("contact_hover", "gaps over which contacts of the heap carry force", contact_hover),
    Case::ours(
        "contact_dissipation",
        "how far friction is from opposing slip, at every contact of 32 heaps",
        contact_dissipation,
    ),
];

/// Largest distance of a centre beyond the walls or the floor in 2 s, mm, although the objects are kicked and
/// pressed; negative when all stay inside, as they must. The rise of energy goes to `energy_gain_j`.
pub fn thirty_objects(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let heap = thirty()?;
    let (mut engine, command) = heap.start(setup)?;
    let mut audit = Audit::default();
    let mut escaped = f64::NEG_INFINITY;
    for _ in 0..steps(2.0, setup.dt_s) {
        audit.step(&mut *engine, |engine| recorder.step(engine, &command))?;
        escaped = escaped.max(heap.escaped(engine.state()));
    }
    let error = Figure::bounded("farthest object centre beyond a wall", escaped * 1e3, "mm", 0.0);
    Ok(recorder.finding(error).with_energy_gain(audit.gain_j()))
}

/// Violations of the contact laws in a step.
#[derive(Default)]
struct Residuals {
    /// Largest of the dimensionless ones.
    worst: f64,
    /// Widest gap at the end of a step under force, m.
    hover_m: f64,
    /// Power of friction, and what it would be if it opposed slip exactly, W.
    power: [f64; 2],
}

impl Residuals {
    /// Reads the contacts of the step that led from `before` to the engine's present state.
    fn read(&mut self, engine: &dyn Engine, before: &State) -> Result<()> {
        let world = engine.world().context("only our own engine reports its contact forces")?;
        let model = engine.model();
        let config = model.config();
        let h = config.step_s;
        let mut impulse = vec![Vec3::ZERO; model.objects().len()];
        let mut pressed = vec![0.0; model.objects().len()];
        for contact in world.contact_forces() {
            let normal = contact.force.dot(contact.normal);
            let tangential = contact.force - contact.normal * normal;
            let [a, b] = [contact.colliders.0, contact.colliders.1].map(|k| &model.colliders()[k as usize]);
            let mu = pair_friction(a, b);
            let relative = |at: Vec3| {
                self.velocity(engine, before, contact.b, at) - self.velocity(engine, before, contact.a, at)
            };
            let (approach, slip) =
                (relative(contact.position).dot(contact.normal), relative(contact.friction_at));
            // Signorini: it presses, and only if the surfaces touch at the step's end.
            self.worst = self.worst.max(-normal / contact.force.length());
            self.hover_m = self.hover_m.max(contact.distance + h * approach);
            // Coulomb: inside the cone.
            self.worst = self.worst.max((tangential.length() - mu * normal) / contact.force.length());
            // Coulomb: against the slip.
            let slip = slip - contact.normal * slip.dot(contact.normal);
            if tangential.length() >= 0.999 * mu * normal {
                self.power[0] -= tangential.dot(slip);
                self.power[1] += tangential.length() * slip.length();
            }
            for (owner, sign) in [(contact.a, -1.0), (contact.b, 1.0)] {
                if let Owner::Object(k) = owner {
                    impulse[k] += contact.force * (sign * h);
                    pressed[k] += contact.force.length() * h;
                }
            }
        }
        // Newton: contacts and weight give each body its momentum.
        let moving = |(k, object): (usize, &Arc<Object>)| object.mass * velocity(engine, k).0.length();
        let momenta: f64 = model.objects().iter().enumerate().map(moving).sum();
        let total = momenta.max(pressed.iter().sum());
        for (k, object) in model.objects().iter().enumerate() {
            let gained = velocity(engine, k).0 - before.object_velocity(model, k).0;
            let missing = gained * object.mass - config.gravity * (object.mass * h) - impulse[k];
            if total > 0.0 {
                self.worst = self.worst.max(missing.length() / total);
            }
        }
        Ok(())
    }

    fn velocity(&self, engine: &dyn Engine, before: &State, owner: Owner, at: Vec3) -> Vec3 {
        let Owner::Object(k) = owner else { return Vec3::ZERO };
        let (linear, angular) = velocity(engine, k);
        linear + angular.cross(at - before.objects[k].translation)
    }
}

fn residuals(setup: &Setup, recorder: &mut Recorder, heaps: u32) -> Result<Residuals> {
    let mut residuals = Residuals::default();
    for heap in heaps_of_thirty(heaps)? {
        let (mut engine, command) = heap.start(setup)?;
        for _ in 0..steps(1.5, setup.dt_s) {
            let before = engine.state().clone();
            recorder.step(&mut *engine, &command)?;
            residuals.read(&*engine, &before)?;
        }
    }
    Ok(residuals)
}

/// Largest residual of the laws of contact over 1.5 s of a falling heap of thirty: pull in a contact and excess over
/// the friction cone in parts of its force, and momentum that no force explains in parts of all momenta or all
/// impulses, whichever are larger. (Le Lidec et al. 2023; e_m of Castro, Permenter, Han 2022, VI-C, is below 1e-5 in
/// clutter.)
pub fn contact_residuals(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let residuals = residuals(setup, recorder, 1)?;
    Ok(recorder.finding(Figure::new("largest residual", residuals.worst, "of it")))
}

/// Widest gap, mm, over which a contact of a falling heap carries force at the end of a step, in 1.5 s.
/// Exact: none. The convex law lifts a contact that slides off by μ h |v_t|, and takes its sliding speed from
/// the step before.
pub fn contact_hover(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let residuals = residuals(setup, recorder, 1)?;
    Ok(recorder.finding(Figure::new("widest gap under force", residuals.hover_m * 1e3, "mm")))
}

/// Power that sliding friction fails to take, in percent of |f_t| |v_t| summed over all sliding contacts of
/// 1.5 s of 32 falling heaps: the law of maximal dissipation. The springs of contacts hold the missing part:
/// they turn into the new direction of slip over some micrometres, and relax when an impact ends. The hardest
/// few impacts are most of it: single heaps show 0.3 to 1.5 %, eight together 0.8 to 1.0, and 32 differ from
/// 128 by a tenth.
pub fn contact_dissipation(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let [taken, most] = residuals(setup, recorder, 32)?.power;
    Ok(recorder.finding(Figure::new("friction not opposing slip", 100.0 * (1.0 - taken / most), "%")))
}
