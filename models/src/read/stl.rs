//! STL files: the corners of their triangles.

use mesh_loader::Scene;

use super::foreign::check_pointer;
use super::limits::Limits;
use super::report::Report;
use crate::Vec3;
use crate::error::ModelError;

/// Corners of the triangles of an STL file's bytes, scaled to metres; `element` names the file in messages.
///
/// # Errors
/// It is not STL, is truncated, has too many corners, or one that is not finite or too far away.
pub(crate) fn corners(
    bytes: &[u8],
    scale: Vec3,
    element: &str,
    limits: &Limits,
    report: &Report,
) -> Result<Vec<[Vec3; 3]>, ModelError> {
    check_pointer(bytes, element, report)?;
    let scene = scene(bytes).map_err(|e| report.syntax("STL", e))?;
    let count = scene.meshes.iter().map(|mesh| mesh.vertices.len()).sum::<usize>();
    report.limit(element, "vertices", count, limits.mesh_vertices)?;
    let mut triangles = Vec::new();
    for mesh in &scene.meshes {
        let corner = |index: u32| {
            let [x, y, z] = mesh.vertices.get(index as usize).copied().unwrap_or_default();
            Vec3::new(f64::from(x), f64::from(y), f64::from(z)) * scale
        };
        triangles.extend(mesh.faces.iter().map(|face| face.map(corner)));
    }
    let far = |p: &&Vec3| !p.to_array().iter().all(|x| x.abs() <= limits.length_m);
    if let Some(far) = triangles.iter().flatten().find(far) {
        let problem = format!("its mesh has a corner at {:.4} {:.4} {:.4} m", far.x, far.y, far.z);
        let valid = format!(
            "corners within {} m of the origin; a mesh in millimetres needs scale=\"0.001 0.001 0.001\"",
            limits.length_m
        );
        return Err(report.bad(element, problem, valid));
    }
    Ok(triangles)
}

/// Corners of triangles, sorted and unique.
pub(crate) fn points(triangles: &[[Vec3; 3]]) -> Vec<Vec3> {
    let mut points: Vec<Vec3> = triangles.iter().flatten().copied().collect();
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z)));
    points.dedup();
    points
}

/// The triangles of an STL file's bytes, scaled to metres; `None` if it is not STL, or a corner is not finite
/// or too far away.
pub(crate) fn triangles(bytes: &[u8], scale: Vec3, length_m: f64) -> Option<Vec<[[f32; 3]; 3]>> {
    let scene = scene(bytes).ok()?;
    let mut triangles = Vec::new();
    for mesh in &scene.meshes {
        let corner = |&index: &u32| {
            let [x, y, z] = *mesh.vertices.get(index as usize)?;
            let at = (Vec3::new(f64::from(x), f64::from(y), f64::from(z)) * scale).to_array();
            at.iter().all(|x| x.abs() <= length_m).then(|| at.map(|x| x as f32))
        };
        for [a, b, c] in &mesh.faces {
            triangles.push([corner(a)?, corner(b)?, corner(c)?]);
        }
    }
    Some(triangles)
}

/// The meshes of an STL file's bytes. Some programs begin the header of a binary file with `solid`, as an ASCII file
/// does: a file of the size that its number of triangles needs is binary.
fn scene(bytes: &[u8]) -> Result<Scene, String> {
    let read = |bytes: &[u8]| mesh_loader::stl::from_slice(bytes).map_err(|e| e.to_string());
    let text = bytes.trim_ascii_start().starts_with(b"solid");
    match check_count(bytes) {
        Ok(()) if text => {
            let mut binary = bytes.to_vec();
            binary[..HEADER].fill(0);
            read(&binary)
        }
        Err(_) if text => read(bytes),
        Ok(()) => read(bytes),
        Err(problem) => Err(problem),
    }
}

/// Bytes of the header of a binary STL file, and of a triangle.
const HEADER: usize = 80;
const TRIANGLE: u64 = 50;

/// Checks that a binary STL has the number of triangles that it states. Parsers trust one or the other.
fn check_count(bytes: &[u8]) -> Result<(), String> {
    let Some(count) = bytes.get(HEADER..HEADER + 4).and_then(|b| <[u8; 4]>::try_from(b).ok()) else {
        return Err(format!("{} bytes are no STL file", bytes.len()));
    };
    let (stated, body) = (u64::from(u32::from_le_bytes(count)), (bytes.len() - HEADER - 4) as u64);
    if stated * TRIANGLE <= body && body - stated * TRIANGLE <= 2 {
        return Ok(());
    }
    Err(format!("its header promises {stated} triangles, {TRIANGLE} bytes each, but {body} bytes follow"))
}
