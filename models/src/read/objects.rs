//! Reads the files of the catalogue, `objects/*.toml`: each object's parts become shapes, and both are
//! checked.

use std::path::Path;
use std::sync::{Arc, OnceLock};

use serde::Deserialize;

use super::parts::{MAX_EXTENT_M, MAX_MASS_KG, MAX_PARTS, ObjectPart};
use super::report::Report;
use crate::catalogue::{Catalogue, Item};
use crate::error::ModelError;
use crate::object::Object;

/// Embedded, so that the program runs from anywhere.
const FILES: [(&str, &str); 2] = [
    ("objects/ycb.toml", include_str!("../../objects/ycb.toml")),
    ("objects/apc.toml", include_str!("../../objects/apc.toml")),
];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    source: String,
    object: Vec<Entry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    id: String,
    name: String,
    category: String,
    mass: f64,
    friction: f64,
    #[serde(default)]
    rolling_friction: f64,
    #[serde(default)]
    torsional_friction: f64,
    color: [f64; 3],
    parts: Vec<ObjectPart>,
    #[serde(default)]
    note: String,
}

impl Entry {
    fn item(self, at: &Report, source: &str) -> Result<Item, ModelError> {
        let bad = |element: &str, problem: String, valid: &str| {
            at.bad(format!("object '{}'{element}", self.id), problem, valid)
        };
        let mut parts = Vec::new();
        for (k, part) in self.parts.iter().enumerate() {
            let element = format!(", part {k}");
            let valid = "finite sizes in m, angles in rad, points that span a volume; a mesh only in a task's own object";
            parts.extend(part.solids().map_err(|problem| bad(&element, problem, valid))?);
        }
        if parts.len() > MAX_PARTS {
            let valid = format!("at most {MAX_PARTS}, a wall's slabs counted one by one");
            return Err(bad("", format!("has {} convex parts", parts.len()), &valid));
        }
        if self.mass > MAX_MASS_KG {
            return Err(bad("", format!("mass = {}", self.mass), "at most 20 kg"));
        }
        if !self.color.iter().all(|c| (0.0..=1.0).contains(c)) {
            return Err(bad("", format!("color = {:?}", self.color), "three numbers from 0 to 1"));
        }
        let object = Object::new(&self.id, parts, self.mass, self.friction, self.rolling_friction)?
            .with_torsional_friction(self.torsional_friction)?;
        let (low, high) = object.bounds();
        let size = (high - low).to_array();
        if size.iter().any(|x| *x > MAX_EXTENT_M) {
            return Err(bad("", format!("measures {size:?} m"), "at most 1 m along each axis"));
        }
        Ok(Item {
            object: Arc::new(object),
            title: self.name,
            category: self.category,
            source: source.to_owned(),
            note: self.note,
            color: self.color,
            size,
        })
    }
}

impl Catalogue {
    /// Reads one file's objects.
    ///
    /// # Errors
    /// The file, the object and the valid values.
    pub fn parse(file: &str, text: &str) -> Result<Catalogue, ModelError> {
        let at = Report::new(Path::new(file));
        let read: File = toml::from_str(text).map_err(|error| at.syntax("TOML", error))?;
        let mut catalogue = Catalogue::default();
        for entry in read.object {
            let item = entry.item(&at, &read.source)?;
            catalogue.add(file, item)?;
        }
        Ok(catalogue)
    }

    /// The built-in objects, loaded once.
    ///
    /// # Panics
    /// Never in a build whose tests pass: the files are part of the program, and a test loads them all.
    pub fn builtin() -> &'static Catalogue {
        static ALL: OnceLock<Catalogue> = OnceLock::new();
        ALL.get_or_init(|| {
            let mut all = Catalogue::default();
            for (file, text) in FILES {
                let added = Catalogue::parse(file, text).and_then(|part| {
                    part.items().iter().try_for_each(|item| all.add(file, (**item).clone()))
                });
                if let Err(error) = added {
                    panic!("embedded objects: {error}");
                }
            }
            all
        })
    }
}
