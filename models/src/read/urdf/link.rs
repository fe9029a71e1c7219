//! Shapes and mass properties of one URDF link, before fixed joints are merged.

use urdf_rs::Geometry;

use super::tree::pose;
use crate::error::ModelError;
use crate::hand::{Geom, Inertia, Pad};
use crate::measure::{bounding_box, number};
use crate::read::files::Files;
use crate::read::hollow::MeshOf;
use crate::read::mesh::{MeshHull, MeshReader};
use crate::read::options::{InertiaPolicy, LoadOptions};
use crate::read::report::Report;
use crate::read::settings::{LinkSettings, Settings};
use crate::shape::{Shape, inertia};
use crate::{Mat3, Vec3};

/// Ratio of an inertia to that of its geometry, or the inverse, above which there is a warning.
const INERTIA_RATIO: f64 = 10.0;

/// Distance of a centre of mass from the box around the shapes above which there is a warning: relative to the
/// longest edge of the box, and in m. Parts without shapes, such as motors, may be beside it.
const COM_MARGIN: f64 = 0.5;
const COM_MARGIN_M: f64 = 0.02;

/// Parts of a URDF link, in its own frame.
pub(crate) struct LinkBody {
    pub(crate) inertia: Inertia,
    pub(crate) geoms: Vec<Geom>,
    /// Softness of all shapes.
    pub(crate) pad: Option<Pad>,
}

/// Reads the links of one file.
pub(crate) struct LinkReader<'a> {
    settings: &'a Settings,
    options: &'a LoadOptions,
    meshes: MeshReader<'a>,
}

impl<'a> LinkReader<'a> {
    /// A new reader; `files` has the meshes, `None` for a hand without files.
    pub(crate) fn new(
        settings: &'a Settings,
        options: &'a LoadOptions,
        files: Option<&'a Files>,
        of: MeshOf,
    ) -> Self {
        LinkReader { settings, options, meshes: MeshReader::new(options, files, of) }
    }

    /// The settings of the hand.
    pub(crate) fn settings(&self) -> &'a Settings {
        self.settings
    }

    /// A link's shapes and inertia; reports oddities, and keeps errors of its shapes.
    pub(crate) fn read(&mut self, link: &urdf_rs::Link, report: &mut Report) -> Result<LinkBody, ModelError> {
        let default = LinkSettings::default();
        let own = self.settings.links.get(&link.name).unwrap_or(&default);
        let friction = own.friction.or(self.settings.friction).unwrap_or(self.options.friction);
        let element = format!("link '{}'", link.name);
        let mut geoms = Vec::new();
        for collision in &link.collision {
            let shape = self.shape(&collision.geometry, own, &element, report).and_then(|shape| {
                let valid = "positive finite sizes, rounding at most the half extents";
                shape.validate().map_err(|problem| report.bad(&element, problem, valid))?;
                Ok(shape)
            });
            let shape = match shape {
                // A limit of the whole file.
                Err(error @ ModelError::TooLarge { .. }) => return Err(error),
                shape => report.keep(shape),
            };
            let Some(shape) = shape else { continue };
            geoms.push(Geom { link_from_geom: pose(&collision.origin), shape, friction });
        }
        let inertia = self.inertia(link, own, &geoms, &element, report);
        check_com(&inertia, &geoms, &element, report);
        Ok(LinkBody { inertia, geoms, pad: own.pad })
    }

    fn shape(
        &mut self,
        geometry: &Geometry,
        own: &LinkSettings,
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
            Geometry::Box { size } => {
                let rounding = own.rounding.unwrap_or(0.0);
                Shape::Box { half_extents: size.map(|x| 0.5 * x), rounding }
            }
            Geometry::Mesh { filename, scale } => {
                let scale = scale.map_or(Vec3::ONE, |s| Vec3::from_array(*s));
                let hull = self.meshes.hull(filename, scale, own.mesh_rounding, element, report)?;
                let MeshHull { shape, rounded, notes } = hull;
                notes.into_iter().for_each(|note| report.warn(element, note));
                if !rounded && own.mesh_rounding.unwrap_or(self.options.hull_rounding) > 0.0 {
                    let message = format!("mesh '{filename}' is too thin to round; its hull is sharp");
                    report.warn(element, message);
                }
                shape
            }
        })
    }

    fn inertia(
        &self,
        link: &urdf_rs::Link,
        own: &LinkSettings,
        geoms: &[Geom],
        element: &str,
        report: &mut Report,
    ) -> Inertia {
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
        .moved(&pose(&i.origin));
        let mass = own.mass.unwrap_or(stated.mass);
        if mass == 0.0 {
            if !geoms.is_empty() {
                report.warn(element, "has collision geometry but no mass");
            }
            return Inertia::ZERO;
        }
        let derived = inertia::of_shapes(geoms.iter().map(|g| (g.link_from_geom, &g.shape)), mass);
        let policy = self.settings.inertia.unwrap_or(self.options.inertia);
        let derive = own.mass.is_some() || policy == InertiaPolicy::FromGeometry;
        match derived {
            Some(derived) if derive => derived,
            None if derive => {
                report.warn(element, "has no geometry to derive its inertia from; the file's is kept");
                Inertia { mass, ..stated }
            }
            derived => {
                check_inertia(&stated, derived.as_ref(), element, report);
                stated
            }
        }
    }
}

/// Warns if the centre of mass is farther outside the box around the shapes than a margin.
fn check_com(inertia: &Inertia, geoms: &[Geom], element: &str, report: &mut Report) {
    let Some((low, high)) = bounding_box(geoms).filter(|_| inertia.mass > 0.0) else { return };
    let margin = COM_MARGIN_M.max(COM_MARGIN * (high - low).max_element());
    let distance = (inertia.com - inertia.com.clamp(low, high)).length();
    if distance > margin {
        report.warn(
            element,
            format!(
                "its centre of mass is {} m outside the box around its shapes: is <inertial><origin> in metres, and in \
                 the link's frame?",
                number(distance)
            ),
        );
    }
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
