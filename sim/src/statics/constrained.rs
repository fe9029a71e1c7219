//! Equilibrium of a hand with some points held at positions in the world, as by contacts that do not slip.

use crate::command::Push;
use crate::config::Config;
use crate::statics::drives::wound_slowly;
use crate::statics::energy::{PointConstraint, Reaction, StaticsProblem};
use crate::statics::loose::loose;
use crate::statics::prediction::solve_wound;
use crate::statics::rest::{Equilibrium, NoPrediction};
use palmares_models::Pose;
use palmares_models::hand::Hand;

/// A hand at rest with some points held.
#[derive(Clone, Debug, PartialEq)]
pub struct ConstrainedEquilibrium {
    /// Coordinates and tensions.
    pub equilibrium: Equilibrium,
    /// One per hold.
    pub reactions: Vec<Reaction>,
}

/// The equilibrium at motor positions σ under pushes and, if the hand does not cancel it, its own weight,
/// with points held.
///
/// # Errors
/// No balance was reached, or a joint is unconstrained.
pub fn solve_constrained(
    config: &Config,
    hand: &Hand,
    base: Pose,
    sigma: &[f64],
    pushes: &[Push],
    holds: &[PointConstraint],
) -> Result<ConstrainedEquilibrium, NoPrediction> {
    if let Some(loose) = loose(hand) {
        return Err(NoPrediction::Loose(loose.to_owned()));
    }
    let s_ref = wound_slowly(hand, sigma, |s_ref| solve_wound(config, hand, base, s_ref, &[]))?;
    let problem = StaticsProblem { config, hand, base, s_ref: &s_ref, pushes, holds };
    let q = problem.minimum()?;
    let reactions = problem.reactions(&problem.kinematics(&q));
    Ok(ConstrainedEquilibrium { equilibrium: problem.equilibrium(q), reactions })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::actuation::elastic;
    use crate::dynamics::tree::Kinematics;
    use crate::statics::energy::{MAX_FORCE, STIFFNESS};
    use crate::statics::loads::torques;
    use crate::statics::prediction::solve_loaded;
    use crate::statics::rest::Method;
    use palmares_models::Vec3;
    use std::sync::Arc;

    fn hand(name: &str) -> Arc<Hand> {
        Hand::builtin(name).expect("it is built in")
    }

    fn closed(hand: &Hand, sigma: f64) -> Vec<f64> {
        vec![sigma; hand.motors.len()]
    }

    /// A fingertip: the last link that a coordinate moves.
    fn tip(hand: &Hand) -> usize {
        (0..hand.links.len()).rev().find(|&i| hand.links[i].joint.is_some()).expect("a link that moves")
    }

    #[test]
    fn nothing_held_is_the_closed_form() {
        let (config, hand) = (Config::default(), hand("softhand"));
        let sigma = closed(&hand, 0.4);
        let expected = solve_loaded(&config, &hand, Pose::IDENTITY, &sigma, &[]).expect("a rest");
        assert_eq!(expected.method, Method::ClosedForm);
        let found =
            solve_constrained(&config, &hand, Pose::IDENTITY, &sigma, &[], &[]).expect("a rest").equilibrium;
        for (a, b) in found.q.iter().zip(&expected.q).chain(found.tension.iter().zip(&expected.tension)) {
            assert!((a - b).abs() < 1e-8, "{a} {b}");
        }
    }

    /// Every hand, pushed and held: each coordinate's torques balance, and the point is at its target.
    #[test]
    fn what_holds_a_point_balances_what_moves_it() {
        let config = Config::default();
        // Stiff drives pull the point away with tens of newtons at a tenth of the closure.
        let soft = ["softhand", "softhand_skin", "reflex", "pinch", "yale_t42"].map(|name| (hand(name), 0.2));
        let near = palmares_models::builtin::builtin_hands().iter().map(|hand| (hand.clone(), 0.295));
        for (hand, closure) in near.chain(soft) {
            let (hand, sigma) = (&hand, closed(&hand, 0.3));
            let free = solve_constrained(&config, hand, Pose::IDENTITY, &sigma, &[], &[]).expect("a rest");
            let (link, point) = (tip(hand), Vec3::new(0.0, 0.005, 0.01));
            let mut kin = Kinematics::default();
            // A reachable target: the point's position at another closure.
            let other = solve_constrained(&config, hand, Pose::IDENTITY, &closed(hand, closure), &[], &[])
                .expect("a rest");
            kin.update(hand, Pose::IDENTITY, &other.equilibrium.q);
            let place = kin.pose[link].transform_point(point);
            let holds = [PointConstraint { link, point, place }];
            let pushes = [Push { link, point: Vec3::ZERO, force: Vec3::new(0.0, 0.05, -0.05) }];
            let found =
                solve_constrained(&config, hand, Pose::IDENTITY, &sigma, &pushes, &holds).expect("a rest");
            let reaction = found.reactions[0];
            assert!(reaction.gap < 5e-4, "{}: {reaction:?}", hand.name);
            assert!((reaction.force.length() - STIFFNESS * reaction.gap).abs() < 1e-9);
            let q = &found.equilibrium.q;
            assert!(q.iter().zip(&free.equilibrium.q).any(|(a, b)| (a - b).abs() > 1e-4), "{}", hand.name);
            let all = [pushes[0], holds[0].as_push(&reaction)];
            let tau = torques(&config, hand, Pose::IDENTITY, q, &all);
            let mut balance: Vec<f64> = hand
                .coordinates
                .iter()
                .enumerate()
                .map(|(i, c)| {
                    let limit = config.limit_stiffness * (q[i] - q[i].clamp(c.lower, c.upper));
                    tau[i] - c.stiffness * (q[i] - c.rest) - limit
                })
                .collect();
            for (tendon, f) in hand.tendons.iter().zip(&found.equilibrium.tension) {
                tendon.gradient(q, |c, r| balance[c] += f * r);
            }
            elastic::subtract_torques(hand, q, &mut balance);
            let worst = balance.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            assert!(worst < 1e-7, "{}: {worst}", hand.name);
            let reasons = &found.equilibrium.beyond_closed_form;
            assert!(reasons.iter().any(|why| why.ends_with("is held")), "{reasons:?}");
        }
    }

    #[test]
    fn a_place_out_of_reach_pulls_with_a_bounded_force() {
        let (config, hand) = (Config::default(), hand("softhand"));
        let link = tip(&hand);
        let hold = PointConstraint { link, point: Vec3::ZERO, place: Vec3::new(5.0, 0.0, 0.0) };
        let found = solve_constrained(&config, &hand, Pose::IDENTITY, &closed(&hand, 0.3), &[], &[hold])
            .expect("a rest");
        let reaction = found.reactions[0];
        assert!((reaction.force.length() - MAX_FORCE).abs() < 1e-9 && reaction.gap > 4.0, "{reaction:?}");
    }
}
