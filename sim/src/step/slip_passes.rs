//! Repeated solves of a step with the slip of its solution ([`super::slip_correction`]).

use super::slip_correction::{Corrected, correct};
use super::solve::solve;
use super::work::Work;
use crate::config::Config;
use crate::law::Law;
use crate::model::Model;
use crate::solver::island::Island;
use crate::solver::newton::Newton;
use crate::solver::problem::Problem;

/// Largest number of repeated solves after a change of slip: each leaves about a tenth of the error. In
/// islands of several objects, or with the hand, the tolerance is coarser, because some contact begins to
/// slide at nearly every step.
const PASSES: usize = 2;

/// Stiffness, N/m, up to which contacts float so little that these passes are enough. Harder contacts carry
/// no load at a proportionally smaller gap: a tenth for every further pass.
const SOFT_STIFFNESS: f64 = 2e5;

/// Largest number of repeated solves with slipping rebounds. The first guess is right for a body that meets
/// another in one point; with several points it takes more.
const REBOUND_PASSES: usize = 6;

/// Solves again until the slip of the solution is the one that its laws assume, or no pass is left. The lag covers slip that changes
/// evenly, for contacts of any stiffness. Later passes are for the rebounds of a lone object only.
pub(super) fn settle(
    model: &Model,
    work: &mut Work,
    island: &Island,
    (problem, newton): (&mut Problem, &mut Newton),
    v: &mut [f64],
) {
    let config = model.config();
    let alone = island.is_lone_object();
    for pass in 0.. {
        let finer = finer(config, pass, alone).filter(|_| model.has(Law::SlipCorrection));
        if finer.is_none() && !(alone && pass < REBOUND_PASSES) {
            return;
        }
        let Corrected { slip, rebound } = correct(config, &work.collision.contacts, island, problem, finer);
        if !(slip || rebound) {
            return;
        }
        work.acted.insert_if(Law::SlipCorrection, slip);
        solve(model, work, problem, newton, v);
    }
}

/// Divisor of the term's tolerance in the `pass`-th check of a step, from 0 on; `None` if the step is not to
/// be solved again for the term. Only a lone object's first check is as fine as the later ones.
fn finer(config: &Config, pass: usize, alone: bool) -> Option<f64> {
    let harder = (config.contact_stiffness / SOFT_STIFFNESS).max(1.0);
    // The logarithm only where it is needed: most steps end before.
    let is_due = pass < PASSES || pass < PASSES + libm::log10(harder).ceil() as usize;
    is_due.then_some(if pass == 0 && !alone { 1.0 } else { harder })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn harder_contacts_have_a_pass_more_for_every_tenth() {
        for (stiffness, divisors) in [
            (1e4, vec![1.0, 1.0]),
            (2e5, vec![1.0, 1.0]),
            (2e6, vec![1.0, 10.0, 10.0]),
            (1e7, vec![1.0, 50.0, 50.0, 50.0]),
        ] {
            let config = Config { contact_stiffness: stiffness, ..Config::default() };
            let found = |alone| (0..).map_while(|pass| finer(&config, pass, alone)).collect::<Vec<f64>>();
            assert_eq!(found(false), divisors, "{stiffness}");
            assert_eq!(found(true)[1..], divisors[1..], "{stiffness}");
            assert_eq!(found(true)[0], divisors[1], "{stiffness}");
        }
    }
}
