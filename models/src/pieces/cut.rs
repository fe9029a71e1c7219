//! Cuts a mesh into parts: voxels, cut by planes until each part is nearly convex (V-HACD, Mamou and
//! Ghorbel), and the part of the mesh in each.

use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};

use parry3d_f64::transformation::vhacd::{VHACD, VHACDParameters};
use parry3d_f64::transformation::voxelization::{FillMode, Voxel, VoxelSet};

use super::error::PiecesError;
use super::mesh::{Surface, TriangleMesh};
use crate::Vec3;

/// A part is cut if the volume of its hull exceeds that of its voxels by more than this part of the whole
/// hull's volume.
const CONCAVITY: f64 = 5e-4;
/// Parts per requested piece: `merge.rs` joins those that belong together.
const PARTS_PER_PIECE: u32 = 4;
/// Largest number of parts: joining them takes time.
const MAX_PARTS: u32 = 128;

/// Points of each part of a mesh, m, and the edge of the voxels. The parts cover the mesh, including its
/// closed cavities.
pub(super) fn cut(
    mesh: &TriangleMesh,
    surface: &Surface,
    resolution: u32,
    pieces: u32,
) -> Result<(Vec<Vec<Vec3>>, f64), PiecesError> {
    let (low, high) = mesh.bounds();
    let size = (high - low).max_element();
    let unit: Vec<Vec3> = mesh.vertices.iter().map(|v| (*v - low) / size).collect();
    let fill = FillMode::FloodFill { detect_cavities: false };
    let voxels = VoxelSet::voxelize(&unit, &mesh.triangles, resolution, fill, true);
    let voxel_m = voxels.scale * size;
    let place = |voxel: &Voxel| [voxel.coords.x, voxel.coords.y, voxel.coords.z];
    let on_surface: BTreeSet<[i64; 3]> =
        voxels.voxels().iter().filter(|v| v.is_on_surface).map(place).collect();
    if let Surface::Open { edges } = surface
        && on_surface.len() == voxels.len()
    {
        return Err(PiecesError::Leaks { edges: *edges, voxel_m });
    }
    let parameters = VHACDParameters {
        concavity: CONCAVITY,
        resolution,
        fill_mode: fill,
        max_convex_hulls: pieces.saturating_mul(PARTS_PER_PIECE).clamp(32, MAX_PARTS),
        ..VHACDParameters::default()
    };
    // The library's hulls panic on some point sets; other voxels give others.
    let parts = catch_unwind(AssertUnwindSafe(|| VHACD::from_voxels(&parameters, voxels)));
    let Ok(parts) = parts else { return Err(PiecesError::Failed { resolution }) };
    let points = parts.voxel_parts().iter().map(|part| {
        let mut points = part.compute_primitive_intersections(&unit, &mesh.triangles);
        // Where a cut has opened the inside, the part extends to the cut.
        for voxel in part.voxels().iter().filter(|v| v.is_on_surface && !on_surface.contains(&place(v))) {
            let middle = part.get_voxel_point(voxel);
            points.extend((0..8).map(|corner| {
                let side = |axis: usize| if corner >> axis & 1 == 0 { -0.5 } else { 0.5 };
                middle + Vec3::new(side(0), side(1), side(2)) * part.scale
            }));
        }
        points.into_iter().map(|p| low + p * size).collect()
    });
    Ok((points.collect(), voxel_m))
}
