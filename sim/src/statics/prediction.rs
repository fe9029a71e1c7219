//! Predicted equilibrium of a hand at limits and under pushes, without simulation.

use crate::bounds::LINK_WORK;
use crate::command::Push;
use crate::config::Config;
use crate::statics::drives::wound_slowly;
use crate::statics::energy::minimum;
use crate::statics::equilibrium::{ClosedForm, NoClosedForm, solve_free_within};
use crate::statics::loads::{torque_work, torques};
use crate::statics::loose::loose;
use crate::statics::rest::{Equilibrium, Method, NoPrediction, beyond_tendons, spend};
use palmares_models::Pose;
use palmares_models::hand::Hand;

/// Largest computing of a prediction, in the unit of [`crate::bounds`]: a second. The built-in hands need a
/// thousandth of it.
const MAX_WORK: u64 = 1_000_000_000;
/// Largest number of iterations of the fixed point.
const ITERATIONS: usize = 500;
/// Coordinates that change less than this are at rest, rad.
const SETTLED: f64 = 1e-14;
/// The same limit, when rounding prevents a smaller change.
const NEARLY_SETTLED: f64 = 1e-9;
/// A joint is at a limit if its springs and tendons pull it this far beyond, rad.
const BEYOND: f64 = 1e-12;

/// The equilibrium at wound lengths `s_ref`, one per tendon, under joint torques `tau`: by the closed form if
/// every tendon is taut and below its limit and no joint is at one, else by Newton's method.
pub fn solve_limited(
    hand: &Hand,
    limit_stiffness: f64,
    s_ref: &[f64],
    tau: &[f64],
) -> Result<Equilibrium, NoPrediction> {
    solve_limited_within(hand, limit_stiffness, s_ref, tau, &mut { MAX_WORK })
}

/// The same within the remaining computing, from which its own is subtracted.
fn solve_limited_within(
    hand: &Hand,
    limit_stiffness: f64,
    s_ref: &[f64],
    tau: &[f64],
    left: &mut u64,
) -> Result<Equilibrium, NoPrediction> {
    if let Some(loose) = loose(hand) {
        return Err(NoPrediction::Loose(loose.to_owned()));
    }
    spend(left, ClosedForm::work(hand))?;
    let form = ClosedForm::new(hand);
    if let Ok(form) = &form {
        let (q, tension) = form.solve(s_ref, tau);
        let inside = hand.coordinates.iter().zip(&q).all(|(c, q)| (c.lower..=c.upper).contains(q));
        let taut =
            hand.tendons.iter().zip(&tension).all(|(t, f)| (t.least_force()..=t.most_held()).contains(f));
        if inside && taut {
            return Ok(Equilibrium {
                q,
                tension,
                method: Method::ClosedForm,
                beyond_closed_form: Vec::new(),
            });
        }
    }
    let mut found = held_at_limits(hand, limit_stiffness, s_ref, tau, left)?;
    let why = &mut found.beyond_closed_form;
    why.extend(beyond_tendons(hand, &found.tension));
    match form {
        Err(NoClosedForm::VaryingArms { .. }) => {
            why.retain(|reason| !reason.ends_with("is slack"));
            why.push("moment arms vary with the configuration".to_owned());
        }
        Err(NoClosedForm::ClosedChain { linkage }) => {
            why.push(format!("linkage '{linkage}' closes a chain of links"))
        }
        Err(NoClosedForm::NoSpring { .. }) | Ok(_) => {}
    }
    Ok(found)
}

/// The equilibrium with joints held at limits that they would exceed, by the spring of a limit in a
/// simulation; and these joints. The search guesses them and corrects the guess.
fn held_at_limits(
    hand: &Hand,
    limit_stiffness: f64,
    s_ref: &[f64],
    tau: &[f64],
    left: &mut u64,
) -> Result<Equilibrium, NoPrediction> {
    let mut held: Vec<Option<f64>> = vec![None; hand.coordinates.len()];
    let mut start: Vec<f64> = hand.coordinates.iter().map(|c| c.rest).collect();
    hand.close_chains(&mut start);
    // At worst joints reach limits one after the other, and may leave them again.
    for _ in 0..4 * (1 + held.len()) {
        spend(left, LINK_WORK * hand.links.len() as u64)?;
        let mut stiffer = hand.clone();
        for (c, bound) in stiffer.coordinates.iter_mut().zip(&held) {
            if let Some(bound) = bound {
                c.rest = (c.stiffness * c.rest + limit_stiffness * bound) / (c.stiffness + limit_stiffness);
                c.stiffness += limit_stiffness;
            }
        }
        let found = match solve_free_within(&stiffer, s_ref, tau, &start, left) {
            Err(_) if *left == 0 => return Err(NoPrediction::WorkExhausted),
            found => found?,
        };
        let mut right = true;
        for ((c, &q), held) in hand.coordinates.iter().zip(&found.q).zip(&mut held) {
            let now = if q < c.lower - BEYOND {
                Some(c.lower)
            } else if q > c.upper + BEYOND {
                Some(c.upper)
            } else {
                None
            };
            right &= now == *held;
            *held = now;
        }
        if right {
            let at = |(c, bound): (&palmares_models::hand::Coordinate, &Option<f64>)| {
                bound.map(|bound| {
                    let side = if bound == c.lower { "lower" } else { "upper" };
                    format!("joint '{}' is at its {side} limit {bound:.4}", c.name)
                })
            };
            let why = hand.coordinates.iter().zip(&held).filter_map(at).collect();
            let (q, tension) = (found.q, found.tension);
            return Ok(Equilibrium { q, tension, method: Method::Newton, beyond_closed_form: why });
        }
        start = found.q;
    }
    Err(NoPrediction::Unsettled)
}

