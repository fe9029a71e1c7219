//! Readers: one file a format, each from a description's text to a [`Draft`].
//!
//! A reader stops only at a file that is not well-formed. Every other fault is a decision in the log, so that one run
//! lists all of them.

mod graspit;
mod klampt;
mod urdf;
mod xacro;
pub(crate) mod xml;

use std::path::{Path, PathBuf};

use crate::Options;
use crate::decision::{At, Log};
use crate::draft::{Draft, Mesh, Triangles};
use crate::error::ImportError;
use crate::format::Format;
use crate::source::{Source, limits};

/// One description that is being read.
pub(crate) struct Reading<'a> {
    /// Its files.
    pub(crate) source: &'a Source,
    /// The description, by its path in the source.
    pub(crate) path: PathBuf,
    /// The decisions.
    pub(crate) log: Log,
    /// Files that name this one as a part, from the description down.
    pub(crate) mounted: usize,
}

/// Reads the description at `path`.
pub(crate) fn read(
    source: &Source,
    path: &Path,
    format: Format,
    options: &Options,
) -> Result<(Draft, Log), ImportError> {
    let shown = source.display(path);
    let mut reading = Reading { source, path: path.to_owned(), log: Log::new(&shown), mounted: 0 };
    let text = source.text(path, format.name())?;
    let draft = match format {
        Format::Urdf => urdf::read(&text, &mut reading)?,
        Format::Xacro => xacro::read(&mut reading, &options.xacro_arguments)?,
        Format::Klampt => klampt::read(&text, &mut reading)?,
        Format::Graspit => graspit::read(&text, &mut reading)?,
        Format::Mjcf | Format::Sdf => {
            return Err(ImportError::unreadable(
                shown,
                format!("is {}, which has no reader yet", format.name()),
            ));
        }
    };
    Ok((draft, reading.log))
}

impl<'a> Reading<'a> {
    /// A reading of another file of the same source, which this one names; it has a log of its own.
    pub(crate) fn of(&self, path: &Path) -> Reading<'a> {
        let log = Log::new(&self.source.display(path));
        Reading { source: self.source, path: path.to_owned(), log, mounted: self.mounted + 1 }
    }

    /// The mesh that the description calls `name`, or `None` with a problem in the log.
    pub(crate) fn mesh(&mut self, name: &str, scale: [f64; 3], at: At, element: &str) -> Option<Mesh> {
        match self.source.resolve(&self.path, name) {
            Ok(found) => {
                if let Some(note) = found.note {
                    self.log.guessed(at, element, format!("mesh {note}"));
                }
                Some(Mesh { triangles: Triangles::File(found.path), scale })
            }
            Err(problem) => {
                self.log.problem(at, element, format!("mesh {problem}; the shape is left out"));
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
