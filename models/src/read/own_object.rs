//! A task's own object: parts and meshes, or a URDF, and the properties that a URDF cannot express.

use std::path::Path;

use serde::Deserialize;

use super::files::Files;
use super::hollow::MeshOf;
use super::mesh::MeshReader;
use super::options::LoadOptions;
use super::parts::{MAX_EXTENT_M, MAX_FRICTION, MAX_MASS_KG, MAX_PARTS, ObjectPart, place};
use super::report::Report;
use super::settings::{LinkSettings, Settings};
use super::urdf::link::LinkReader;
use super::urdf::tree;
use crate::Pose;
use crate::error::{LoadWarning, ModelError};
use crate::object::Object;
use crate::shape::Shape;

/// An object in a `task.toml`: `parts` and `mass`, or a `urdf` that has both.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OwnObject {
    /// Identifier, used by placing and rules.
    pub name: String,
    /// Source of shape and figures, and their owner: author, licence, measured or chosen.
    pub source: String,
    #[serde(default)]
    parts: Vec<ObjectPart>,
    /// kg, spread evenly over the parts.
    mass: Option<f64>,
    /// A URDF of one link, next to the task: its collision geometry and its inertial.
    urdf: Option<String>,
    /// Edge radius of the hulls of the URDF's meshes, m; 0 keeps their corners.
    mesh_rounding: Option<f64>,
    /// Coulomb friction coefficient.
    friction: f64,
    /// Lever of rolling resistance, m.
    #[serde(default)]
    rolling_friction: f64,
    /// Lever of torsional friction, m.
    #[serde(default)]
    torsional_friction: f64,
    /// Coefficient of restitution.
    #[serde(default)]
    restitution: f64,
    /// sRGB
    #[serde(default = "grey")]
    pub color: [f64; 3],
}

fn grey() -> [f64; 3] {
    [0.6, 0.6, 0.6]
}

impl OwnObject {
    /// The object, and warnings about it; `file` is the `task.toml`, `files` its folder.
    ///
    /// # Errors
    /// The file, the field and the valid values.
    pub fn read(&self, file: &Path, files: Option<&Files>) -> Result<(Object, Vec<LoadWarning>), ModelError> {
        let at = Report::new(file);
        let field = |field: &str| format!("objects.own `{}`: {field}", self.name);
        let bad = |name: &str, problem: String, valid: &str| at.bad(field(name), problem, valid);
        if self.source.trim().is_empty() {
            let valid = "author, licence, and whether the figures are measured, published or chosen";
            return Err(bad("source", "is empty".to_owned(), valid));
        }
        if !(0.0..=1.0).contains(&self.restitution) {
            return Err(bad("restitution", format!("is {}", self.restitution), "0 to 1"));
        }
        if !self.color.iter().all(|c| (0.0..=1.0).contains(c)) {
            return Err(bad("color", format!("is {:?}", self.color), "three numbers from 0 to 1"));
        }
        if self.mesh_rounding.is_some() && self.urdf.is_none() {
            let problem = "stands without a urdf".to_owned();
            return Err(bad(
                "mesh_rounding",
                problem,
                "beside `urdf`; a part of shape `mesh` has `rounding`",
            ));
        }
        let (object, warnings) = match (&self.urdf, self.parts.as_slice(), self.mass) {
            (Some(urdf), [], None) => self.read_urdf(urdf, &at, files)?,
            (None, [_, ..], Some(mass)) => self.assembled(mass, file, files)?,
            (Some(_), ..) => {
                let problem = "stands beside parts or mass".to_owned();
                return Err(bad(
                    "urdf",
                    problem,
                    "either `urdf`, which has shape and mass, or `parts` and `mass`",
                ));
            }
            (None, [], _) => {
                return Err(bad("parts", "are missing".to_owned(), "`parts` and `mass`, or a `urdf`"));
            }
            (None, _, None) => {
                return Err(bad("mass", "is missing".to_owned(), "kg, for `parts`"));
            }
        };
        if self.friction > MAX_FRICTION {
            return Err(bad("friction", format!("is {}", self.friction), "at most 1000"));
        }
        if object.mass > MAX_MASS_KG {
            return Err(bad("mass", format!("is {} kg", object.mass), "at most 20 kg"));
        }
        let (low, high) = object.bounds();
        let size = (high - low).to_array();
        if size.iter().any(|x| *x > MAX_EXTENT_M) {
            return Err(bad("parts", format!("measure {size:.3?} m"), "at most 1 m along each axis"));
        }
        Ok((object.with_restitution(self.restitution), warnings))
    }

