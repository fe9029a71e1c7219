//! Limits of a world: distance, speed, and the computing budget of a step.
//!
//! Computing is counted, not timed, so that every machine stops at the same step. The unit is a multiply-add,
//! or about a nanosecond on a present core; the cost of each part of the step is estimated from its sizes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Largest budget of a step. The most expensive step of a hand that digs in a heap of thirty balls, at 1 ms,
/// took 1.1 million; of ten balls, half a million. The first step of a tower of 102 planks in one island
/// takes more than 20 million, 10 ms of wall time. Valid scenes stay well within the budget.
pub const STEP_WORK: u64 = 100_000_000;

/// Number of objects up to which [`STEP_WORK`] holds. The cost of factoring a heap's matrix grows with the
/// square of its bodies, and the iterations of its island with their number; the budget grows with both.
const STEP_WORK_OBJECTS: u64 = 100;

/// Computing budget of a step in a world of `objects`.
pub fn step_work(objects: usize) -> u64 {
    let objects = (objects as u64).max(STEP_WORK_OBJECTS);
    (STEP_WORK / STEP_WORK_OBJECTS.pow(3)).saturating_mul(objects.saturating_pow(3))
}

/// Largest number of iterations for an island of `objects`, if one of up to [`STEP_WORK_OBJECTS`] may take
/// `most`: a correction at one end of a heap has to reach the other end. 500 poured bodies took up to 113
/// with steps of 4 ms and 208 with 8 ms.
pub(crate) fn step_iterations(most: usize, objects: usize) -> usize {
    most.saturating_mul(objects.max(STEP_WORK_OBJECTS as usize)) / STEP_WORK_OBJECTS as usize
}

/// Largest number of substeps into which the step of an undamped hand is divided.
pub(crate) const MAX_SUBSTEPS: u32 = 1024;

/// Largest distance from the origin, m, and largest joint coordinate, m or rad. At this distance contacts are
/// still exact to a nanometre.
pub const MAX_DISTANCE: f64 = 1e6;

/// Largest component of a velocity, m/s or rad/s.
pub const MAX_SPEED: f64 = 1e5;

/// Distance between two shapes.
pub(crate) const DISTANCE_WORK: u64 = 1_000;

/// Contact points of two shapes.
pub(crate) const MANIFOLD_WORK: u64 = 2_000;

/// One contact point in one iteration, or in one evaluation of the line search.
pub(crate) const POINT_WORK: u64 = 100;

/// One link in a recursion over the hand.
pub(crate) const LINK_WORK: u64 = 300;

/// Reason why a world cannot continue. From then on it does not move. The wire, the log and Python take code
/// and wording of a fault from here. A new kind goes to the end, so that the bytes of snapshots do not
/// change.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    Serialize,
    Deserialize,
    JsonSchema,
    strum::IntoStaticStr,
    strum::VariantArray,
    thiserror::Error,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Fault {
    /// A number of the state is infinite or NaN.
    #[error("a number of the state is not finite")]
    NotFinite,
    /// A body is too fast or too far away.
    #[error("something is faster than {MAX_SPEED:e} m/s or rad/s, or farther than {MAX_DISTANCE:e} m or rad")]
    OutOfBounds,
    /// The matrix of a step is not positive definite, so that the step has no solution.
    #[error("a step has no solution: its matrix is not positive definite")]
    Unsolvable,
    /// A step needs more computing than its budget.
    #[error("a step exceeded its computing budget")]
    WorkExhausted,
    /// The program itself failed. No step returns this: the code that catches the panic reports it.
    #[error("the program that computes the world failed")]
    Crashed,
}

impl Fault {
    /// All kinds.
    pub const ALL: &'static [Fault] = <Fault as strum::VariantArray>::VARIANTS;

    /// Code for programs, as serde writes it.
    pub fn code(self) -> &'static str {
        self.into()
    }

    /// Advice for people.
    pub fn advice(self) -> &'static str {
        match self {
            Fault::NotFinite | Fault::OutOfBounds => {
                "something light is thrown: try weaker tendons and springs, slower motors, heavier links or more damping"
            }
            Fault::Unsolvable => {
                "inertia and stiffness of the hand are too far apart for a step: try heavier links, or softer springs and tendons"
            }
            Fault::WorkExhausted => {
                "too much touches at once, or something moves too fast: try fewer shapes and objects, more damping or slower motors"
            }
            Fault::Crashed => {
                "that is a fault of the program: please report it with task, hand, seed and actions"
            }
        }
    }

    /// Meaning and advice in one sentence.
    pub fn in_words(self) -> String {
        format!("{self}; {}", self.advice())
    }
}

/// Cost of a recursion over the hand's links and its dense matrix of n rows.
pub(crate) fn hand_work(links: usize, n: usize) -> u64 {
    LINK_WORK * links as u64 + 4 * (n * n) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_step_may_compute_grows_from_a_hundred_objects_on_and_has_an_end() {
        assert_eq!([0, 1, 100].map(step_work), [STEP_WORK; 3]);
        assert_eq!(step_work(1000), 1000 * STEP_WORK);
        assert_eq!(step_work(usize::MAX), u64::MAX);
        assert_eq!([1, 100, 150, 1000].map(|objects| step_iterations(200, objects)), [200, 200, 300, 2000]);
    }

    #[test]
    fn every_fault_has_a_code_of_its_own_and_words() {
        let mut codes: Vec<&str> = Fault::ALL.iter().map(|fault| fault.code()).collect();
        assert_eq!(codes, ["not_finite", "out_of_bounds", "unsolvable", "work_exhausted", "crashed"]);
        codes.dedup();
        assert_eq!(codes.len(), Fault::ALL.len());
        for fault in Fault::ALL {
            let words = fault.in_words();
            assert!(words.contains("; ") && !words.contains(fault.code()), "{words}");
        }
    }
}
