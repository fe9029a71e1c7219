//! Shapes and mass properties of one URDF link, before fixed joints are merged.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use urdf_rs::Geometry;

use crate::error::ModelError;
use crate::files::{Files, has_extension};
use crate::hand::{Geom, Inertia};
use crate::load::{InertiaPolicy, LoadOptions, Report};
use crate::settings::{LinkSettings, Settings};
use crate::shape::hull::rounded_hull;
use crate::shape::{Shape, inertia};
use crate::stl::{self, MeshLimits};
use crate::{Mat3, Vec3, urdf};

/// An inertia this many times larger or smaller than its geometry's own is reported.
const INERTIA_RATIO: f64 = 10.0;

/// What a URDF link is made of, in its own frame.
pub(crate) struct Body {
    pub(crate) inertia: Inertia,
    pub(crate) geoms: Vec<Geom>,
}

/// What a link is built with: the same for all links of a file.
pub(crate) struct Builder<'a> {
    settings: &'a Settings,
    options: &'a LoadOptions,
    /// Where meshes lie; `None` for a hand without files.
    files: Option<&'a Files>,
    /// Hulls of the meshes read so far, and whether they could be rounded; links often share them.
    hulls: RefCell<BTreeMap<MeshKey, (Shape, bool)>>,
    /// What was read for them.
    read: RefCell<MeshesRead>,
}

/// A mesh file and the bits of its scale.
type MeshKey = (PathBuf, [u64; 3]);

#[derive(Default)]
struct MeshesRead {
    bytes: u64,
    vertices: usize,
}

impl<'a> Builder<'a> {
    /// A builder that has read nothing yet.
    pub(crate) fn new(settings: &'a Settings, options: &'a LoadOptions, files: Option<&'a Files>) -> Self {
        Builder { settings, options, files, hulls: RefCell::default(), read: RefCell::default() }
    }

    /// Builds a link's body; reports what is odd about its inertia.
    pub(crate) fn body(&self, link: &urdf_rs::Link, report: &mut Report) -> Result<Body, ModelError> {
        let default = LinkSettings::default();
        let own = self.settings.links.get(&link.name).unwrap_or(&default);
        let friction = own.friction.or(self.settings.friction).unwrap_or(self.options.friction);
        let element = format!("link '{}'", link.name);
        let mut geoms = Vec::new();
        for collision in &link.collision {
            let shape = self.shape(&collision.geometry, own.rounding.unwrap_or(0.0), &element, report)?;
            shape.validate().map_err(|problem| {
                report.bad(
                    element.clone(),
                    problem,
                    "positive finite sizes, rounding at most the half extents",
                )
            })?;
            geoms.push(Geom { link_from_geom: urdf::pose(&collision.origin), shape, friction });
        }
        let inertia = self.inertia(link, own, &geoms, &element, report)?;
        Ok(Body { inertia, geoms })
    }

    fn shape(
        &self,
        geometry: &Geometry,
        rounding: f64,
        element: &str,
        report: &mut Report,
    ) -> Result<Shape, ModelError> {
        Ok(match geometry {
            Geometry::Sphere { radius } => Shape::Sphere { radius: *radius },
            Geometry::Capsule { radius, length } => {
                Shape::Capsule { radius: *radius, half_length: 0.5 * length }
            }
            Geometry::Cylinder { radius, length } => {
                Shape::Cylinder { radius: *radius, half_length: 0.5 * length }
            }
            Geometry::Box { size } => Shape::Box { half_extents: size.map(|x| 0.5 * x), rounding },
            Geometry::Mesh { filename, scale } => {
                let scale = scale.map_or(Vec3::ONE, |s| Vec3::from_array(*s));
                let (shape, rounded) = self.hull(filename, scale, element, report)?;
                if !rounded && self.options.hull_rounding > 0.0 {
                    report
                        .warn(element, format!("mesh '{filename}' is too thin to round; its hull is sharp"));
                }
                shape
            }
        })
    }

