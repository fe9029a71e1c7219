//! Decomposes a mesh that is not convex into convex pieces, which are written as files before a task is
//! played.
//!
//! 1. `mesh.rs`: triangles, and whether they enclose a volume.
//! 2. `cut.rs` cuts the mesh into parts, `merge.rs` joins parts to pieces.
//! 3. `compare.rs` measures the accuracy of the pieces.

mod compare;
mod cut;
mod error;
mod merge;
mod mesh;

pub use self::compare::{Farthest, Fit, compare};
pub use self::error::PiecesError;
pub use self::mesh::{Surface, TriangleMesh};

use crate::Vec3;
use crate::shape::hull::few_points;

/// Options of a decomposition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DecompositionOptions {
    /// Largest number of pieces.
    pub pieces: u32,
    /// Voxels along the longest side.
    pub resolution: u32,
}

/// Progress, for display.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Voxels are cut into parts.
    Cutting,
    /// Parts are joined; the number of remaining pieces.
    Joining(usize),
    /// Pieces are compared with the mesh.
    Comparing,
}

/// Largest number of points of a piece: the same as for a mesh of an object.
pub const MAX_POINTS: usize = 64;
/// Points that stand out from the others by no more than this part of the mesh's longest side are dropped.
const TOLERANCE: f64 = 3e-3;

/// A mesh is one piece if the excess of its hull over its volume is within this.
const CONVEX: f64 = 1e-3;
/// Number of resolutions tried, one voxel more each time, when the library fails.
const TRIES: usize = 8;

/// Convex pieces of a mesh: the points of each, in single precision, as a file has them. The same mesh and options give
/// the same pieces, largest first.
///
/// # Errors
/// The mesh is flat, or has no inside.
///
/// The library panics on some voxels. The panic is caught, and others are tried; a panic hook of the program
/// is called.
pub fn decompose(
    mesh: &TriangleMesh,
    options: DecompositionOptions,
    report: &mut dyn FnMut(Stage),
) -> Result<Vec<Vec<Vec3>>, PiecesError> {
    let flat = || PiecesError::Flat { triangles: mesh.triangles.len() };
    let (low, high) = mesh.bounds();
    let size = (high - low).max_element();
    // Hulls need four corners that are not in one plane.
    if !(mesh.vertices.len() >= 4 && size.is_finite() && (high - low).min_element() > 1e-6 * size) {
        return Err(flat());
    }
    report(Stage::Cutting);
    let surface = mesh.surface();
    if let Surface::Closed { volume, cavities, .. } = surface
        && let Some(Surface::Closed { volume: of_hull, .. }) =
            TriangleMesh::hull(&mesh.vertices).map(|m| m.surface())
        && of_hull <= (1.0 + CONVEX) * (volume + cavities)
    {
        return Ok(single(&mesh.vertices, size).into_iter().collect());
    }
    if surface == Surface::Empty {
        return Err(PiecesError::Sheet);
    }
    let mut cut = Err(PiecesError::Failed { resolution: options.resolution });
    for resolution in (options.resolution..).take(TRIES) {
        cut = cut::cut(mesh, &surface, resolution, options.pieces);
        if !matches!(cut, Err(PiecesError::Failed { .. })) {
            break;
        }
    }
    let (parts, voxel_m) = cut?;
    let most = options.pieces.max(1) as usize;
    let mut pieces = merge::merge(parts, most, voxel_m, &mut |left| report(Stage::Joining(left)));
    pieces.sort_by(|a, b| b.volume.total_cmp(&a.volume));
    let mut out = Vec::new();
    out.extend(
        pieces.iter().filter(|piece| piece.volume > 0.0).filter_map(|piece| single(&piece.points, size)),
    );
    if out.is_empty() { Err(flat()) } else { Ok(out) }
}

/// The points of a piece: few, and in single precision. `None` if that flattens it.
fn single(points: &[Vec3], size: f64) -> Option<Vec<Vec3>> {
    let points = few_points(points, MAX_POINTS, TOLERANCE * size)?;
    let single = |p: &Vec3| Vec3::from_array(p.to_array().map(|x| f64::from(x as f32)));
    let points: Vec<Vec3> = points.iter().map(single).collect();
    few_points(&points, MAX_POINTS, 0.0).filter(|points| points.len() >= 4)
}
