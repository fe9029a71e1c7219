//! Reasons why a mesh has no pieces.

/// Reason why there are no pieces.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PiecesError {
    /// All in one plane.
    #[error("the mesh spans no volume: its {triangles} triangles lie in one plane, line or point")]
    Flat {
        /// Number of triangles.
        triangles: usize,
    },
    /// A sheet with two sides.
    #[error("the mesh encloses nothing: it is a sheet; give it a thickness where it was drawn")]
    Sheet,
    /// A mesh with holes in it has no inside.
    #[error(
        "the mesh is not closed: {edges} edges have a triangle on one side only, and nothing is inside; close it where it \
         was drawn, or give it a thickness. Holes narrower than a voxel, {:.2} mm here, are bridged where the mesh is \
         thicker than three",
        voxel_m * 1e3
    )]
    Leaks {
        /// Edges of an odd number of triangles.
        edges: usize,
        /// m
        voxel_m: f64,
    },
    /// The library gave up.
    #[error(
        "no pieces were found at {resolution} voxels along the longest side; another --resolution may do"
    )]
    Failed {
        /// Voxels along the longest side.
        resolution: u32,
    },
}
