//! Imports published descriptions of hands: a folder, archive or file in another program's format becomes `hand.urdf`,
//! `hand.toml` and meshes.
//!
//! 1. [`source`] opens the files, `hand-import/src/read/content.rs` recognises the description by its content.
//! 2. `hand-import/src/read/` has a reader for each format. It fills a [`draft::Draft`], what the source states, and [`decision`]
//!    collects what was taken, guessed and dropped, and what is wrong.
//! 3. `hand-import/src/complete/` fills the gaps of a draft, `hand-import/src/meshes/` converts meshes.
//! 4. `hand-import/src/write/` writes the files; each decision is a comment in one of them.
//!
//! `hand-import/src/export/` writes a hand of Palmares in other formats. `hand-import/src/world/` makes a task of a Klamp't world.

mod arm;
mod complete;
pub mod decision;
pub mod draft;
pub mod error;
pub mod export;
pub mod glance;
mod imported;
mod meshes;
mod numbers;
mod options;
mod read;
pub mod source;
mod subtree;
mod world;
mod write;
mod xml;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use palmares_models::measure::HandLimits;
use palmares_models::read::{Files, LoadOptions, Loaded, from_files};

use crate::decision::{At, DecisionKind, Log};
use crate::error::ImportError;
use crate::source::Source;

pub use crate::imported::Imported;
pub use crate::options::ImportOptions;
pub use crate::read::Format;
pub use crate::world::{ImportedWorld, import_world};

/// Links and joints of a robot; more than those of a hand, as some are left out.
const MAX_LINKS: usize = 1024;

/// Triangles of a mesh file of any format that imports read; in metres where the format has a unit, else in its own.
///
/// # Errors
/// It cannot be read, or is of another format.
pub fn mesh_triangles(path: &Path) -> Result<Vec<[palmares_models::Vec3; 3]>, ImportError> {
    let unreadable = |problem: String| ImportError::unreadable(path, problem);
    let source = Source::open(path)?;
    let bytes = std::fs::read(path).map_err(|error| unreadable(error.to_string()))?;
    Ok(meshes::triangles(&bytes, path, &source).map_err(unreadable)?.corners)
}

/// Imports the hand in a folder, an archive or a file.
///
/// # Errors
/// The source gives no hand at all. Smaller faults are decisions of kind [`DecisionKind::Problem`].
pub fn import(path: &Path, options: &ImportOptions) -> Result<Imported, ImportError> {
    import_source(&Source::open(path)?, options)
}

/// Imports the hand of a source that is open.
///
/// # Errors
/// As [`import`].
pub fn import_source(source: &Source, options: &ImportOptions) -> Result<Imported, ImportError> {
    let (file, format) = read::content::description(source, options.robot.as_deref())?;
    let (mut draft, mut log) = read::read(source, &file, format, options)?;
    if let Some(name) = &options.name {
        draft.name.clone_from(name);
    }
    if options.template {
        draft.settings = None;
    }
    if draft.links.is_empty() {
        return Err(ImportError::unreadable(source.display(&file), "has no links"));
    }
    if let Some(root) = &options.root {
        subtree::keep(&mut draft, root, &source.display(&file), &mut log)?;
    }
    let (links, joints) = (draft.links.len(), draft.joints.len());
    if links.max(joints) > MAX_LINKS {
        let limit = palmares_models::read::Limits::default().links;
        let problem = format!(
            "has {links} links and {joints} joints; a hand has at most {limit} of each; --root LINK takes a part"
        );
        return Err(ImportError::unreadable(source.display(&file), problem));
    }
    if options.root.is_none()
        && let Some(text) = arm::hint(&draft)
    {
        log.first(DecisionKind::Guessed, At::Hand, "robot", text);
    }
    let mut hand = complete::complete(draft, source, options, &mut log);
    // The loader and the limits judge the written files. Their findings go into the comments as well.
    let mut loaded = load(&write(&hand, &log, format, options));
    let stand_ins =
        loaded.as_ref().map(|loaded| hand.stand_in_inertias(&loaded.warnings)).unwrap_or_default();
    if !stand_ins.is_empty() {
        let names: Vec<&str> = stand_ins.iter().map(String::as_str).collect();
        let text = format!(
            "the inertia of {} is not that of their shapes at this mass: a stand-in; theirs come from their shapes",
            complete::shown(&names)
        );
        log.guessed(At::Hand, "robot", text);
        hand.inertia_from_shapes.extend(stand_ins);
        loaded = load(&write(&hand, &log, format, options));
    }
    let mut warnings = Vec::new();
    match loaded {
        Ok(loaded) => {
            let excesses = HandLimits::default().excesses(&loaded.hand.figures(), &loaded.sources);
            for excess in excesses {
                log.problem(At::Hand, "hand", format!("is beyond what a hand may have: {excess}"));
            }
            warnings = loaded.warnings;
        }
        Err(error) => log.problem(At::Hand, "hand", format!("does not load yet: {error}")),
    }
    let files = write(&hand, &log, format, options);
    let tendon_lines = write::tendon_lines::lines(&hand, &fingers(&hand, format, options));
    let name = hand.draft.name.clone();
    let description = source.display(&file);
    Ok(Imported { name, format, description, files, decisions: log.decisions, warnings, tendon_lines })
}

/// Fingers over which lines for tendons are written: Klamp't's format has no tendons.
fn fingers<'a>(
    hand: &'a complete::Complete,
    format: Format,
    options: &ImportOptions,
) -> Vec<complete::Finger<'a>> {
    if format != Format::Klampt || options.template {
        return Vec::new();
    }
    complete::fingers(&hand.draft, &hand.servos, &hand.tendons)
}

fn write(
    hand: &complete::Complete,
    log: &Log,
    format: Format,
    options: &ImportOptions,
) -> BTreeMap<PathBuf, Vec<u8>> {
    let file = log.file.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let head = format!("Imported from {file} ({}) by palmares {}.", format.name(), env!("CARGO_PKG_VERSION"));
    let (mut in_urdf, mut in_settings) = write::Comments::split(log, hand);
    let urdf = write::urdf::urdf(hand, &head, &mut in_urdf);
    let fingers = fingers(hand, format, options);
    let mut settings = write::settings::settings(hand, &fingers, &head, &mut in_settings);
    if let Some(lines) = write::tendon_lines::lines(hand, &fingers) {
        settings += &write::tendon_lines::commented(&lines);
    }
    if options.template {
        settings += &write::settings::template(hand);
    }
    let mut files = hand.meshes.files.clone();
    files.insert(PathBuf::from("hand.urdf"), urdf.into_bytes());
    files.insert(PathBuf::from("hand.toml"), settings.into_bytes());
    files
}

fn load(files: &BTreeMap<PathBuf, Vec<u8>>) -> Result<Loaded, palmares_models::error::ModelError> {
    let files = Files::Archive { file: PathBuf::new(), folder: PathBuf::new(), entries: files.clone() };
    from_files(files, None, &LoadOptions::default())
}
