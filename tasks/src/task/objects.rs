//! Objects of a task.

use super::placing::plain_name;
use palmares_models::catalogue::Catalogue;
use palmares_models::error::{LoadWarning, ModelError};
use palmares_models::object::Object;
use palmares_models::read::{Files, OwnObject};
use palmares_models::shape::Shape;
use palmares_models::{Pose, content::ContentHash};
use serde::Deserialize;
use std::path::Path;
use std::sync::Arc;

/// The objects of a run: equal ones, or some of the task's own and the catalogue's.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Objects {
    /// Number of objects in a run.
    pub count: usize,
    /// Equal objects.
    #[serde(default)]
    pub equal: Option<Equal>,
    /// Names of the task's own objects and of the catalogue's, of which the seed draws `count`, none twice. If these are
    /// all, they are there in this order. Left out, it names all the task's own.
    #[serde(default)]
    pub from: Vec<String>,
    /// Objects that the task brings along.
    #[serde(default)]
    pub own: Vec<OwnObject>,
    /// Everything that can be drawn; made when the file is read.
    #[serde(skip)]
    pub(crate) kinds: Vec<DrawableObject>,
}

/// Objects of one kind that is only this task's.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Equal {
    /// Name; a number is appended.
    pub name: String,
    /// Geometry.
    pub shape: Shape,
    /// kg
    pub mass: f64,
    /// Coulomb friction coefficient.
    pub friction: f64,
    /// Lever of rolling resistance, m.
    pub rolling_friction: f64,
    /// Lever of torsional friction, m.
    #[serde(default)]
    pub torsional_friction: f64,
    /// Coefficient of restitution.
    #[serde(default)]
    pub restitution: f64,
    /// sRGB
    pub color: [f64; 3],
}

/// Something that can be drawn.
#[derive(Clone, Debug)]
pub(crate) struct DrawableObject {
    pub(crate) object: Arc<Object>,
    pub(crate) color: [f64; 3],
}

impl Objects {
    /// Reads the task's own and looks the catalogue's up; returns what is odd about them. `file` is the task's.
    pub(crate) fn resolve(
        &mut self,
        file: &Path,
        files: Option<&Files>,
    ) -> Result<Vec<LoadWarning>, ObjectError> {
        if self.count == 0 || self.count > 200 {
            return Err(format!("objects.count = {}; 1 to 200 are possible", self.count).into());
        }
        let (own, warnings) = self.read_own(file, files)?;
        if self.from.is_empty() {
            self.from = own.iter().map(|kind| kind.object.name.clone()).collect();
        }
        self.kinds = match (&self.equal, self.from.is_empty()) {
            (Some(equal), true) => vec![equal.kind()?],
            (None, false) => self.chosen(&own)?,
            _ => {
                let valid = "either `equal` or a list `from` of the task's `own` and the catalogue";
                return Err(format!("objects needs {valid}").into());
            }
        };
        Ok(warnings)
    }

    fn read_own(
        &self,
        file: &Path,
        files: Option<&Files>,
    ) -> Result<(Vec<DrawableObject>, Vec<LoadWarning>), ObjectError> {
        let (mut kinds, mut warnings): (Vec<DrawableObject>, _) = (Vec::new(), Vec::new());
        for own in &self.own {
            plain_name("objects.own.name", &own.name)?;
            if kinds.iter().any(|kind| kind.object.name == own.name) {
                return Err(format!(
                    "objects.own: two are called `{}`; each needs a name of its own",
                    own.name
                )
                .into());
            }
            if Catalogue::builtin().get(&own.name).is_some() {
                let problem = format!("objects.own: `{}` is an object of the catalogue already", own.name);
                return Err((problem + "; give it another name").into());
            }
            let (object, odd) = own.read(file, files)?;
            kinds.push(DrawableObject { object: Arc::new(object), color: own.color });
            warnings.extend(odd);
        }
        Ok((kinds, warnings))
    }

    fn chosen(&self, own: &[DrawableObject]) -> Result<Vec<DrawableObject>, String> {
        let mut kinds: Vec<DrawableObject> = Vec::new();
        for id in &self.from {
            let kind = match own.iter().find(|kind| kind.object.name == *id) {
                Some(kind) => kind.clone(),
                None => {
                    let item = Catalogue::builtin().find(id).map_err(|e| format!("objects.from: {e}"))?;
                    DrawableObject { object: Arc::clone(&item.object), color: item.color }
                }
            };
            if kinds.iter().any(|kind| kind.object.name == *id) {
                return Err(format!("objects.from names `{id}` twice"));
            }
            kinds.push(kind);
        }
        if kinds.len() < self.count {
            let (have, count) = (kinds.len(), self.count);
            return Err(format!("objects.count = {count}, but objects.from and objects.own name {have}"));
        }
        Ok(kinds)
    }

    /// Names of the objects that are there with every seed, in the order of the scene; none if the seed draws them.
    pub fn certain(&self) -> Option<Vec<String>> {
        match &self.equal {
            Some(equal) => Some((0..self.count).map(|k| format!("{}_{k}", equal.name)).collect()),
            None if self.kinds.len() == self.count => {
                Some(self.kinds.iter().map(|kind| kind.object.name.clone()).collect())
            }
            None => None,
        }
    }

    /// Takes in what the file only names.
    pub(crate) fn digest(&self, hash: &mut ContentHash) {
        hash.list(&self.kinds, |h, kind| kind.object.digest(h));
    }
}

impl Equal {
    fn kind(&self) -> Result<DrawableObject, String> {
        let parts = vec![(Pose::IDENTITY, self.shape.clone())];
        let object = Object::new(&self.name, parts, self.mass, self.friction, self.rolling_friction)
            .and_then(|object| object.with_torsional_friction(self.torsional_friction))
            .map_err(|error| format!("objects.equal: {error}"))?;
        if !(0.0..=1.0).contains(&self.restitution) {
            return Err("objects.equal.restitution must be in [0, 1]".to_owned());
        }
        let object = Arc::new(object.with_restitution(self.restitution));
        Ok(DrawableObject { object, color: self.color })
    }
}

/// An error of the objects, in the task's file or in one that it names.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ObjectError {
    /// Field and what would be valid.
    #[error("{0}")]
    Field(String),
    /// File, element and what would be valid.
    #[error(transparent)]
    File(#[from] ModelError),
}

impl From<String> for ObjectError {
    fn from(message: String) -> Self {
        ObjectError::Field(message)
    }
}