    fn assembled(
        &self,
        mass: f64,
        file: &Path,
        files: Option<&Files>,
    ) -> Result<(Object, Vec<LoadWarning>), ModelError> {
        let options = LoadOptions::default();
        let mut meshes = MeshReader::new(&options, files, MeshOf::Task);
        let mut at = Report::new(file);
        let mut parts: Vec<(Pose, Shape)> = Vec::new();
        for (k, part) in self.parts.iter().enumerate() {
            let element = format!("objects.own `{}`: part {k}", self.name);
            let bad = |problem| {
                at.bad(&element, problem, "finite sizes in m, angles in rad, points that span a volume")
            };
            match part {
                ObjectPart::Mesh { file, scale, rounding, at: position, rpy } => {
                    let pose = place(position, rpy).map_err(bad)?;
                    let scale = crate::Vec3::from_array(*scale);
                    let hull = meshes.hull(file, scale, *rounding, &element, &at)?;
                    parts.push((pose, hull.shape));
                    hull.notes.into_iter().for_each(|note| at.warn(&element, note));
                }
                part => parts.extend(part.solids().map_err(bad)?),
            }
        }
        if parts.len() > MAX_PARTS {
            let element = format!("objects.own `{}`: parts", self.name);
            let valid = format!("at most {MAX_PARTS}, a wall's slabs counted one by one");
            return Err(at.bad(element, format!("are {}", parts.len()), valid));
        }
        let object = Object::new(&self.name, parts, mass, self.friction, self.rolling_friction);
        Ok((self.named(object, &at)?, at.warnings))
    }

    fn read_urdf(
        &self,
        urdf: &str,
        at: &Report,
        files: Option<&Files>,
    ) -> Result<(Object, Vec<LoadWarning>), ModelError> {
        let element = format!("objects.own `{}`: urdf", self.name);
        let Some(files) = files else {
            let problem = format!("names `{urdf}`, but the task has no folder");
            return Err(at.bad(element, problem, "a task from a folder"));
        };
        let options = LoadOptions { friction: self.friction, ..LoadOptions::default() };
        let relative = Path::new(urdf);
        let bytes = files.read(relative, &element, options.limits.text_bytes)?;
        let mut report = Report::new(&files.display(relative));
        let text = String::from_utf8(bytes).map_err(|e| report.syntax("UTF-8", e))?;
        let tree = tree::parse(&text, &options.limits, &mut report)?;
        let tree = tree.filter(|_| report.kept() == 0).ok_or_else(|| report.refusal())?;
        let [link] = tree.robot.links.as_slice() else {
            let problem = format!("has {} links", tree.robot.links.len());
            return Err(report.bad("robot", problem, "one link: an object is rigid"));
        };
        let element = format!("link '{}'", link.name);
        let own = LinkSettings { mesh_rounding: self.mesh_rounding, ..LinkSettings::default() };
        let settings =
            Settings { links: [(link.name.clone(), own)].into_iter().collect(), ..Settings::default() };
        let body = LinkReader::new(&settings, &options, Some(files), MeshOf::Task).read(link, &mut report)?;
        if report.kept() > 0 {
            return Err(report.refusal());
        }
        if body.geoms.is_empty() {
            return Err(report.bad(element, "has no collision geometry", "one <collision> or more"));
        }
        if body.inertia.mass <= 0.0 {
            return Err(report.bad(
                element,
                "has no mass",
                "an <inertial> with a positive mass and its inertia",
            ));
        }
        let parts = body.geoms.into_iter().map(|geom| (geom.link_from_geom, geom.shape)).collect();
        let object =
            Object::with_inertia(&self.name, parts, &body.inertia, self.friction, self.rolling_friction);
        Ok((self.named(object, &report)?, report.warnings))
    }

    /// Adds the file to an error.
    fn named(&self, object: Result<Object, ModelError>, at: &Report) -> Result<Object, ModelError> {
        object.and_then(|object| object.with_torsional_friction(self.torsional_friction)).map_err(|error| {
            match error {
                ModelError::Inconsistent { element, problem, .. } => {
                    let element = format!("objects.own `{}`: {element}", self.name);
                    at.bad(element, problem, "sizes and a mass of more than 0, friction of at least 0")
                }
                error => error,
            }
        })
    }
}
