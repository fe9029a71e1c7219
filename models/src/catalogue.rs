//! The catalogue of everyday objects, by name. Its files are read by `read/objects.rs`.

use std::path::Path;
use std::sync::Arc;

use crate::content::ContentHash;
use crate::error::ModelError;
use crate::object::Object;

/// An object of the catalogue. Its frame is in the middle of its bounds, z up, in the pose in which it rests
/// on a plane.
#[derive(Clone, Debug)]
pub struct Item {
    /// The object's shape and properties; its name is the item's identifier.
    pub object: Arc<Object>,
    /// Display name.
    pub title: String,
    /// `food`, `kitchen`, `tool`, ...
    pub category: String,
    /// Source of the figures: `calli2015`, `apc2015`.
    pub source: String,
    /// Remark about its figures; may be empty.
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
    /// Hashes everything that the item's behaviour depends on.
    pub fn digest(&self, hash: &mut ContentHash) {
        self.object.digest(hash);
    }
}

impl Catalogue {
    /// Adds an item; `file` is its source, for messages.
    ///
    /// # Errors
    /// An item of that identifier already exists.
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

    /// The item with that identifier.
    pub fn get(&self, id: &str) -> Option<&Arc<Item>> {
        self.items.iter().find(|item| item.object.name == id)
    }

    /// The item with that identifier, or an error with similar identifiers.
    ///
    /// # Errors
    /// The identifiers that share the most letters with the requested one.
    pub fn find(&self, id: &str) -> Result<&Arc<Item>, String> {
        self.get(id).ok_or_else(|| {
            let mut near: Vec<&str> = self.items.iter().map(|item| item.object.name.as_str()).collect();
            near.sort_by_key(|name| (std::cmp::Reverse(common(name, id)), *name));
            near.truncate(4);
            format!("no object `{id}` in the catalogue; near it: {}", near.join(", "))
        })
    }
}

/// Number of two-letter pieces of `a` that are in `b`.
fn common(a: &str, b: &str) -> usize {
    a.as_bytes().windows(2).filter(|piece| b.as_bytes().windows(2).any(|other| other == *piece)).count()
}
