//! Forces at the solution of a step.

use crate::model::{Model, Owner};
use crate::outcome::ContactForce;
use crate::solver::newton::Newton;
use crate::solver::problem::Problem;
use crate::solver::terms::AxisTerm;
use crate::state::Sleep;
use serde::{Deserialize, Serialize};

/// Forces of the last step.
#[derive(Clone, Default, Serialize, Deserialize)]
pub(crate) struct StepForces {
    /// Forces at touching contacts.
    pub contacts: Vec<ContactForce>,
    /// Forces of the active joint limits: N or N·m.
    pub limits: Vec<(AxisTerm, f64)>,
    /// Force and torque of the base servo, or of the mount of a bolted base: N, N·m about the base's origin.
    pub base: [f64; 6],
}

impl StepForces {
    /// Whether all bodies, shapes and joints in it exist in this model.
    pub(crate) fn fits(&self, model: &Model) -> bool {
        let there = |owner: Owner| match owner {
            Owner::Static => true,
            Owner::Link(link) => model.hand().is_some_and(|hand| link < hand.links.len()),
            Owner::Object(object) => object < model.objects().len(),
        };
        let shapes = model.colliders().len() as u32;
        self.contacts
            .iter()
            .all(|one| there(one.a) && there(one.b) && one.colliders.0.max(one.colliders.1) < shapes)
            && self.limits.iter().all(|(term, _)| term.dof < model.hand_dofs())
    }

    /// Removes limits, and all contacts but those of sleeping objects, which are not solved again.
    pub(crate) fn begin(&mut self, sleep: &[Sleep]) {
        let rests = |owner: Owner| match owner {
            Owner::Static => true,
            Owner::Link(_) => false,
            Owner::Object(k) => sleep[k].asleep,
        };
        self.contacts.retain(|one| rests(one.a) && rests(one.b));
        self.limits.clear();
    }

    /// Reads base and limits from the solution `v` of a problem that the hand is part of, over a step of h; tensions go to
    /// `tension`, forces of dry friction to `friction`. An impulse γ over h is a force γ/h.
    pub(crate) fn read_hand(
        &mut self,
        problem: &Problem,
        newton: &Newton,
        v: &[f64],
        h: f64,
        (tension, friction): (&mut [f64], &mut [f64]),
    ) {
        // The tendons are the first rows.
        for (k, tension) in tension.iter_mut().enumerate().take(problem.rows) {
            *tension = newton.row_impulse(problem, k) / h;
        }
        // Dry friction has the last ones.
        let first = problem.rows - friction.len();
        for (k, friction) in friction.iter_mut().enumerate() {
            *friction = -newton.row_impulse(problem, first + k) / h;
        }
        self.base = if problem.bolted { newton.mount_impulse().map(|impulse| impulse / h) } else { [0.0; 6] };
        for term in &problem.axis_terms {
            let force = term.sign * term.law.impulse(term.sign * v[term.dof]).0 / h;
            if term.dof < 6 {
                self.base[term.dof] = force;
            } else if force != 0.0 {
                self.limits.push((*term, force));
            }
        }
    }
}
