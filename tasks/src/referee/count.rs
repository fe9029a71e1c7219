//! Objects by the region in which they are.

/// Numbers of objects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Count {
    /// In the goal, or goals that have been reached.
    pub in_goal: u32,
    /// In neither region.
    pub outside: u32,
}
