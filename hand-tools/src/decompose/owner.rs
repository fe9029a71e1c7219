//! The owner of a mesh, and its limit of pieces.

/// The owner of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshOwner {
    /// An object of a task: at most 64 parts.
    Task,
    /// A link of a hand: at most 32 shapes.
    Hand,
}

impl MeshOwner {
    /// Default of `--pieces`.
    pub(super) fn default_pieces(self) -> u32 {
        match self {
            MeshOwner::Task => 32,
            MeshOwner::Hand => 16,
        }
    }

    /// Maximum of `--pieces`.
    pub(super) fn max_pieces(self) -> u32 {
        match self {
            MeshOwner::Task => 64,
            MeshOwner::Hand => 32,
        }
    }
}
