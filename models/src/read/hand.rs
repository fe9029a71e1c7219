//! Reads a hand from a URDF and a `hand.toml` next to it, for everything that a URDF cannot express.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use urdf_rs::JointType;

use super::actuation::actuation;
use super::coordinates::coordinates;
use super::files::{Files, has_extension, read_limited};
use super::hollow::MeshOf;
use super::options::LoadOptions;
use super::report::Report;
use super::sensors;
use super::settings::Settings;
use super::springs;
use super::tactile;
use super::urdf::link::LinkReader;
use super::urdf::reduce;
use super::urdf::tree::{self, Urdf};
use super::visual::{self, Visual};
use crate::error::{LoadWarning, ModelError};
use crate::hand::Hand;
use crate::measure::{Sources, oddities};

/// Pairs of links closer than this at rest never collide with each other, m.
const TOUCHING_AT_REST: f64 = 1e-3;

/// A hand and the warnings for its author.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The hand.
    pub hand: Hand,
    /// Its URDF, as in messages, and the numbers that its `hand.toml` overrides.
    pub sources: Sources,
    /// Warnings: about the files in order, then about the hand.
    pub warnings: Vec<LoadWarning>,
}

/// Reads a hand: a URDF file, a folder or a ZIP archive with one. The `hand.toml` next to the URDF is used if
/// it exists and the options name no other.
///
/// # Errors
/// The first problem, with file, element and valid values.
pub fn hand(path: &Path, options: &LoadOptions) -> Result<Loaded, ModelError> {
    if has_extension(path, "zip") && path.is_file() {
        return from_files(Files::open_archive(path, &options.limits)?, None, options);
    }
    if path.is_dir() {
        return from_files(Files::Folder(path.to_owned()), None, options);
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    from_files(Files::Folder(folder.to_owned()), path.file_name().map(Path::new), options)
}

/// Reads a hand from a folder or an archive. Without a URDF's name, `hand.urdf` or the only one is taken.
///
/// # Errors
/// As [`hand`].
pub fn from_files(
    mut files: Files,
    urdf: Option<&Path>,
    options: &LoadOptions,
) -> Result<Loaded, ModelError> {
    let limit = options.limits.text_bytes;
    let urdf = urdf.map_or_else(|| files.find_urdf(), |name| Ok(name.to_owned()))?;
    let urdf_file = files.display(&urdf);
    let text = read_text(files.read(&urdf, "URDF", limit)?, &urdf_file)?;
    let settings = settings_of(&files, options)?;
    let settings = settings.as_ref().map(|(text, file)| (file.as_path(), text.as_str()));
    from_text((&urdf_file, &text), settings, Some(&files), options)
}

/// Text and name of the settings beside a URDF, or of those that the options name.
fn settings_of(files: &Files, options: &LoadOptions) -> Result<Option<(String, PathBuf)>, ModelError> {
    let limit = options.limits.text_bytes;
    let beside = Path::new("hand.toml");
    let settings = match &options.settings {
        Some(file) => Some((file.clone(), read_limited(file, "settings", limit)?)),
        None if files.contains(beside) => {
            Some((files.display(beside), files.read(beside, "settings", limit)?))
        }
        None => None,
    };
    settings.map(|(file, bytes)| read_text(bytes, &file).map(|text| (text, file))).transpose()
}

/// Reads a hand from texts in memory, each with its name for messages. Without files, a mesh is an error.
///
/// # Errors
/// As [`hand`].
pub fn from_text(
    urdf: (&Path, &str),
    settings: Option<(&Path, &str)>,
    files: Option<&Files>,
    options: &LoadOptions,
) -> Result<Loaded, ModelError> {
    let mut report = Report::new(urdf.0);
    let tree = tree::parse(urdf.1, &options.limits, &mut report)?;
    let at = Report::new(settings.map_or(urdf.0, |(file, _)| file));
    let settings = match settings {
        Some((_, text)) => {
            let settings: Settings = toml::from_str(text).map_err(|e| at.syntax("TOML", e))?;
            settings.check(&options.limits, &at)?;
            check_names(&settings, &tree, &at)?;
            settings
        }
        None => Settings::default(),
    };
    let name = settings.name.clone().unwrap_or_else(|| tree.robot.name.clone());
    check_name(&name, if settings.name.is_some() { &at } else { &report })?;
    let mut reader = LinkReader::new(&settings, options, files, MeshOf::Hand);
    let reduced = reduce::reduce(&tree, &mut reader, &mut report)?;
    let coordinates = coordinates(&tree, &reduced, &settings, &mut report)?;
    let (motors, tendons) = actuation(&tree, &reduced, &settings, &mut report, &at)?;
    at.limit("tendons", "tendons", tendons.len(), options.limits.tendons)?;
    at.limit("springs", "springs", settings.springs.len(), options.limits.tendons)?;
    at.limit("linkages", "linkages", settings.linkages.len(), options.limits.tendons)?;
    let springs = springs::springs(&tree, &reduced, &settings, &at)?;
    let linkages = springs::linkages(&tree, &reduced, &settings, &at)?;
    let taxels = settings.tactile.iter().map(|group| group.taxels()).fold(0, usize::saturating_add);
    at.limit("tactile", "taxels", taxels, options.limits.taxels)?;
    at.limit("sensors", "cameras", settings.sensors.cameras.len(), options.limits.cameras)?;
    let tactile = tactile::patches(&settings.tactile, &tree, &reduced, &at)?;
    let sensors = sensors::mounted(&settings.sensors, &tree, &reduced, &at)?;
    let mut hand = Hand {
        name,
        description: settings.description.clone().unwrap_or_default(),
        links: reduced.links,
        coordinates,
        tendons,
        springs,
        linkages,
        motors,
        gravity_compensation: settings.gravity_compensation.unwrap_or(true),
        no_collision: Vec::new(),
        tactile,
        sensors,
        pads: reduced.pads,
    };
    hand.validate().map_err(|error| match error {
        // Numbers of hand.toml were checked when they were read.
        ModelError::Inconsistent { element, problem, .. } => {
            ModelError::Inconsistent { name: report.file.display().to_string(), element, problem }
        }
        error => error,
    })?;
    let mut rest: Vec<f64> = hand.coordinates.iter().map(|c| c.rest).collect();
    hand.close_chains(&mut rest);
    hand.no_collision = hand.pairs_closer_than(TOUCHING_AT_REST, &rest);
    let pinned =
        hand.linkages.iter().map(|pin| [pin.links[0].min(pin.links[1]), pin.links[0].max(pin.links[1])]);
    hand.no_collision.extend(pinned);
    hand.no_collision.sort_unstable();
    hand.no_collision.dedup();
    let mut warnings = report.warnings;
    warnings.extend(oddities(&hand, &report.file));
    let sources = Sources { urdf: report.file, settings: at.file, stated: settings.stated() };
    Ok(Loaded { hand, sources, warnings })
}

/// Appearance of the links of a hand by its URDF: the readable parts, on the links that [`from_files`] gives.
///
/// # Errors
/// The URDF cannot be read as a hand.
pub fn visuals(mut files: Files, options: &LoadOptions) -> Result<Vec<Visual>, ModelError> {
    let urdf = files.find_urdf()?;
    let urdf_file = files.display(&urdf);
    let text = read_text(files.read(&urdf, "URDF", options.limits.text_bytes)?, &urdf_file)?;
    let mut report = Report::new(&urdf_file);
    let tree = tree::parse(&text, &options.limits, &mut report)?;
    // Settings name joints that would otherwise be dropped; links must have the numbers of the hand.
    let settings =
        settings_of(&files, options)?.and_then(|(text, _)| toml::from_str(&text).ok()).unwrap_or_default();
    let mut reader = LinkReader::new(&settings, options, Some(&files), MeshOf::Hand);
    let reduced = reduce::reduce(&tree, &mut reader, &mut report)?;
    Ok(visual::visuals(&tree, &reduced.merged_into, &files, &options.limits))
}

/// A hand's name is part of URLs, pages and file names.
fn check_name(name: &str, at: &Report) -> Result<(), ModelError> {
    const MAX_LENGTH: usize = 64;
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
    if (1..=MAX_LENGTH).contains(&name.len()) && name.chars().all(plain) && !name.starts_with('.') {
        return Ok(());
    }
    let shown: String = name.chars().take(MAX_LENGTH).collect();
    Err(at.bad(
        "name of the hand",
        format!("is '{}'", shown.escape_debug()),
        "1 to 64 letters, digits, '_', '-' and '.', the first no '.'",
    ))
}

/// Checks that every name in the settings exists in the URDF.
fn check_names(settings: &Settings, tree: &Urdf, at: &Report) -> Result<(), ModelError> {
    fn check<'a, T>(
        table: &str,
        given: &BTreeMap<String, T>,
        known: impl Iterator<Item = &'a str>,
        at: &Report,
    ) -> Result<(), ModelError> {
        let known: Vec<&str> = known.collect();
        match given.keys().find(|name| !known.contains(&name.as_str())) {
            None => Ok(()),
            Some(name) => Err(at.bad(
                format!("[{table}.{name}]"),
                "names nothing in the URDF",
                format!("one of: {}", known.join(", ")),
            )),
        }
    }
    let robot = &tree.robot;
    let independent = robot.joints.iter().filter(|j| j.joint_type != JointType::Fixed && j.mimic.is_none());
    check("coordinates", &settings.coordinates, independent.map(|j| j.name.as_str()), at)?;
    check("links", &settings.links, robot.links.iter().map(|l| l.name.as_str()), at)?;
    let transmissions = tree.transmissions.iter().map(|t| t.name.as_str());
    // A tendon with moment arms of its own needs no transmission.
    let own = settings.tendons.iter().filter(|(_, tendon)| tendon.has_arms()).map(|(name, _)| name.as_str());
    check("tendons", &settings.tendons, transmissions.chain(own), at)?;
    let weighted = settings.tendons.values().flat_map(|tendon| tendon.motors.iter().flatten());
    let motors = tree.transmissions.iter().map(|t| t.actuator.as_str());
    check("motors", &settings.motors, motors.chain(weighted.map(|(name, _)| name.as_str())), at)
}

fn read_text(bytes: Vec<u8>, file: &Path) -> Result<String, ModelError> {
    String::from_utf8(bytes).map_err(|e| Report::new(file).syntax("UTF-8", e))
}