/// The equilibrium at σ under pushes and, if the hand does not cancel it, its own weight. Motors that no load turns back have gone to σ
/// slowly before the pushes act: they may have stopped on the way, and clutches may have let go. For a hand that rubs it is the one without
/// friction; [`band`](super::band::band) has the limits.
pub fn solve_loaded(
    config: &Config,
    hand: &Hand,
    base: Pose,
    sigma: &[f64],
    pushes: &[Push],
) -> Result<Equilibrium, NoPrediction> {
    let mut left = MAX_WORK;
    let s_ref =
        wound_slowly(hand, sigma, |s_ref| solve_wound_within(config, hand, base, s_ref, &[], &mut left))?;
    let mut found = solve_wound_within(config, hand, base, &s_ref, pushes, &mut left)?;
    if hand.friction_places() > 0 {
        let why = "cables or joints rub: this is the equilibrium without friction, amid those where the hand can rest";
        found.beyond_closed_form.push(why.to_owned());
    }
    Ok(found)
}

/// The same at wound lengths `s_ref`, one per tendon.
pub fn solve_wound(
    config: &Config,
    hand: &Hand,
    base: Pose,
    s_ref: &[f64],
    pushes: &[Push],
) -> Result<Equilibrium, NoPrediction> {
    solve_wound_within(config, hand, base, s_ref, pushes, &mut { MAX_WORK })
}

/// The torques of pushes and weight depend on the links' poses: q = equilibrium(τ(q)) is iterated to its fixed point. Where that
/// does not settle, the energy is minimised.
fn solve_wound_within(
    config: &Config,
    hand: &Hand,
    base: Pose,
    s_ref: &[f64],
    pushes: &[Push],
    left: &mut u64,
) -> Result<Equilibrium, NoPrediction> {
    let torque_work = torque_work(hand, pushes.len());
    let mut predict = |tau: &[f64]| {
        spend(left, torque_work)?;
        solve_limited_within(hand, config.limit_stiffness, s_ref, tau, left)
    };
    let mut found = predict(&vec![0.0; hand.coordinates.len()])?;
    if pushes.is_empty() && hand.gravity_compensation {
        return Ok(found);
    }
    let mut weight = 1.0;
    let mut last = f64::INFINITY;
    for _ in 0..ITERATIONS {
        let next = match predict(&torques(config, hand, base, &found.q, pushes)) {
            Err(NoPrediction::NoEquilibrium(_) | NoPrediction::Unsettled) => break,
            next => next?,
        };
        let change = largest_difference(&next.q, &found.q);
        // A strong push on a soft finger oscillates about its fixed point: take smaller steps then.
        if change >= last {
            weight *= 0.7;
        }
        last = change;
        let blend = |(q, target): (&f64, &f64)| q + weight * (target - q);
        let q = found.q.iter().zip(&next.q).map(blend).collect();
        found = Equilibrium { q, ..next };
        if change < SETTLED {
            return Ok(found);
        }
    }
    if last < NEARLY_SETTLED {
        return Ok(found);
    }
    minimum(config, hand, base, s_ref, pushes)
}

