//! Which file and element states a number of a hand, so that messages blame the right one.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

use crate::figures::{Figure, Part};
use crate::settings::Settings;

/// A file and an element of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file.
    pub file: PathBuf,
    /// The element: `link 'palm'`, `[tendons.close]`.
    pub element: String,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.file.display(), self.element)
    }
}

/// Where a hand's numbers come from: its URDF, except for what `hand.toml` states.
#[derive(Clone, Debug, Default)]
pub struct Sources {
    urdf: PathBuf,
    settings: PathBuf,
    /// Fields of `hand.toml` by the table they stand in: `[links.palm]`, `friction`.
    stated: BTreeMap<(String, &'static str), f64>,
}

impl Sources {
    /// Of a hand that has nothing but a URDF.
    pub fn of_urdf(urdf: &Path) -> Sources {
        Sources { urdf: urdf.to_owned(), ..Sources::default() }
    }

    /// Of a hand with settings.
    pub(crate) fn new(urdf: &Path, file: &Path, settings: &Settings) -> Sources {
        let mut stated = BTreeMap::new();
        let mut state = |table: String, field: &'static str, value: Option<f64>| {
            if let Some(value) = value {
                stated.insert((table, field), value);
            }
        };
        state("settings".to_owned(), "friction", settings.friction);
        let every = ("[every_coordinate]".to_owned(), &settings.every_coordinate);
        let each = settings.coordinates.iter().map(|(name, c)| (format!("[coordinates.{name}]"), c));
        for (table, c) in each.chain([every]) {
            state(table.clone(), "stiffness", c.stiffness);
            state(table.clone(), "damping", c.damping);
            state(table, "rest", c.rest);
        }
        for (name, l) in &settings.links {
            state(format!("[links.{name}]"), "mass", l.mass);
            state(format!("[links.{name}]"), "friction", l.friction);
        }
        for (name, t) in &settings.tendons {
            state(format!("[tendons.{name}]"), "stiffness", Some(t.stiffness));
        }
        for (name, m) in &settings.motors {
            state(format!("[motors.{name}]"), "scaling", Some(m.scaling));
        }
        Sources { urdf: urdf.to_owned(), settings: file.to_owned(), stated }
    }

    /// The URDF.
    pub fn urdf(&self) -> &Path {
        &self.urdf
    }

    /// Where a figure of the hand is stated.
    pub fn place(&self, figure: &Figure) -> Place {
        let field = figure.field;
        let in_settings = |table: &String| self.stated.contains_key(&(table.clone(), field));
        let tables = match &figure.part {
            Part::Hand => vec![],
            // Links that a fixed joint merges are one here, but stay apart in hand.toml.
            Part::Link(_) if field == "friction" => {
                let says = |((table, field), value): (&(String, &'static str), &f64)| {
                    (*field == "friction" && *value == figure.value).then(|| table.clone())
                };
                self.stated.iter().filter_map(says).collect()
            }
            Part::Link(name) => vec![format!("[links.{name}]")],
            Part::Joint(name) => {
                vec![format!("[coordinates.{name}]"), "[every_coordinate]".to_owned()]
            }
            Part::Tendon(name) => vec![format!("[tendons.{name}]")],
            Part::Motor(name) => vec![format!("[motors.{name}]")],
        };
        match tables.into_iter().find(in_settings) {
            Some(element) => Place { file: self.settings.clone(), element },
            None => Place { file: self.urdf.clone(), element: figure.part.to_string() },
        }
    }
}
