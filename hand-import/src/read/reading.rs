//! A description that is being read.

use std::path::{Path, PathBuf};
use std::rc::Rc;

use palmares_models::error::ModelError;

use crate::decision::{At, Log};
use crate::draft::{Mesh, Triangles};
use crate::error::ImportError;
use crate::options::ImportOptions;
use crate::source::{Source, limits};

/// One description that is being read.
pub(crate) struct Reading<'a> {
    /// Its files.
    pub(crate) source: &'a Source,
    /// The description, by its path in the source.
    pub(crate) path: PathBuf,
    /// Its text.
    pub(crate) text: Rc<str>,
    /// The choices of the import.
    pub(crate) options: &'a ImportOptions,
    /// The decisions.
    pub(crate) log: Log,
    /// Files that name this one as a part, from the description down.
    pub(crate) mounted: usize,
}

/// The `hand.toml` beside the description.
pub(crate) fn settings(reading: &mut Reading<'_>) -> Result<Option<String>, ImportError> {
    let path = reading.path.with_file_name("hand.toml");
    if reading.source.paths().binary_search(&path).is_err() {
        return Ok(None);
    }
    let text = reading.source.text(&path, "settings")?;
    reading.log.taken(At::Hand, "hand.toml", "is kept as it is");
    Ok(Some(text))
}

impl<'a> Reading<'a> {
    /// Opens a file of a source; `element` names it.
    pub(crate) fn open(
        source: &'a Source,
        path: &Path,
        element: &str,
        options: &'a ImportOptions,
    ) -> Result<Reading<'a>, ModelError> {
        let text = source.text(path, element)?.into();
        let log = Log::new(&source.display(path));
        Ok(Reading { source, path: path.to_owned(), text, options, log, mounted: 0 })
    }

    /// A reading of another file of the same source, which this one names; it has a log of its own.
    pub(crate) fn of(&self, path: &Path, element: &str) -> Result<Reading<'a>, ModelError> {
        let other = Reading::open(self.source, path, element, self.options)?;
        Ok(Reading { mounted: self.mounted + 1, ..other })
    }

    /// The mesh that the description calls `name`, or `None` with a decision in the log: a problem, unless it is only a
    /// picture of a link that has other shapes.
    pub(crate) fn mesh(
        &mut self,
        name: &str,
        scale: [f64; 3],
        at: At,
        element: &str,
        picture: bool,
    ) -> Option<Mesh> {
        match self.source.resolve(&self.path, name) {
            Ok(found) => {
                if let Some(note) = found.note {
                    self.log.guessed(at, element, format!("mesh {note}"));
                }
                Some(Mesh { triangles: Triangles::File(found.path), scale })
            }
            Err(problem) => {
                let text = format!("mesh {problem}; the shape is left out");
                if picture {
                    self.log.dropped(at, element, format!("picture: {text}"));
                } else {
                    self.log.problem(at, element, text);
                }
                None
            }
        }
    }

    /// Well-formed XML of this text, which is the description's.
    pub(crate) fn xml<'t>(&self, text: &'t str) -> Result<roxmltree::Document<'t>, ImportError> {
        let limits = palmares_models::read::Limits { xml_nodes: 1_000_000, ..limits() };
        Ok(palmares_models::read::xml(&self.log.file, text, &limits)?)
    }
}
