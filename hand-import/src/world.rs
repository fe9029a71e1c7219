//! Klamp't's worlds become tasks: rigid objects at their poses, terrains as fixed boxes and as the ground.
//!
//! 1. `scene.rs` reads the XML, as Klamp't's manual of file types and its `XmlWorld.cpp` say it. `object_file.rs` reads the files of objects
//!    and terrains that it names, `shape.rs` their geometry.
//! 2. `fixed.rs` makes ground and furniture of terrains, `place.rs` puts down objects that begin in the air.
//! 3. `write.rs` writes `task.toml`, meshes, and a URDF for each object whose inertia is stated.

mod fixed;
mod object_file;
mod place;
mod scene;
mod shape;
mod write;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::decision::{Decision, DecisionKind, Log};
use crate::error::ImportError;
use crate::imported::write_files;
use crate::read::element::parse;
use crate::source::Source;

/// A task that was made of a world, not yet on disk.
#[derive(Clone, Debug)]
pub struct ImportedWorld {
    /// Name of the task.
    pub name: String,
    /// The world's file, as in messages.
    pub description: PathBuf,
    /// Files by their path in the task's folder.
    pub files: BTreeMap<PathBuf, Vec<u8>>,
    /// Every decision; all are comments in `task.toml`.
    pub decisions: Vec<Decision>,
}

impl ImportedWorld {
    /// The problems among the decisions.
    pub fn problems(&self) -> impl Iterator<Item = &Decision> {
        self.decisions.iter().filter(|decision| decision.kind == DecisionKind::Problem)
    }

    /// Writes the files into a folder, which must not exist unless `force` is set.
    ///
    /// # Errors
    /// The folder exists, or a file cannot be written.
    pub fn write(&self, folder: &Path, force: bool) -> Result<(), ImportError> {
        write_files(&self.files, folder, force)
    }
}

/// Makes a task of a Klamp't world: its file, or a folder or archive with one world, of which `world` chooses one of several.
///
/// # Errors
/// There is no world, or none of its objects can be an object of a task.
pub fn import_world(path: &Path, world: Option<&str>, name: &str) -> Result<ImportedWorld, ImportError> {
    let source = Source::open(path)?;
    let file = the_world(&source, world)?;
    let shown = source.display(&file);
    let text = source.text(&file, "world")?;
    let root = parse(&file, &text).map_err(|problem| ImportError::unreadable(&shown, problem))?;
    let mut log = Log::new(&shown);
    let scene = scene::read(&root, &source, &file, &mut log);
    let fixed = fixed::fixed(&scene.terrains, &scene.objects, &mut log);
    let mut objects = scene.objects;
    place::put_down(&mut objects, &fixed, &mut log);
    if objects.is_empty() {
        let found: Vec<String> = log.of(DecisionKind::Problem).map(ToString::to_string).collect();
        let why = if found.is_empty() { "it has no <rigidObject>".to_owned() } else { found.join("\n  ") };
        return Err(ImportError::unreadable(shown, format!("a task needs an object to move: {why}")));
    }
    let files = write::files(name, &objects, &fixed, &mut log);
    Ok(ImportedWorld { name: name.to_owned(), description: shown, files, decisions: log.decisions })
}

/// The world's file.
fn the_world(source: &Source, chosen: Option<&str>) -> Result<PathBuf, ImportError> {
    let is_world = |path: &Path| {
        let text = source.text(path, "world").unwrap_or_default();
        parse(path, &text).is_ok_and(|root| root.name == "world")
    };
    if let Some(named) = source.named() {
        return if is_world(named) {
            Ok(named.to_owned())
        } else {
            let problem = "is no world of Klamp't: valid is XML whose root element is <world>";
            Err(ImportError::unreadable(source.display(named), problem))
        };
    }
    let xml = |path: &&PathBuf| path.extension().is_some_and(|kind| kind.eq_ignore_ascii_case("xml"));
    let mut found: Vec<&PathBuf> = source.paths().iter().filter(xml).filter(|path| is_world(path)).collect();
    if let Some(chosen) = chosen {
        found.retain(|path| path.ends_with(chosen) || path.file_stem().is_some_and(|stem| stem == chosen));
    }
    let names = || found.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ");
    match found.as_slice() {
        [one] => Ok((*one).clone()),
        [] => Err(ImportError::unreadable(
            source.root(),
            "has no such world of Klamp't (XML with the root <world>)",
        )),
        _ => Err(ImportError::unreadable(
            source.root(),
            format!("has several worlds; --world chooses one of: {}", names()),
        )),
    }
}
