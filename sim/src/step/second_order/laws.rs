//! What every law does in the correction.

use crate::solver::friction_cone::ConeHessian;
use crate::solver::linear::Linear;
use crate::solver::problem::Point;
use crate::solver::terms::{AxisTerm, ScalarLaw};
use crate::state::State;
use palmares_models::hand::Hand;

/// A law about its solution at the rate u, which has changed by `change`, while the reference of the row has moved by `wound`. Friction is
/// held if it sticks, and a drive always; None for a spring that acts only in a part of the step, such as a cable that becomes slack.
pub(super) fn linear(law: &ScalarLaw, u: f64, change: f64, wound: f64) -> Option<Linear> {
    let before = u - change;
    let (h, before_error, error, [low, high], [stiffness, damping, target]) = match *law {
        ScalarLaw::Servo { h, stiffness, damping, error, target, limit } => {
            (h, error - h * target - wound, error, [-limit, limit], [stiffness, damping, target])
        }
        ScalarLaw::Tendon { h, stiffness, damping, error, limit } => {
            (h, error - wound, error, [0.0, limit], [stiffness, damping, 0.0])
        }
        ScalarLaw::Friction { h, stiffness, held, low, high } => {
            let force = held + h * stiffness * u;
            let turn = match u * before < 0.0 {
                true if force >= high => high - low,
                true if force <= low => low - high,
                _ => 0.0,
            };
            let slides = turn != 0.0 || force >= high && before >= 0.0 || force <= low && before <= 0.0;
            return Some(Linear { held: !slides, turn, ..Linear::default() });
        }
        ScalarLaw::Limit { target, .. } => return Some(Linear { held: u < target, ..Linear::default() }),
        ScalarLaw::Driven(_) => return Some(Linear { held: true, ..Linear::default() }),
    };
    let force = |error: f64, u: f64| stiffness * error + damping * (target - u);
    // At both ends, and where the mean of the rates leads.
    let mean = 0.5 * (before + u);
    let forces = [force(before_error, before), force(error - h * u, u), force(error - h * mean, u)];
    match forces.map(|f| i32::from(f >= high) - i32::from(f <= low)) {
        [0, 0, _] => Some(Linear { stiffness, fall: forces[0] - forces[1], ..Linear::default() }),
        [a, b, c] => (a == b && b == c).then(Linear::default),
    }
}

/// Whether a coordinate passes its limit within the step, if it moves on by `way` along the term's sign.
pub(super) fn passes(hand: &Hand, state: &State, term: &AxisTerm, way: f64) -> bool {
    let ScalarLaw::Limit { .. } = term.law else { return false };
    let (coordinate, q) = (&hand.coordinates[term.dof - 6], state.q[term.dof - 6]);
    let gap = if term.sign > 0.0 { q - coordinate.lower } else { coordinate.upper - q };
    gap + way < 0.0
}

/// Whether a point is held: along its normal if it bears or would overlap, and along its tangents (true) if it sticks or turns round.
pub(super) fn holds(point: &Point) -> Option<bool> {
    let (impulse, law) = point.law.impulse(point.velocity);
    let change = point.change();
    // Twice the mean velocity in the step.
    let twice: [f64; 4] = std::array::from_fn(|k| 2.0 * point.velocity[k] - change[k]);
    match law {
        ConeHessian::Open => (twice[2] < 2.0 * point.law.target[2]).then_some(false),
        ConeHessian::Stick => Some(true),
        ConeHessian::Slip(..) => {
            Some(impulse[0] * twice[0] + impulse[1] * twice[1] + impulse[3] * twice[3] > 0.0)
        }
    }
}
