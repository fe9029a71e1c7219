//! Which objects a task has, and how they get to where they start.

use palmares_models::catalogue::Catalogue;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Pose, content::ContentHash};
use serde::Deserialize;
use std::sync::Arc;

/// The objects of a run: equal ones, or some of the catalogue's. One of the two must be given.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Objects {
    /// How many there are in a run.
    pub count: usize,
    /// Equal objects.
    #[serde(default)]
    pub equal: Option<Equal>,
    /// Identifiers of the catalogue, of which the seed draws `count`, none twice.
    #[serde(default)]
    pub from: Vec<String>,
    /// Everything that can be drawn; made when the file is read.
    #[serde(skip)]
    pub(crate) kinds: Vec<Kind>,
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
    /// Coefficient of restitution.
    #[serde(default)]
    pub restitution: f64,
    /// sRGB
    pub color: [f64; 3],
}

/// Something that can be drawn.
#[derive(Clone, Debug)]
pub(crate) struct Kind {
    pub(crate) object: Arc<Object>,
    pub(crate) color: [f64; 3],
}

impl Objects {
    /// Looks the objects up, or says what is wrong.
    pub(crate) fn resolve(&mut self) -> Result<(), String> {
        if self.count == 0 || self.count > 200 {
            return Err(format!("objects.count = {}; 1 to 200 are possible", self.count));
        }
        self.kinds = match (&self.equal, self.from.is_empty()) {
            (Some(equal), true) => {
                let parts = vec![(Pose::IDENTITY, equal.shape.clone())];
                let (mass, friction, rolling) = (equal.mass, equal.friction, equal.rolling_friction);
                let object = Object::new(&equal.name, parts, mass, friction, rolling)
                    .map_err(|error| format!("objects.equal: {error}"))?;
                if !(0.0..=1.0).contains(&equal.restitution) {
                    return Err("objects.equal.restitution must be in [0, 1]".to_owned());
                }
                let object = Arc::new(object.with_restitution(equal.restitution));
                vec![Kind { object, color: equal.color }]
            }
            (None, false) => {
                let mut kinds = Vec::new();
                for id in &self.from {
                    let item = Catalogue::builtin().find(id).map_err(|e| format!("objects.from: {e}"))?;
                    if kinds.iter().any(|kind: &Kind| kind.object.name == *id) {
                        return Err(format!("objects.from names `{id}` twice"));
                    }
                    kinds.push(Kind { object: Arc::clone(&item.object), color: item.color });
                }
                if kinds.len() < self.count {
                    let (have, count) = (kinds.len(), self.count);
                    return Err(format!("objects.from has {have} objects; count = {count} needs as many"));
                }
                kinds
            }
            _ => return Err("objects needs either `equal` or a list `from` of the catalogue".to_owned()),
        };
        Ok(())
    }

    /// Takes in what the file only names.
    pub(crate) fn digest(&self, hash: &mut ContentHash) {
        hash.list(&self.kinds, |h, kind| kind.object.digest(h));
    }
}

/// How the objects get to where they start.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Placing {
    /// Dropped in layers.
    Pour(Pour),
    /// Put down next to each other.
    Scatter(Scatter),
}

impl Placing {
    /// Name of the region.
    pub fn into_region(&self) -> &str {
        match self {
            Placing::Pour(pour) => &pour.into,
            Placing::Scatter(scatter) => &scatter.into,
        }
    }
}

/// Layers of a jittered grid, dropped into a region.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pour {
    /// Name of the region.
    pub into: String,
    /// Part of the region's width the grid spans.
    pub spread: f64,
    /// Most objects in a layer.
    pub layer: usize,
    /// Largest shift in x and y, m.
    pub jitter: f64,
    /// Height of the lowest layer above the region's floor, m.
    pub first_height: f64,
    /// Distance of layers, m.
    pub layer_height: f64,
}

/// Objects put down side by side as they stand, at random places and with random yaw.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scatter {
    /// Name of the region.
    pub into: String,
    /// Least distance between objects, and to the region's sides, m.
    pub gap: f64,
}
