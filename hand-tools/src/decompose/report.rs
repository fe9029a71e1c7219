//! Output of `decompose --json`.

use super::lines::Place;
use palmares_models::Vec3;
use palmares_models::pieces::Fit;
use palmares_models::shape::{Shape, inertia::volume};
use serde::Serialize;

/// The whole report.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    pub(super) mesh: String,
    pub(super) triangles: usize,
    /// Description of the surface: whether it is closed, and problems.
    pub(super) surface: String,
    pub(super) size_m: [f64; 3],
    /// Metres per unit of the mesh, along each axis.
    pub(super) scale: [f64; 3],
    /// Fit of the convex hull.
    pub(super) hull: FitReport,
    /// Fit of the pieces.
    pub(super) fit: FitReport,
    /// Folder of the pieces.
    pub(super) folder: String,
    pub(super) pieces: Vec<PieceReport>,
    /// Replacements where the mesh is named.
    pub(super) places: Vec<Place>,
}

#[derive(Debug, Serialize)]
pub(super) struct PieceReport {
    pub(super) file: String,
    pub(super) points: usize,
    pub(super) volume_m3: f64,
}

impl PieceReport {
    pub(super) fn new(name: &str, points: &[Vec3]) -> Self {
        let shape = Shape::Hull { points: points.iter().map(|p| p.to_array()).collect(), rounding: 0.0 };
        PieceReport { file: name.to_owned(), points: points.len(), volume_m3: volume(&shape) }
    }
}

/// [`Fit`] as JSON.
#[derive(Debug, Serialize)]
pub(super) struct FitReport {
    mesh_volume_m3: Option<f64>,
    pieces_volume_m3: f64,
    overlap_volume_m3: f64,
    volume_error: Option<f64>,
    beyond_m: f64,
    beyond_at: [f64; 3],
    uncovered_m: f64,
    uncovered_at: [f64; 3],
    spacing_m: f64,
    com_shift_m: Option<f64>,
    inertia_error: Option<f64>,
}

impl From<&Fit> for FitReport {
    fn from(fit: &Fit) -> Self {
        FitReport {
            mesh_volume_m3: fit.mesh_volume,
            pieces_volume_m3: fit.pieces_volume,
            overlap_volume_m3: fit.overlap_volume,
            volume_error: fit.volume_error(),
            beyond_m: fit.beyond.distance,
            beyond_at: fit.beyond.at.to_array(),
            uncovered_m: fit.uncovered.distance,
            uncovered_at: fit.uncovered.at.to_array(),
            spacing_m: fit.spacing,
            com_shift_m: fit.com_shift,
            inertia_error: fit.inertia_error,
        }
    }
}
