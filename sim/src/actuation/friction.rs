//! Dry friction: of cables on the guides that they pass (Euler–Eytelwein), and of joints.
//!
//! A cable slides on guide k with `w_k`, the rate of the part of its length s(q) that lies beyond the guide. The tension beyond is
//! `T_k = T_{k−1} − F` with `−T_{k−1} (e^{μφ} − 1) ≤ F ≤ T_{k−1} (1 − e^{−μφ})`: the upper bound where the cable moves towards the
//! motor, the lower one where it is pulled out. A joint resists its rate with a torque between ±friction. Both are one law,
//! `ScalarLaw::Friction`, on a row of the problem. The bounds of a cable depend on tensions of the same step: [`Passes`] iterates.

use super::row::row;
use crate::solver::terms::{RowTerm, ScalarLaw};
use palmares_models::hand::{Guide, Hand, Tendon};

/// Stiffness of a guide's hold of a cable that sticks, as a multiple of the cable's: it gives way by a thousandth of what the cable does.
const HOLD: f64 = 1e3;

/// Way, rad or m, by which a joint that sticks gives way to its full dry friction.
const GIVE: f64 = 1e-5;

/// A loss of tension has converged when its bounds would change it by less than this part of the tension...
const TOLERANCE: f64 = 1e-4;

/// ... or of the largest tension.
const SMALLEST: f64 = 1e-7;

/// Largest slope of the tension over the tension that its bounds assume, for which a secant step is taken.
const MAX_SLOPE: f64 = 0.98;

/// The rows, without laws.
pub(super) fn empty_rows(hand: &Hand) -> Vec<RowTerm> {
    let of_guides = hand.tendons.iter().flat_map(Tendon::rubbing).map(|(_, beyond)| {
        let mut arms: Vec<(usize, f64)> = beyond.iter().map(|guide| (guide.coordinate, 0.0)).collect();
        arms.sort_by_key(|arm| arm.0);
        row(&arms)
    });
    of_guides.chain(hand.dry_joints().map(|(c, _)| row(&[(c, 1.0)]))).collect()
}

/// Writes laws and moment arms of a step of length h. `tendons` are the rows of the tendons; `tension` and `friction` those of the last step.
pub(super) fn terms(
    hand: &Hand,
    tendons: &[RowTerm],
    h: f64,
    (tension, friction): (&[f64], &[f64]),
    terms: &mut [RowTerm],
) {
    let mut at = 0;
    for ((tendon, of), t0) in hand.tendons.iter().zip(tendons).zip(tension) {
        let mut t = *t0;
        for (guide, _) in tendon.rubbing() {
            let (term, held) = (&mut terms[at], friction[at]);
            for entry in &mut term.row {
                let arm = of.row.iter().find(|arm| arm.0 == entry.0);
                entry.1 = arm.map_or(0.0, |arm| arm.1);
            }
            let [low, high] = bounds(guide, t);
            term.law = ScalarLaw::Friction { h, stiffness: HOLD * tendon.stiffness, held, low, high };
            t -= held.clamp(low, high);
            at += 1;
        }
    }
    for ((_, most), (term, held)) in hand.dry_joints().zip(terms[at..].iter_mut().zip(&friction[at..])) {
        let (stiffness, held) = (most / GIVE, *held);
        term.law = ScalarLaw::Friction { h, stiffness, held, low: -most, high: most };
    }
}

/// Least and largest loss of tension at a guide before which the tension is t.
fn bounds(guide: &Guide, t: f64) -> [f64; 2] {
    let t = t.max(0.0);
    [-t * libm::expm1(guide.exponent()), -t * libm::expm1(-guide.exponent())]
}

/// Tension of a cable before its first guide with friction and beyond each, in a state.
pub fn along(hand: &Hand, tendon: usize, tension: &[f64], friction: &[f64]) -> Vec<f64> {
    let first: usize = hand.tendons[..tendon].iter().map(|tendon| tendon.rubbing().count()).sum();
    let mut t = tension[tendon];
    let beyond = friction[first..].iter().take(hand.tendons[tendon].rubbing().count()).map(|loss| {
        t -= loss;
        t
    });
    std::iter::once(tension[tendon]).chain(beyond).collect()
}

/// Replaces the `forces` of the rows, whose laws are `terms`, by those at other tensions: a guide that slides goes on to slide.
pub(crate) fn at_tensions(
    hand: &Hand,
    tension: impl Fn(usize) -> f64,
    terms: &[RowTerm],
    forces: &mut [f64],
) {
    let mut rows = terms.iter().zip(forces);
    for (k, tendon) in hand.tendons.iter().enumerate() {
        let mut t = tension(k);
        for ((guide, _), (term, force)) in tendon.rubbing().zip(&mut rows) {
            *force = loss(*force, &term.law, bounds(guide, t));
            t -= *force;
        }
    }
}

