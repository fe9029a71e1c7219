//! File and element that state each number of a hand, so that messages name the right one.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

use super::figures::{Figure, HandPart};

/// The file and the element that state a number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceLocation {
    /// The file.
    pub file: PathBuf,
    /// The element: `link 'palm'`, `[tendons.close]`.
    pub element: String,
}

impl fmt::Display for SourceLocation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.file.display(), self.element)
    }
}

/// Sources of a hand's numbers: its URDF, except for those in `hand.toml`.
#[derive(Clone, Debug, Default)]
pub struct Sources {
    pub(crate) urdf: PathBuf,
    /// The `hand.toml`; used only for the numbers it states.
    pub(crate) settings: PathBuf,
    /// Numbers of `hand.toml` by table and field: `[links.palm]`, `friction`.
    pub(crate) stated: BTreeMap<(String, &'static str), f64>,
}

impl Sources {
    /// Sources of a hand with only a URDF.
    pub fn of_urdf(urdf: &Path) -> Sources {
        Sources { urdf: urdf.to_owned(), ..Sources::default() }
    }

    /// The URDF.
    pub fn urdf(&self) -> &Path {
        &self.urdf
    }

    /// Location of a figure of the hand.
    pub fn location(&self, figure: &Figure) -> SourceLocation {
        let field = figure.field;
        let in_settings = |table: &String| self.stated.contains_key(&(table.clone(), field));
        let tables = match &figure.part {
            HandPart::Hand => vec![],
            // Links that a fixed joint merges are one here, but separate in hand.toml.
            HandPart::Link(_) if field == "friction" => {
                let says = |((table, field), value): (&(String, &'static str), &f64)| {
                    let of_links = table == "friction" || table.starts_with("[links.");
                    (of_links && *field == "friction" && *value == figure.value).then(|| table.clone())
                };
                self.stated.iter().filter_map(says).collect()
            }
            HandPart::Link(name) => vec![format!("[links.{name}]")],
            HandPart::Joint(name) => {
                vec![format!("[coordinates.{name}]"), "[every_coordinate]".to_owned()]
            }
            HandPart::Tendon(name) => vec![format!("[tendons.{name}]")],
            HandPart::Motor(name) => vec![format!("[motors.{name}]")],
        };
        match tables.into_iter().find(in_settings) {
            Some(element) => SourceLocation { file: self.settings.clone(), element },
            None => SourceLocation { file: self.urdf.clone(), element: figure.part.to_string() },
        }
    }
}
