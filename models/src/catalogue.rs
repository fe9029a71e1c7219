//! The catalogue of everyday objects, by name. Its files are read by `read/objects.rs`.

use std::path::Path;
use std::sync::Arc;

use crate::content::ContentHash;
use crate::error::ModelError;
use crate::object::Object;

/// An object of the catalogue. Its frame lies in the middle of its bounds, z up, as it stands or lies on a plane.
#[derive(Clone, Debug)]
pub struct Item {
    /// What it is and how it behaves; its name is the item's identifier.
    pub object: Arc<Object>,
    /// Name for people.
    pub title: String,
    /// `food`, `kitchen`, `tool`, ...
    pub category: String,
    /// Where the figures come from: `calli2015`, `apc2015`.
    pub source: String,
    /// What should be known about its figures; may be empty.
    pub note: String,
    /// sRGB, for viewers.
    pub color: [f64; 3],
    /// Extents along x, y and z, m.
    pub size: [f64; 3],
}

/// Items by identifier, in the files' order.
#[derive(Clone, Debug, Default)]
pub struct Catalogue {
    items: Vec<Arc<Item>>,
}

impl Item {
    /// Takes in everything that the item's behaviour depends on.
    pub fn digest(&self, hash: &mut ContentHash) {
        self.object.digest(hash);
    }
}

impl Catalogue {
    /// Adds an item; `file` is where it is described, for messages.
    ///
    /// # Errors
    /// There is an item of that identifier already.
    pub(crate) fn add(&mut self, file: &str, item: Item) -> Result<(), ModelError> {
        if self.get(&item.object.name).is_some() {
            return Err(ModelError::Element {
                file: Path::new(file).to_owned(),
                element: format!("object '{}'", item.object.name),
                problem: "stands here twice, or in another file as well".to_owned(),
                valid: "an id of its own".to_owned(),
            });
        }
        self.items.push(Arc::new(item));
        Ok(())
    }

    /// All items, in the files' order.
    pub fn items(&self) -> &[Arc<Item>] {
        &self.items
    }

    /// The item of that identifier.
    pub fn get(&self, id: &str) -> Option<&Arc<Item>> {
        self.items.iter().find(|item| item.object.name == id)
    }

    /// The item of that identifier, or what there is instead.
    ///
    /// # Errors
    /// Those identifiers that share the most letters with what was asked for.
    pub fn find(&self, id: &str) -> Result<&Arc<Item>, String> {
        self.get(id).ok_or_else(|| {
            let mut near: Vec<&str> = self.items.iter().map(|item| item.object.name.as_str()).collect();
            near.sort_by_key(|name| (std::cmp::Reverse(common(name, id)), *name));
            near.truncate(4);
            format!("no object `{id}` in the catalogue; near it: {}", near.join(", "))
        })
    }
}

/// How many two-letter pieces of `a` are in `b`.
fn common(a: &str, b: &str) -> usize {
    a.as_bytes().windows(2).filter(|piece| b.as_bytes().windows(2).any(|other| other == *piece)).count()
}
