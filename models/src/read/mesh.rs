//! Meshes of a URDF or a task: each file is read once and becomes a convex hull.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use super::files::{Files, has_extension, read_limited};
use super::hollow::{MeshOf, notes};
use super::limits::Limits;
use super::options::LoadOptions;
use super::report::Report;
use super::stl;
use crate::Vec3;
use crate::error::ModelError;
use crate::pieces::TriangleMesh;
use crate::shape::Shape;
use crate::shape::hull::{THINNED_DIRECTIONS, outermost, rounded_hull, sharp_hull};

/// Largest edge radius of a mesh's hull, m.
const MAX_ROUNDING: f64 = 0.1;

/// Result of reading a mesh.
#[derive(Clone)]
pub(crate) struct MeshHull {
    pub(crate) shape: Shape,
    /// False if it is too thin to be rounded.
    pub(crate) rounded: bool,
    /// Notes for its author.
    pub(crate) notes: Vec<String>,
}

/// Reads the meshes of one hand or object.
pub(crate) struct MeshReader<'a> {
    options: &'a LoadOptions,
    files: Option<&'a Files>,
    of: MeshOf,
    /// Hulls of the meshes read so far; links often share them.
    hulls: BTreeMap<MeshKey, MeshHull>,
    /// Bytes of their files.
    bytes: u64,
    /// Corners of their triangles.
    vertices: usize,
    /// Points from which their hulls are made.
    hull_points: usize,
}

/// A mesh file, and the bits of its scale and of its rounding.
type MeshKey = (PathBuf, [u64; 3], u64);

impl<'a> MeshReader<'a> {
    /// A reader without any meshes yet.
    pub(crate) fn new(options: &'a LoadOptions, files: Option<&'a Files>, of: MeshOf) -> Self {
        MeshReader { options, files, of, hulls: BTreeMap::new(), bytes: 0, vertices: 0, hull_points: 0 }
    }

    /// The hull of a mesh with edges of this radius; by default the options'. With 0 it keeps its corners.
    pub(crate) fn hull(
        &mut self,
        name: &str,
        scale: Vec3,
        rounding: Option<f64>,
        element: &str,
        report: &Report,
    ) -> Result<MeshHull, ModelError> {
        let relative = mesh_path(name, element, report)?;
        if let Some(rounding) = rounding.filter(|r| !(0.0..=MAX_ROUNDING).contains(r)) {
            let valid = format!("0 to {MAX_ROUNDING} m; 0 keeps edges as they are");
            return Err(report.bad(element, format!("mesh '{name}' has rounding {rounding}"), valid));
        }
        let bits = rounding.map_or(u64::MAX, f64::to_bits);
        let key = (relative.clone(), scale.to_array().map(f64::to_bits), bits);
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
            ModelError::Read { file, error } => report.bad(
                element,
                format!("names mesh '{name}', but {} cannot be read: {error}", file.display()),
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
        let triangles = stl::corners(&bytes, scale, element, limits, &of_mesh)?;
        let points = stl::points(&triangles);
        self.vertices += points.len();
        report.limit(element, "mesh vertices up to here", self.vertices, limits.mesh_total_vertices)?;
        self.hull_points += points.len().min(THINNED_DIRECTIONS);
        report.limit(
            element,
            "points of mesh hulls up to here",
            self.hull_points,
            limits.mesh_hull_points,
        )?;
        let (outer, directions) = (outermost(&points), self.options.hull_directions);
        let hull = match rounding {
            // Minus zero, too.
            Some(0.0) => sharp_hull(&points, directions).map(|shape| (shape, true)),
            _ => rounded_hull(&outer, directions, rounding.unwrap_or(self.options.hull_rounding)),
        };
        let (shape, rounded) = hull.ok_or_else(|| {
            let problem = format!("mesh '{name}' spans no volume");
            report.bad(element, problem, "a mesh whose convex hull is a solid")
        })?;
        let file = files.display(&relative);
        let notes = notes(&TriangleMesh::new(&triangles), &outer, &shape, name, &file, self.of);
        let hull = MeshHull { shape, rounded, notes };
        self.hulls.insert(key, hull.clone());
        Ok(hull)
    }
}

/// The triangles of an STL file, scaled to metres.
///
/// # Errors
/// It cannot be read, is not STL, or is larger than the limits allow.
pub fn triangle_mesh(file: &Path, scale: Vec3, limits: &Limits) -> Result<TriangleMesh, ModelError> {
    let bytes = read_limited(file, "mesh", limits.mesh_bytes)?;
    stl::corners(&bytes, scale, "mesh", limits, &Report::new(file)).map(|corners| TriangleMesh::new(&corners))
}

/// The collision points of an STL file's bytes for a hull that keeps its corners, in metres; `None` if they
/// span no volume.
pub fn played_points(bytes: &[u8], scale: Vec3) -> Option<Vec<Vec3>> {
    let (limits, report) = (Limits::default(), Report::new(Path::new("")));
    let corners = stl::corners(bytes, scale, "mesh", &limits, &report).ok()?;
    match sharp_hull(&stl::points(&corners), LoadOptions::default().hull_directions)? {
        Shape::Hull { points, .. } => Some(points.into_iter().map(Vec3::from_array).collect()),
        _ => None,
    }
}

/// `package://name/path` and relative paths are relative to the URDF's folder, and never outside it.
pub(crate) fn mesh_path(name: &str, element: &str, report: &Report) -> Result<PathBuf, ModelError> {
    let relative = match name.strip_prefix("package://") {
        Some(rest) => rest.split_once('/').map_or(rest, |(_, path)| path),
        None => name.strip_prefix("file://").unwrap_or(name),
    };
    let relative = Path::new(relative);
    let inside = relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
    if !inside || name.contains('\\') || !has_extension(relative, "stl") {
        let convertible = ["obj", "dae", "glb", "off"].iter().any(|kind| has_extension(relative, kind));
        let hint = if convertible {
            "; `palmares task decompose` and `palmares hand import` convert it"
        } else {
            ""
        };
        let valid = format!("an .stl file in the folder of the file that names it, or under it{hint}");
        return Err(report.bad(element, format!("names mesh '{name}'"), valid));
    }
    Ok(relative.to_owned())
}
