//! A kind of rules.

use super::goal_info::GoalInfo;
use crate::task::objects::Objects;

/// Rules of one kind, as data. Their referee is in the same file.
pub trait RuleKind {
    /// Checks the numbers.
    fn check(&self) -> Result<(), String>;

    /// Checks the rules against the objects of the task.
    fn check_objects(&self, _: &Objects) -> Result<(), String> {
        Ok(())
    }

    /// Regions that the rules name, each with its field.
    fn regions(&self) -> Vec<(&'static str, &str)> {
        Vec::new()
    }

    /// Role of a region: `start` or `goal`.
    fn role(&self, _region: &str) -> Option<&'static str> {
        None
    }

    /// Maximum settling time after a run, s.
    fn settle_s(&self) -> f64 {
        0.0
    }

    /// Aims of the objects, from which shaped rewards are computed.
    fn aims(&self, objects: &Objects) -> Vec<Aim<'_>>;

    /// Whether an object has a destination.
    fn has_destination(&self, objects: &Objects) -> bool {
        self.aims(objects).iter().any(|aim| aim.target.is_some())
    }

    /// Whether the aims are reached in their order, and each concerns an object by its name.
    fn in_order(&self) -> bool {
        false
    }

    /// The goals with their points and tolerances, in the order in which they are reached.
    fn goals(&self) -> Vec<GoalInfo>;

    /// The rules in words, for `palmares task show`: one line or more.
    fn describe(&self) -> Vec<String>;
}

/// Aim of an object.
#[derive(Clone, Debug)]
pub struct Aim<'a> {
    /// The object, in scene order.
    pub object: usize,
    /// The point of the object that must reach the target, in the object's frame, m; None: the centre of mass.
    pub point: Option<[f64; 3]>,
    /// The target; None if the object has no destination.
    pub target: Option<Destination<'a>>,
}

/// Target of an object.
#[derive(Clone, Debug)]
pub enum Destination<'a> {
    /// A region of the task, by its name.
    Region(&'a str),
    /// A box in the frame of another object.
    Box {
        /// The other object, in scene order.
        object: usize,
        /// Lowest corner, m.
        min: [f64; 3],
        /// Highest corner, m.
        max: [f64; 3],
    },
}

/// A length vector in words, mm.
pub(super) fn mm(xs: [f64; 3]) -> String {
    xs.iter().map(|x| format!("{:.1}", x * 1e3)).collect::<Vec<_>>().join(" ")
}
