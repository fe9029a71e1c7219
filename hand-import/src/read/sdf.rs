//! SDF, the format of Gazebo: models of links and joints, each with a pose relative to a named frame.

mod collect;
mod draft;
mod scope;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use palmares_models::Pose;

use self::collect::Reader;
use self::scope::Scope;
use crate::decision::At;
use crate::draft::Draft;
use crate::error::ImportError;
use crate::read::element::{Element, Notes, parse};
use crate::read::reading::Reading;

/// Reads the document of a reading.
pub(super) fn read(reading: &mut Reading<'_>) -> Result<Draft, ImportError> {
    let (source, path, log) = (reading.source, reading.path.as_path(), &mut reading.log);
    let shown = source.display(path);
    let text = source.text(path, "source")?;
    let root = parse(&shown, &text).map_err(|problem| ImportError::unreadable(&shown, problem))?;
    let worlds = root.all("world").flat_map(|world| &world.children);
    let all: Vec<&Element> =
        root.children.iter().chain(worlds).filter(|element| element.name == "model").collect();
    let joints = |model: &&&Element| model.all("joint").count() + model.all("model").count();
    let Some(&model) = all.iter().rev().max_by_key(joints) else {
        return Err(ImportError::unreadable(shown, "has no <model>"));
    };
    for other in all.iter().filter(|other| !std::ptr::eq(**other, model)) {
        log.lost(At::Hand, other, "is another model; it is left out");
    }
    let mut reader =
        Reader { source, log, scope: Scope::default(), links: BTreeSet::new(), parts: Vec::new() };
    reader.model(model, path, "", Pose::IDENTITY, 0);
    let mut draft = reader.draft();
    draft.name = model.get("name").unwrap_or("hand").to_owned();
    Ok(draft)
}
