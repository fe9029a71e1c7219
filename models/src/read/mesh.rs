//! The meshes that a URDF names: each file is read once and becomes a rounded hull.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use super::files::{Files, has_extension};
use super::options::LoadOptions;
use super::report::Report;
use super::stl;
use crate::Vec3;
use crate::error::ModelError;
use crate::shape::Shape;
use crate::shape::hull::rounded_hull;

/// Reads the meshes of one hand.
pub(crate) struct MeshReader<'a> {
    options: &'a LoadOptions,
    files: Option<&'a Files>,
    /// Hulls of the meshes read so far, and whether they could be rounded; links often share them.
    hulls: BTreeMap<MeshKey, (Shape, bool)>,
    /// Bytes of their files.
    bytes: u64,
    /// Corners of their triangles.
    vertices: usize,
}

/// A mesh file and the bits of its scale.
type MeshKey = (PathBuf, [u64; 3]);

impl<'a> MeshReader<'a> {
    /// A reader that has read nothing yet.
    pub(crate) fn new(options: &'a LoadOptions, files: Option<&'a Files>) -> Self {
        MeshReader { options, files, hulls: BTreeMap::new(), bytes: 0, vertices: 0 }
    }

    /// The rounded hull of a mesh, and whether it could be rounded.
    pub(crate) fn hull(
        &mut self,
        name: &str,
        scale: Vec3,
        element: &str,
        report: &Report,
    ) -> Result<(Shape, bool), ModelError> {
        let relative = mesh_path(name, element, report)?;
        let key = (relative.clone(), scale.to_array().map(f64::to_bits));
        if let Some(known) = self.hulls.get(&key) {
            return Ok(known.clone());
        }
        let Some(files) = self.files else {
            let problem = format!("names mesh '{name}', but the URDF has no folder");
            return Err(report.bad(element, problem, "a hand from a folder or an archive"));
        };
        let limits = &self.options.limits;
        report.limit(element, "mesh files up to here", self.hulls.len() + 1, limits.meshes)?;
        let bytes = files.read(&relative, element, limits.mesh_bytes).map_err(|error| match error {
            ModelError::Read { file, source } => report.bad(
                element,
                format!("names mesh '{name}', but {} cannot be read: {source}", file.display()),
                "an .stl file in the folder of the file that names it, or under it",
            ),
            error => error,
        })?;
        self.bytes += bytes.len() as u64;
        if self.bytes > limits.mesh_total_bytes {
            let (found, limit) = ((self.bytes >> 20) + 1, limits.mesh_total_bytes >> 20);
            report.limit(element, "MB of mesh files up to here", found, limit)?;
        }
        let of_mesh = Report::new(&files.display(&relative));
        let points = stl::vertices(&bytes, scale, element, limits, &of_mesh)?;
        self.vertices += points.len();
        report.limit(element, "mesh vertices up to here", self.vertices, limits.mesh_total_vertices)?;
        let hull = rounded_hull(&points, self.options.hull_directions, self.options.hull_rounding);
        let hull = hull.ok_or_else(|| {
            let problem = format!("mesh '{name}' spans no volume");
            report.bad(element, problem, "a mesh whose convex hull is a solid")
        })?;
        self.hulls.insert(key, hull.clone());
        Ok(hull)
    }
}

/// `package://name/path` and relative paths lie in the URDF's folder, and never outside it.
pub(crate) fn mesh_path(name: &str, element: &str, report: &Report) -> Result<PathBuf, ModelError> {
    let relative = match name.strip_prefix("package://") {
        Some(rest) => rest.split_once('/').map_or(rest, |(_, path)| path),
        None => name.strip_prefix("file://").unwrap_or(name),
    };
    let relative = Path::new(relative);
    let inside = relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
    if !inside || name.contains('\\') || !has_extension(relative, "stl") {
        let valid = "an .stl file in the folder of the file that names it, or under it";
        return Err(report.bad(element, format!("names mesh '{name}'"), valid));
    }
    Ok(relative.to_owned())
}
