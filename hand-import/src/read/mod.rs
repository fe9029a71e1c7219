//! Readers: one file a format, each from a description's text to a [`Draft`].
//!
//! A reader stops only at a file that is not well-formed. Every other fault is a decision in the log, so that one run
//! lists all of them.

pub(crate) mod content;
pub(crate) mod element;
mod foreign;
mod graspit;
pub(crate) mod klampt;
mod mjcf;
mod openrave;
pub(crate) mod reading;
mod sdf;
mod urdf;
mod xacro;

use std::path::Path;

use crate::decision::{At, Log};
use crate::draft::Draft;
use crate::error::ImportError;
use crate::glance::Glance;
use crate::options::ImportOptions;
use crate::source::Source;
use reading::Reading;

/// Makes [`Format`] from the table of formats.
macro_rules! formats {
    ($($Format:ident => $module:ident, $name:literal, $endings:expr;)*) => {
        /// Format of a description.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Format {
            $(#[doc = $name] $Format,)*
        }

        impl Format {
            /// All formats.
            pub(crate) const ALL: &[Format] = &[$(Format::$Format),*];

            /// Names of all formats, for messages.
            pub fn names() -> String {
                [$($name),*].join(", ")
            }

            /// Its name in messages.
            pub fn name(self) -> &'static str {
                match self { $(Format::$Format => $name,)* }
            }

            /// Endings of names of its files.
            fn endings(self) -> &'static [&'static str] {
                match self { $(Format::$Format => &$endings,)* }
            }

            /// Whether a file has this format.
            fn is(self, file: &Glance<'_>) -> bool {
                match self { $(Format::$Format => $module::is(file),)* }
            }

            fn read(self, reading: &mut Reading<'_>) -> Result<Draft, ImportError> {
                match self { $(Format::$Format => $module::read(reading),)* }
            }
        }
    };
}

// A new format is one line here, and one module with `is` and `read`. Of several that a file has, the last one counts.
formats! {
    Urdf => urdf, "URDF", ["urdf"];
    Xacro => xacro, "xacro", ["xacro"];
    Mjcf => mjcf, "MJCF", ["xml", "mjcf"];
    Sdf => sdf, "SDF", ["sdf"];
    Klampt => klampt, "Klamp't .rob", ["rob"];
    Graspit => graspit, "GraspIt! XML", ["xml"];
    OpenRave => openrave, "OpenRAVE XML", ["xml"];
}

/// Reads the description at `path`.
pub(crate) fn read(
    source: &Source,
    path: &Path,
    format: Format,
    options: &ImportOptions,
) -> Result<(Draft, Log), ImportError> {
    let mut reading = Reading::open(source, path, format.name(), options)?;
    if format != Format::Xacro && !options.xacro_arguments.is_empty() {
        reading.log.dropped(
            At::Hand,
            "--arg",
            format!("the file is {}, which has no arguments", format.name()),
        );
    }
    let draft = format.read(&mut reading)?;
    Ok((draft, reading.log))
}
