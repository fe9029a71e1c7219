//! SDF, the format of Gazebo: models of links and joints, each with a pose relative to a named frame.

mod collect;
mod coupling;
mod draft;
mod plugin;
mod scope;
mod shape;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::path::Path;

use self::collect::{Around, Reader, yes};
use self::scope::Scope;
use crate::decision::At;
use crate::draft::Draft;
use crate::error::ImportError;
use crate::glance::Glance;
use crate::read::element::{Element, Notes, parse};
use crate::read::reading::Reading;

/// Whether a file is SDF; old ones have the root `<gazebo>`.
pub(super) fn is(file: &Glance<'_>) -> bool {
    matches!(file.root, "sdf" | "gazebo")
}

/// Reads the document of a reading.
pub(super) fn read(reading: &mut Reading<'_>) -> Result<Draft, ImportError> {
    let (source, path, log) = (reading.source, reading.path.as_path(), &mut reading.log);
    let shown = source.display(path);
    let root = parse(&shown, &reading.text).map_err(|problem| ImportError::unreadable(&shown, problem))?;
    let worlds = root.all("world").flat_map(|world| &world.children);
    let all: Vec<&Element> = root.children.iter().chain(worlds).collect();
    let models: Vec<&Element> = all.iter().copied().filter(|element| element.name == "model").collect();
    let mut reader = Reader {
        source,
        log,
        scope: Scope::default(),
        links: BTreeSet::new(),
        parts: Vec::new(),
        included: 0,
        missing: None,
    };
    // A world can consist of models in other files.
    let mut included = Vec::new();
    if models.is_empty() {
        for include in all.iter().filter(|element| element.name == "include") {
            let named = include.child_text("name").map(str::to_owned);
            included.extend(reader.included(include, path).map(|(root, path)| (root, path, named)));
        }
    }
    let own = models.iter().map(|model| (&root, *model, path, None));
    let others = included
        .iter()
        .filter_map(|(root, path, name)| Some((root, root.child("model")?, path.as_path(), name.as_deref())));
    let found: Vec<_> = own.chain(others).collect();
    let joints = |model: &&(&Element, &Element, &Path, Option<&str>)| {
        model.1.all("joint").count() + model.1.all("model").count() + model.1.all("include").count()
    };
    let Some(&(root, model, path, name)) = found.iter().rev().max_by_key(joints) else {
        return Err(ImportError::unreadable(shown, "has no <model>, and no <include> of one that is there"));
    };
    for (_, other, ..) in found.iter().filter(|other| !std::ptr::eq(other.1, model)) {
        reader.log.lost(At::Hand, other, "is another model; it is left out");
    }
    reader.model(model, &Around::outermost(path, root));
    // Half a hand helps nobody.
    if let Some(missing) = reader.missing.take()
        && reader.has_loose_joint()
    {
        return Err(ImportError::unreadable(shown, missing));
    }
    let touch = model
        .child_text("self_collide")
        .or_else(|| model.all("link").find_map(|link| link.child_text("self_collide")));
    if !yes(touch) {
        let text =
            "has no <self_collide>, so that its links pass through each other in Gazebo; here they touch";
        reader.log.chose(At::Hand, model, text);
    }
    let mut draft = reader.draft();
    draft.name = name.or(model.get("name")).unwrap_or("hand").to_owned();
    Ok(draft)
}