/// max |aᵢ − bᵢ|
pub fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use palmares_models::hand::Coordinate;

    /// Unbalanced torque on a coordinate: E (q − q₀) against tendons, a limit's spring and τ.
    fn residual(hand: &Hand, stiffness: f64, found: &Equilibrium, tau: &[f64]) -> f64 {
        let row = |i: usize| -> f64 {
            let arm = |t: usize| hand.tendons[t].moment_arms.iter().filter(move |a| a.0 == i).map(|a| a.1);
            (0..hand.tendons.len()).map(|t| arm(t).sum::<f64>() * found.tension[t]).sum()
        };
        let limit =
            |c: &Coordinate, q: f64| stiffness * (c.lower - q).max(0.0) - stiffness * (q - c.upper).max(0.0);
        let balance = |(i, c): (usize, &Coordinate)| {
            let q = found.q[i];
            (row(i) + tau[i] + limit(c, q) - c.stiffness * (q - c.rest)).abs()
        };
        hand.coordinates.iter().enumerate().map(balance).fold(0.0, f64::max)
    }

    #[test]
    fn a_joint_that_nothing_holds_has_no_place() {
        let mut hand = Hand::clone(&Hand::builtin("pinch").expect("it is built in"));
        hand.coordinates[2].stiffness = 1e-30;
        let why = solve_limited(&hand, 1e3, &[0.0, 0.0], &[0.0; 4]).expect_err("it is loose");
        assert!(why.to_string().contains("joint 'right_base' has no spring"), "{why}");
        assert_eq!(loose(&Hand::builtin("reflex").expect("it is built in")), None, "its preshape is a drive");
    }

    #[test]
    fn limits_and_saturation_are_held_where_the_closed_form_ends() {
        let hand = Hand::builtin("softhand").expect("it is built in");
        let tau = vec![0.0; 19];
        let free = solve_limited(&hand, 1e3, &[6.0], &tau).expect("a rest");
        assert_eq!((free.method, free.beyond_closed_form.len()), (Method::ClosedForm, 0));
        assert!(residual(&hand, 1e3, &free, &tau) < 1e-12);

        // σ = 0.75: the four long fingers' inner joints are at their limits.
        let limited = solve_limited(&hand, 1e3, &[9.375], &tau).expect("a rest");
        assert_eq!((limited.method, limited.beyond_closed_form.len()), (Method::Newton, 4));
        assert!(limited.beyond_closed_form[0].contains("joint 'index_inner' is at its upper limit"));
        assert!(residual(&hand, 1e3, &limited, &tau) < 1e-12);
        let most = hand.coordinates.iter().zip(&limited.q).map(|(c, q)| q - c.upper).fold(0.0, f64::max);
        assert!(most > 0.0 && most < 1e-3, "{most}");

        let strong = solve_limited(&hand, 1e3, &[40.0], &tau).expect("a rest");
        assert_eq!(strong.tension, [0.44]);
        assert!(strong.beyond_closed_form.iter().any(|w| w == "tendon 'tendon' is at its limit of 0.44"));
        let slack = solve_limited(&hand, 1e3, &[-1.0], &tau).expect("a rest");
        assert_eq!(slack.tension, [0.0]);
        assert_eq!(slack.beyond_closed_form, ["tendon 'tendon' is slack"]);
    }

    /// Fingers of two joints: as many as a file may have links, and more.
    fn hand_of_many_links(fingers: usize) -> Hand {
        let mut hand = Hand::clone(&Hand::builtin("pinch").expect("it is built in"));
        let (links, coordinates) = (hand.links[1..3].to_vec(), hand.coordinates[..2].to_vec());
        hand.gravity_compensation = false;
        for k in 0..fingers {
            let (first, n) = (hand.links.len(), hand.coordinates.len());
            for (i, link) in links.iter().enumerate() {
                let mut link = link.clone();
                link.name = format!("{}_{k}", link.name);
                link.parent = Some(if i == 0 { 0 } else { first });
                let joint = link.joint.as_mut().expect("it moves");
                joint.coordinate = n + i;
                joint.name = format!("{}_{k}", joint.name);
                hand.links.push(link);
                let name = format!("{}_{k}", coordinates[i].name);
                hand.coordinates.push(Coordinate { name, ..coordinates[i].clone() });
            }
            hand.tendons[0].moment_arms.push((n, 0.003));
        }
        hand
    }

    #[test]
    fn a_hand_of_hundreds_of_links_is_predicted_or_given_up_within_the_work_of_a_prediction() {
        let hand = hand_of_many_links(150);
        hand.validate().expect("it is a hand");
        let config = Config::default();
        let link = hand.links.len() - 1;
        let far = Push { link, point: palmares_models::Vec3::ZERO, force: palmares_models::Vec3::splat(1e3) };
        for pushes in [vec![], vec![far]] {
            let found = solve_loaded(&config, &hand, Pose::IDENTITY, &[0.5, 0.5], &pushes);
            assert!(
                found.is_ok()
                    || matches!(found, Err(NoPrediction::WorkExhausted | NoPrediction::NoEquilibrium(_))),
                "{found:?}"
            );
        }
        let tau = vec![0.0; hand.coordinates.len()];
        let found = solve_limited_within(&hand, 1e3, &[1.0, 1.0], &tau, &mut 1_000);
        assert_eq!(found, Err(NoPrediction::WorkExhausted));
    }
}
