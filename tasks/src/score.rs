//! Points.

use crate::task::Collect;

/// Objects by where they ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Count {
    /// In the goal box, or goals that have been reached.
    pub in_goal: u32,
    /// In neither box.
    pub outside: u32,
}

/// Points of a count.
pub fn score(rules: &Collect, count: Count) -> f64 {
    rules.in_goal * f64::from(count.in_goal) + rules.outside * f64::from(count.outside)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::{Rules, Task};

    #[test]
    fn balls_count_one_and_minus_a_half() {
        let task = &Task::builtin()[0];
        let Rules::Collect(rules) = &task.rules else { panic!("balls are collected") };
        assert_eq!(score(rules, Count { in_goal: 7, outside: 2 }), 6.0);
        assert_eq!(score(rules, Count::default()), 0.0);
    }
}