    /// The rounded hull of a mesh, and whether it could be rounded.
    fn hull(
        &self,
        name: &str,
        scale: Vec3,
        element: &str,
        report: &Report,
    ) -> Result<(Shape, bool), ModelError> {
        let relative = mesh_path(name, element, report)?;
        let key = (relative.clone(), scale.to_array().map(f64::to_bits));
        if let Some(known) = self.hulls.borrow().get(&key) {
            return Ok(known.clone());
        }
        let Some(files) = self.files else {
            return Err(report.bad(
                element.to_owned(),
                format!("names mesh '{name}', but the URDF has no folder"),
                "a hand from a folder or an archive",
            ));
        };
        let limits = &self.options.limits;
        let mut read = self.read.borrow_mut();
        report.limit(element, "mesh files up to here", self.hulls.borrow().len() + 1, limits.meshes)?;
        let bytes = files.read(&relative, element, limits.mesh_bytes).map_err(|error| match error {
            ModelError::Read { file, source } => report.bad(
                element.to_owned(),
                format!("names mesh '{name}', but {} cannot be read: {source}", file.display()),
                "an .stl file in or under the URDF's own folder",
            ),
            error => error,
        })?;
        read.bytes += bytes.len() as u64;
        let megabytes = |bytes: u64| (bytes >> 20) as usize;
        if read.bytes > limits.mesh_total_bytes {
            let (found, limit) = (megabytes(read.bytes) + 1, megabytes(limits.mesh_total_bytes));
            report.limit(element, "MB of mesh files up to here", found, limit)?;
        }
        let bounds = MeshLimits { vertices: limits.mesh_vertices, length_m: limits.length_m };
        let points = stl::read_stl(&files.display(&relative), element, &bytes, scale, bounds)?;
        read.vertices += points.len();
        report.limit(element, "mesh vertices up to here", read.vertices, limits.mesh_total_vertices)?;
        let hull = rounded_hull(&points, self.options.hull_directions, self.options.hull_rounding);
        let hull = hull.ok_or_else(|| {
            report.bad(
                element.to_owned(),
                format!("mesh '{name}' spans no volume"),
                "a mesh whose convex hull is a solid",
            )
        })?;
        self.hulls.borrow_mut().insert(key, hull.clone());
        Ok(hull)
    }

    fn inertia(
        &self,
        link: &urdf_rs::Link,
        own: &LinkSettings,
        geoms: &[Geom],
        element: &str,
        report: &mut Report,
    ) -> Result<Inertia, ModelError> {
        let i = &link.inertial;
        let stated = Inertia {
            mass: i.mass.value,
            com: Vec3::ZERO,
            about_com: Mat3::from_cols(
                Vec3::new(i.inertia.ixx, i.inertia.ixy, i.inertia.ixz),
                Vec3::new(i.inertia.ixy, i.inertia.iyy, i.inertia.iyz),
                Vec3::new(i.inertia.ixz, i.inertia.iyz, i.inertia.izz),
            ),
        }
        .moved(&urdf::pose(&i.origin));
        let mass = own.mass.unwrap_or(stated.mass);
        if !(mass.is_finite() && mass >= 0.0) {
            return Err(report.bad(
                element.to_owned(),
                format!("has mass {mass} kg"),
                "a finite mass of at least 0 kg",
            ));
        }
        if mass == 0.0 {
            if !geoms.is_empty() {
                report.warn(element, "has collision geometry but no mass");
            }
            return Ok(Inertia::ZERO);
        }
        let derived = inertia::of_shapes(geoms.iter().map(|g| (g.link_from_geom, &g.shape)), mass);
        let policy = self.settings.inertia.unwrap_or(self.options.inertia);
        let derive = own.mass.is_some() || policy == InertiaPolicy::FromGeometry;
        match derived {
            Some(derived) if derive => Ok(derived),
            None if derive => {
                report.warn(element, "has no geometry to derive its inertia from; the file's is kept");
                Ok(Inertia { mass, ..stated })
            }
            derived => {
                check_inertia(&stated, derived.as_ref(), element, report);
                Ok(stated)
            }
        }
    }
}

/// `package://name/path` and relative paths lie in the URDF's folder, and never outside it.
fn mesh_path(name: &str, element: &str, report: &Report) -> Result<PathBuf, ModelError> {
    let relative = match name.strip_prefix("package://") {
        Some(rest) => rest.split_once('/').map_or(rest, |(_, path)| path),
        None => name.strip_prefix("file://").unwrap_or(name),
    };
    let relative = Path::new(relative);
    let inside = relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
    if !inside || name.contains('\\') || !has_extension(relative, "stl") {
        let valid = "an .stl file in or under the URDF's own folder";
        return Err(report.bad(element.to_owned(), format!("names mesh '{name}'"), valid));
    }
    Ok(relative.to_owned())
}

fn check_inertia(stated: &Inertia, derived: Option<&Inertia>, element: &str, report: &mut Report) {
    if let Some(problem) = stated.implausible() {
        report.warn(element, format!("inertia {problem}"));
    }
    let Some(derived) = derived else { return };
    let (stated, derived) = (stated.principal(), derived.principal());
    let ratios: Vec<f64> = stated.iter().zip(&derived).map(|(s, d)| s / d).collect();
    let worst =
        ratios.iter().copied().fold(1.0, |w: f64, r| if (r.max(1.0 / r)) > w.max(1.0 / w) { r } else { w });
    if !(1.0 / INERTIA_RATIO..=INERTIA_RATIO).contains(&worst) {
        report.warn(
            element,
            format!(
                "inertia is {worst:.3e} times what its geometry has at the stated mass; \
                 inertia = \"from_geometry\" replaces it"
            ),
        );
    }
}
