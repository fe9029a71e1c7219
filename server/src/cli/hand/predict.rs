//! Where a hand should come to rest, without simulating it.

use palmares_models::Pose;
use palmares_models::hand::Hand;
use palmares_sim::actuation::equilibrium::{ClosedForm, NoClosedForm, rest};
use palmares_sim::actuation::motor::wound;
use palmares_sim::dynamics::jacobian::add_point_force;
use palmares_sim::dynamics::tree::Kinematics;
use palmares_sim::world::Push;
use palmares_sim::{Config, Model};

/// The fixed point is iterated at most so often.
const ITERATIONS: usize = 500;
/// Coordinates that change less than this are at rest, rad.
const SETTLED: f64 = 1e-14;

/// Coordinates and tensions at rest.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Equilibrium {
    /// q, rad or m.
    pub(super) q: Vec<f64>,
    /// One per tendon, in its own unit.
    pub(super) tension: Vec<f64>,
}

/// The equilibrium at wound lengths `s_ref`, one per tendon, under joint torques `tau`: the closed form of adaptive
/// synergies, which knows no joint limits, no contacts, no slack tendons and no tension limits; where moment arms
/// vary, Newton's method, which knows the last two.
pub(super) fn predicted_equilibrium(
    hand: &Hand,
    s_ref: &[f64],
    tau: &[f64],
) -> Result<Equilibrium, NoClosedForm> {
    match ClosedForm::new(hand) {
        Ok(form) => {
            let (q, tension) = form.solve(s_ref, tau);
            Ok(Equilibrium { q, tension })
        }
        Err(varying @ NoClosedForm::VaryingArms { .. }) => {
            let open: Vec<f64> = hand.coordinates.iter().map(|c| c.rest).collect();
            let rest = rest(hand, s_ref, tau, &open).map_err(|_| varying)?;
            Ok(Equilibrium { q: rest.q, tension: rest.tension })
        }
        Err(no_form) => Err(no_form),
    }
}

/// Length that every tendon is wound to at motor positions σ.
pub(super) fn wound_lengths(hand: &Hand, sigma: &[f64]) -> Vec<f64> {
    hand.tendons.iter().map(|t| wound(&hand.motors[t.motor], sigma[t.motor])).collect()
}

/// The equilibrium at σ under pushes and, where the hand does not cancel it, under its own weight. Their torques
/// depend on where the links are: q = closed form(τ(q)) is iterated to its fixed point. `None` when that does not
/// settle.
pub(super) fn settled(
    model: &Model,
    hand: &Hand,
    base: Pose,
    sigma: &[f64],
    pushes: &[Push],
) -> Result<Option<Equilibrium>, NoClosedForm> {
    let s_ref = wound_lengths(hand, sigma);
    let n = hand.coordinates.len();
    let mut found = predicted_equilibrium(hand, &s_ref, &vec![0.0; n])?;
    if pushes.is_empty() && hand.gravity_compensation {
        return Ok(Some(found));
    }
    let mut weight = 1.0;
    let mut last = f64::INFINITY;
    for _ in 0..ITERATIONS {
        let tau = torques(model.config(), hand, base, &found.q, pushes);
        let next = predicted_equilibrium(hand, &s_ref, &tau)?;
        let change = largest_difference(&next.q, &found.q);
        // A strong push on a soft finger swings about its fixed point: take smaller steps then.
        if change >= last {
            weight *= 0.7;
        }
        last = change;
        for (q, target) in found.q.iter_mut().zip(&next.q) {
            *q += weight * (target - *q);
        }
        found.tension = next.tension;
        if change < SETTLED {
            return Ok(Some(found));
        }
    }
    Ok((last < 1e-9).then_some(found))
}

/// Jᵀ of pushes and of uncompensated weight at coordinates q.
fn torques(config: &Config, hand: &Hand, base: Pose, q: &[f64], pushes: &[Push]) -> Vec<f64> {
    let mut kin = Kinematics::default();
    kin.update(hand, base, q);
    let mut tau = vec![0.0; 6 + hand.coordinates.len()];
    for push in pushes {
        let at = kin.pose[push.link].transform_point(push.point);
        add_point_force(hand, &kin, push.link, at, push.force, 1.0, &mut tau);
    }
    if !hand.gravity_compensation {
        for (i, link) in hand.links.iter().enumerate() {
            let at = kin.pose[i].transform_point(link.inertia.com);
            add_point_force(hand, &kin, i, at, config.gravity * link.inertia.mass, 1.0, &mut tau);
        }
    }
    tau.split_off(6)
}

/// max |aᵢ − bᵢ|
pub(super) fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
