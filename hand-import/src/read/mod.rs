//! Readers: one file a format, each from a description's text to a [`Draft`].
//!
//! A reader stops only at a file that is not well-formed. Every other fault is a decision in the log, so that one run
//! lists all of them.

pub(crate) mod element;
mod graspit;
mod klampt;
mod mjcf;
pub(crate) mod reading;
mod sdf;
mod urdf;
mod xacro;

use std::path::Path;

use crate::decision::{At, Log};
use crate::draft::Draft;
use crate::error::ImportError;
use crate::format::Format;
use crate::options::ImportOptions;
use crate::source::Source;
use reading::Reading;

/// Reads the description at `path`.
pub(crate) fn read(
    source: &Source,
    path: &Path,
    format: Format,
    options: &ImportOptions,
) -> Result<(Draft, Log), ImportError> {
    let shown = source.display(path);
    let mut reading = Reading { source, path: path.to_owned(), log: Log::new(&shown), mounted: 0 };
    let text = source.text(path, format.name())?;
    if format != Format::Xacro && !options.xacro_arguments.is_empty() {
        reading.log.dropped(
            At::Hand,
            "--arg",
            format!("the file is {}, which has no arguments", format.name()),
        );
    }
    let draft = match format {
        Format::Urdf => urdf::read(&text, &mut reading)?,
        Format::Xacro => xacro::read(&mut reading, &options.xacro_arguments)?,
        Format::Klampt => klampt::read(&text, &mut reading)?,
        Format::Graspit => graspit::read(&text, &mut reading)?,
        Format::Mjcf => mjcf::read(&mut reading)?,
        Format::Sdf => sdf::read(&mut reading)?,
    };
    Ok((draft, reading.log))
}
