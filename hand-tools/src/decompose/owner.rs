//! Whose mesh is taken apart, and how many pieces that allows.

/// Whose mesh is taken apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshOwner {
    /// An object of a task: at most 64 parts.
    Task,
    /// A link of a hand: at most 32 shapes.
    Hand,
}

impl MeshOwner {
    /// Pieces, if nothing else is asked for.
    pub(super) fn pieces(self) -> u32 {
        match self {
            MeshOwner::Task => 32,
            MeshOwner::Hand => 16,
        }
    }

    /// The most that one object or link may have.
    pub(super) fn most(self) -> u32 {
        match self {
            MeshOwner::Task => 64,
            MeshOwner::Hand => 32,
        }
    }
}
