//! Effects of replacing a mesh that is not convex by its convex hull, and of the points dropped from the
//! hull.

use std::path::Path;

use parry3d_f64::transformation::try_convex_hull;

use crate::Vec3;
use crate::error::LoadWarning;
use crate::pieces::{Surface, TriangleMesh};
use crate::shape::Shape;
use crate::shape::inertia::{volume, volume_of_triangles};

/// Kind of file that names a mesh; it determines the command that decomposes it.
#[derive(Clone, Copy, Debug)]
pub(crate) enum MeshOf {
    Hand,
    Task,
}

/// Ratio of the hull's volume to the mesh's above which there is a warning.
const MUCH_LARGER: f64 = 1.1;
/// The same for a mesh that is not closed: distance of the hull from it, relative to its longest side.
const DEEP: f64 = 0.05;
/// Number of points checked on such a hull.
const HULL_SAMPLES: usize = 2000;
/// Part of the hull's volume lost with dropped points above which there is a warning.
const MUCH_LOST: f64 = 0.1;
/// Distance of dropped corners from the hull above which there is a warning, m. A rounding of 2 mm takes 1.5
/// mm from a box's corner.
const FAR_OUT: f64 = 5e-3;

/// Text of a note on a mesh whose hull is much larger.
const FILLED: &str = "holes and hollows are filled";

/// Whether a warning is about a mesh whose convex hull fills its hollows.
pub fn tells_of_filled_hollows(warning: &LoadWarning) -> bool {
    warning.message.contains(FILLED)
}

/// Notes for the author of a mesh on its hull. `outer` are the mesh's corners, or those that are farthest along many
/// directions.
pub(super) fn notes(
    mesh: &TriangleMesh,
    outer: &[Vec3],
    played: &Shape,
    name: &str,
    file: &Path,
    of: MeshOf,
) -> Vec<String> {
    let Ok((vertices, faces)) = try_convex_hull(outer) else {
        return Vec::new();
    };
    let hull_volume = volume_of_triangles(&vertices, &faces);
    let mut notes = Vec::new();
    notes.extend(hollow(mesh, hull_volume, &vertices, &faces).map(|problem| {
        let command = match of {
            MeshOf::Hand => "hand",
            MeshOf::Task => "task",
        };
        let file = file.display();
        format!(
            "mesh '{name}': {problem}: {FILLED}; `palmares {command} decompose {file}` writes convex pieces"
        )
    }));
    let lost = 1.0 - volume(played) / hull_volume;
    let farthest = farthest_outside(played, &vertices);
    if lost > MUCH_LOST || farthest > FAR_OUT {
        let kept = match played {
            Shape::Hull { points, .. } => points.len(),
            _ => 0,
        };
        notes.push(format!(
            "mesh '{name}': of its convex hull {kept} points are kept, with edges rounded: {:.0} % of the hull's volume is \
             lost, and corners up to {:.1} mm",
            lost.max(0.0) * 100.0,
            farthest * 1e3
        ));
    }
    notes
}

/// Describes the filled volume.
fn hollow(mesh: &TriangleMesh, hull_volume: f64, vertices: &[Vec3], faces: &[[u32; 3]]) -> Option<String> {
    let surface = mesh.surface();
    if let Surface::Closed { volume, cavities, .. } = surface {
        // Pieces fill cavities, too.
        let times = hull_volume / (volume + cavities);
        return (times > MUCH_LARGER).then(|| {
            format!(
                "its convex hull has {times:.1} times its volume ({} for {})",
                cubic_cm(hull_volume),
                cubic_cm(volume)
            )
        });
    }
    // Without a volume, the distance of the hull from the mesh decides.
    let hull = TriangleMesh { vertices: vertices.to_vec(), triangles: faces.to_vec() };
    let filled = hull.farthest_from(mesh, HULL_SAMPLES);
    let (low, high) = mesh.bounds();
    let why = match surface {
        Surface::Open { edges } => format!("is not closed ({edges} open edges)"),
        Surface::Twisted { edges } => {
            format!("has neighbouring triangles that face opposite sides ({edges} edges)")
        }
        Surface::Closed { .. } | Surface::Empty => "encloses nothing".to_owned(),
    };
    (filled > DEEP * (high - low).max_element()).then(|| {
        format!(
            "it {why}, so that its volume is unknown, and its convex hull of {} stands up to {:.1} mm off its surface",
            cubic_cm(hull_volume),
            filled * 1e3
        )
    })
}

/// Largest distance of a hull's points outside of the shape used for collisions, m.
fn farthest_outside(played: &Shape, vertices: &[Vec3]) -> f64 {
    let Some((parry, upright)) = played.to_parry() else { return 0.0 };
    vertices.iter().map(|v| parry.distance_to_point(&upright, *v, true)).fold(0.0, f64::max)
}

/// A volume for display.
pub fn cubic_cm(volume: f64) -> String {
    let cm3 = volume * 1e6;
    if cm3 < 0.1 {
        return format!("{:.3} mm³", cm3 * 1e3);
    }
    let decimals = if cm3 >= 100.0 {
        0
    } else if cm3 >= 10.0 {
        1
    } else {
        2
    };
    format!("{cm3:.decimals$} cm³")
}