/// Torques of dry friction at coordinates q: calls `add` with pairs of coordinate and torque; several of one coordinate add up.
pub fn torques(hand: &Hand, q: &[f64], friction: &[f64], mut add: impl FnMut(usize, f64)) {
    let mut losses = friction.iter();
    for tendon in &hand.tendons {
        for ((_, beyond), loss) in tendon.rubbing().zip(&mut losses) {
            tendon.gradient(q, |c, r| {
                if beyond.iter().any(|guide| guide.coordinate == c) {
                    add(c, -r * loss);
                }
            });
        }
    }
    for ((c, _), torque) in hand.dry_joints().zip(losses) {
        add(c, -torque);
    }
}

/// Torques of cables that slide on all their guides: `direction` is 1 towards the motor, −1 outwards; with a `part` of every μφ.
pub(crate) fn sliding(
    hand: &Hand,
    q: &[f64],
    tension: &[f64],
    direction: f64,
    part: f64,
    add: &mut impl FnMut(usize, f64),
) {
    for (tendon, t0) in hand.tendons.iter().zip(tension) {
        let mut exponent = 0.0;
        let beyond: Vec<(usize, f64)> = (tendon.guides.iter())
            .map(|guide| {
                exponent += guide.exponent();
                (guide.coordinate, t0 * libm::expm1(-direction * part * exponent))
            })
            .collect();
        tendon.gradient(q, |c, r| {
            let more = beyond.iter().find(|entry| entry.0 == c).map_or(0.0, |entry| entry.1);
            add(c, r * more);
        });
    }
}

/// Repeated solves of a step until the bounds are those of its own tensions.
#[derive(Default)]
pub(crate) struct Passes {
    /// By tendon: tension that the bounds assume, and that of the solution; of this pass and the one before.
    tensions: Vec<[(f64, f64); 2]>,
    /// Tension of every tendon, and force of every row, in the solution.
    solved: Vec<f64>,
    forces: Vec<f64>,
}

impl Passes {
    /// Begins a step whose bounds assume these tensions.
    pub(crate) fn begin(&mut self, tension: &[f64]) {
        self.tensions.clear();
        self.tensions.extend(tension.iter().map(|&t| [(t, f64::NAN); 2]));
    }

    /// Takes the solution: tension of every tendon, and force of every row of friction.
    pub(crate) fn read(&mut self, tension: impl Iterator<Item = f64>, force: impl Iterator<Item = f64>) {
        self.solved.clear();
        self.solved.extend(tension);
        self.forces.clear();
        self.forces.extend(force);
    }

    /// Whether the bounds in `terms`, the rows of friction, differ from those of the solution. They are then replaced by better ones.
    pub(crate) fn improve(&mut self, hand: &Hand, terms: &mut [RowTerm]) -> bool {
        let (mut at, mut any) = (0, false);
        for (k, tendon) in hand.tendons.iter().enumerate() {
            let solved = self.solved[k];
            let content = TOLERANCE * solved.abs() + SMALLEST * tendon.most_held();
            let first = at;
            let mut t = solved;
            let mut off = false;
            for (guide, _) in tendon.rubbing() {
                let f = self.forces[at];
                let due = loss(f, &terms[at].law, bounds(guide, t));
                off |= (due - f).abs() > content;
                t -= due;
                at += 1;
            }
            if !off {
                continue;
            }
            any = true;
            let [now, before] = &mut self.tensions[k];
            now.1 = solved;
            let slope = (now.1 - before.1) / (now.0 - before.0);
            // Tension over assumed tension is a straight line while the same guides slide: its fixed point is the answer.
            let straight = slope.is_finite() && slope < MAX_SLOPE;
            let next = if straight { (now.1 - slope * now.0) / (1.0 - slope) } else { now.1 };
            let mut t = next.max(0.0);
            *before = std::mem::replace(now, (t, f64::NAN));
            for (i, (guide, _)) in (first..).zip(tendon.rubbing()) {
                let f = self.forces[i];
                let due = loss(f, &terms[i].law, bounds(guide, t));
                if let ScalarLaw::Friction { low, high, .. } = &mut terms[i].law {
                    [*low, *high] = bounds(guide, t);
                }
                t -= due;
            }
        }
        any
    }
}

/// The loss of tension with other bounds: at a bound it stays there, between them it stays if it can.
fn loss(f: f64, law: &ScalarLaw, [low, high]: [f64; 2]) -> f64 {
    match law {
        ScalarLaw::Friction { high: most, .. } if f >= *most => high,
        ScalarLaw::Friction { low: least, .. } if f <= *least => low,
        _ => f.clamp(low, high),
    }
}
