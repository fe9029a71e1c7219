//! Reads a hand from a URDF and a `hand.toml` next to it, for everything that a URDF cannot express.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use urdf_rs::JointType;

use super::actuation::{actuation, unknown_joint, unknown_motor};
use super::coordinates::coordinates;
use super::files::{Files, has_extension, read_limited};
use super::foreign::check_urdf;
use super::hollow::MeshOf;
use super::no_collision;
use super::options::LoadOptions;
use super::report::Report;
use super::sensors;
use super::servo;
use super::servo_settings::ServoJoints;
use super::settings::Settings;
use super::springs::{self, unknown_link};
use super::start;
use super::tactile;
use super::uncertain;
use super::urdf::link::LinkReader;
use super::urdf::reduce;
use super::urdf::tree::{self, Urdf};
use super::visual::{self, Visual};
use crate::Pose;
use crate::error::{LoadWarning, ModelError, Refused};
use crate::hand::Hand;
use crate::measure::{Sources, oddities};

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
/// The problems, each with file, element and valid values.
pub fn hand(path: &Path, options: &LoadOptions) -> Result<Loaded, ModelError> {
    examine(path, options).map_err(Refused::into_error)
}

/// As [`hand`]; a hand that is refused has its warnings, too.
///
/// # Errors
/// As [`hand`].
pub fn examine(path: &Path, options: &LoadOptions) -> Result<Loaded, Refused> {
    if has_extension(path, "zip") && path.is_file() {
        return examine_files(Files::open_archive(path, &options.limits)?, None, options);
    }
    if path.is_dir() {
        return examine_files(Files::Folder(path.to_owned()), None, options);
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    examine_files(Files::Folder(folder.to_owned()), path.file_name().map(Path::new), options)
}

/// Reads a hand from a folder or an archive. Without a URDF's name, `hand.urdf` or the only one is taken.
///
/// # Errors
/// As [`hand`].
pub fn from_files(files: Files, urdf: Option<&Path>, options: &LoadOptions) -> Result<Loaded, ModelError> {
    examine_files(files, urdf, options).map_err(Refused::into_error)
}

fn examine_files(mut files: Files, urdf: Option<&Path>, options: &LoadOptions) -> Result<Loaded, Refused> {
    let limit = options.limits.text_bytes;
    let urdf = urdf.map_or_else(|| files.find_urdf(), |name| Ok(name.to_owned()))?;
    let urdf_file = files.display(&urdf);
    let text = read_text(files.read(&urdf, "URDF", limit)?, &urdf_file)?;
    check_urdf(&urdf, &text, &Report::new(&urdf_file))?;
    let settings = settings_of(&files, options)?;
    let settings = settings.as_ref().map(|(text, file)| (file.as_path(), text.as_str()));
    examine_text((&urdf_file, &text), settings, Some(&files), options)
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
    examine_text(urdf, settings, files, options).map_err(Refused::into_error)
}

/// As [`from_text`], with every problem that can be found, and the warnings beside them.
fn examine_text(
    urdf: (&Path, &str),
    settings: Option<(&Path, &str)>,
    files: Option<&Files>,
    options: &LoadOptions,
) -> Result<Loaded, Refused> {
    let mut report = Report::new(urdf.0);
    let mut at = Report::new(settings.map_or(urdf.0, |(file, _)| file));
    let built = build(urdf.1, settings.map(|(_, text)| text), files, options, (&mut report, &mut at));
    let mut errors = report.take_errors();
    errors.extend(at.take_errors());
    match built {
        Ok(Some(built)) if errors.is_empty() => Ok(built),
        built => {
            errors.extend(built.err());
            Err(Refused { errors, warnings: report.warnings })
        }
    }
}

/// Reads a hand. Where reading can go on, the reports keep the errors; the result is then `None`, or must not
/// be used.
fn build(
    urdf: &str,
    settings: Option<&str>,
    files: Option<&Files>,
    options: &LoadOptions,
    (report, at): (&mut Report, &mut Report),
) -> Result<Option<Loaded>, ModelError> {
    let tree = tree::parse(urdf, &options.limits, report);
    let parsed = settings.map(|text| toml::from_str(text).map_err(|e| at.syntax("TOML", e)));
    let mut settings: Settings = match parsed {
        Some(parsed) => match at.keep(parsed) {
            Some(settings) => settings,
            // The URDF's error, if there is one, comes first.
            None => return tree.map(|_| None),
        },
        None => Settings::default(),
    };
    let sound = settings.check(&options.limits, at);
    let described = settings.description.as_deref().map_or(0, str::len);
    at.keep(at.limit("description", "bytes", described, options.limits.description_bytes));
    let Some(tree) = tree? else { return Ok(None) };
    check_names(&settings, &tree, at);
    let name = settings.name.clone().unwrap_or_else(|| tree.robot.name.clone());
    let named_in = if settings.name.is_some() { &*at } else { &*report };
    named_in.keep(check_name(&name, named_in));
    let mut reader = LinkReader::new(&settings, options, files, MeshOf::Hand);
    let root_from_base = at.keep(start::root_from_base(&settings.base, &tree, at)).unwrap_or(Pose::IDENTITY);
    let base_from_root = base_from_root(root_from_base);
    // Nothing is computed from invalid numbers.
    let reduced = match tree.sound {
        true => reduce::reduce(&tree, base_from_root, &mut reader, report)?,
        false => None,
    };
    let coordinates = reduced.as_ref().map(|reduced| coordinates(&tree, reduced, &settings, report));
    let (Some(reduced), Some(coordinates), true) = (reduced, coordinates, sound) else {
        check_further_names(&settings, &tree, at);
        return Ok(None);
    };
    let (mut motors, mut tendons) = actuation(&tree, &reduced, &settings, report, at);
    at.limit("tendons", "tendons", tendons.len(), options.limits.tendons)?;
    at.limit("springs", "springs", settings.springs.len(), options.limits.tendons)?;
    at.limit("linkages", "linkages", settings.linkages.len(), options.limits.tendons)?;
    let springs = springs::springs(&tree, &reduced, &settings, at);
    let linkages = springs::linkages(&tree, &reduced, &settings, at);
    let no_collision = no_collision::pairs(&tree, &reduced, &settings, at);
    let taxels = settings.tactile.iter().map(|group| group.taxels()).fold(0, usize::saturating_add);
    at.limit("tactile", "taxels", taxels, options.limits.taxels)?;
    at.limit("sensors", "cameras", settings.sensors.cameras.len(), options.limits.cameras)?;
    let tactile = tactile::patches(&settings.tactile, &tree, &reduced, at);
    let sensors = sensors::mounted(&settings.sensors, &tree, &reduced, at);
    servo::add((&tree, &reduced, &settings), &coordinates, &mut motors, &mut tendons, (report, at));
    let start = start::start(&settings, &coordinates, &motors, &tendons, at);
    if report.kept() + at.kept() > 0 {
        return Ok(None);
    }
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
        start,
        uncertain: Vec::new(),
        base_from_root,
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
    hand.no_collision = hand.touching_at_rest();
    let pinned =
        hand.linkages.iter().map(|pin| [pin.links[0].min(pin.links[1]), pin.links[0].max(pin.links[1])]);
    hand.no_collision.extend(pinned);
    hand.no_collision.extend(no_collision);
    hand.no_collision.sort_unstable();
    hand.no_collision.dedup();
    hand.uncertain = uncertain::uncertain(&settings.uncertain, &hand, options.limits.number, at);
    if at.kept() > 0 {
        return Ok(None);
    }
    let mut warnings = std::mem::take(&mut report.warnings);
    warnings.extend(oddities(&hand, &report.file));
    warnings.extend(springs::open_pins(&hand, &rest, at));
    let sources = Sources { urdf: report.file.clone(), settings: at.file.clone(), stated: settings.stated() };
    Ok(Some(Loaded { hand, sources, warnings }))
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
    let tree = tree.filter(|_| report.kept() == 0).ok_or_else(|| report.refusal())?;
    // A joint that the settings name is not dropped. So the links get the same numbers as in the hand.
    let settings: Settings =
        settings_of(&files, options)?.and_then(|(text, _)| toml::from_str(&text).ok()).unwrap_or_default();
    let root_from_base = start::root_from_base(&settings.base, &tree, &report).unwrap_or(Pose::IDENTITY);
    let mut reader = LinkReader::new(&settings, options, Some(&files), MeshOf::Hand);
    let reduced = reduce::reduce(&tree, base_from_root(root_from_base), &mut reader, &mut report)?;
    let reduced = reduced.filter(|_| report.kept() == 0).ok_or_else(|| report.refusal())?;
    Ok(visual::visuals(&tree, &reduced.merged_into, &files, &options.limits))
}

/// The inverse of a pose; the identity keeps its bits.
fn base_from_root(root_from_base: Pose) -> Pose {
    if root_from_base == Pose::IDENTITY { root_from_base } else { root_from_base.inverse() }
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

/// Keeps an error for each table of the settings with a name that does not exist in the URDF.
fn check_names(settings: &Settings, tree: &Urdf, at: &Report) {
    fn check<'a, T>(
        table: &str,
        given: &BTreeMap<String, T>,
        known: impl Iterator<Item = &'a str>,
        at: &Report,
    ) {
        let known: Vec<&str> = known.collect();
        for name in given.keys().filter(|name| !known.contains(&name.as_str())) {
            at.keep::<()>(Err(at.bad(
                format!("[{table}.{name}]"),
                "names nothing in the URDF",
                format!("one of: {}", known.join(", ")),
            )));
        }
    }
    let robot = &tree.robot;
    let free = || {
        let free = robot.joints.iter().filter(|j| j.joint_type != JointType::Fixed && j.mimic.is_none());
        free.map(|j| j.name.as_str())
    };
    check("coordinates", &settings.coordinates, free(), at);
    check("servos", &settings.servos, free(), at);
    let listed = settings.servo_joints.as_ref().map_or(&[][..], ServoJoints::names);
    check("servo_joints", &listed.iter().map(|name| (name.clone(), ())).collect(), free(), at);
    check("links", &settings.links, robot.links.iter().map(|l| l.name.as_str()), at);
    let transmissions = tree.transmissions.iter().map(|t| t.name.as_str());
    let transmissions: Vec<&str> = transmissions.collect();
    for (name, tendon) in &settings.tendons {
        if !tendon.has_arms() && !transmissions.contains(&name.as_str()) {
            let mut valid = "`joints`, `polynomial`, `table`, `eyelets` or `da_vinci` of its own".to_owned();
            if !transmissions.is_empty() {
                valid += &format!(", or the name of a transmission: {}", transmissions.join(", "));
            }
            let problem = "has no <transmission> in the URDF, and pulls on no joint";
            at.keep::<()>(Err(at.bad(format!("[tendons.{name}]"), problem, valid)));
        }
    }
    let weighted = settings.tendons.values().flat_map(|tendon| tendon.motors.iter().flatten());
    let motors = tree.transmissions.iter().map(|t| t.actuator.as_str());
    let motors = motors.chain(weighted.map(|(name, _)| name.as_str()));
    // The motor of a servo has the name of its actuator, or of its joint.
    let servos = tree.servos.iter().map(|servo| servo.actuator.as_str());
    let all = matches!(settings.servo_joints, Some(ServoJoints::Word(_)));
    let stated = |name: &&str| all || listed.iter().any(|l| l == name) || settings.servos.contains_key(*name);
    check("motors", &settings.motors, motors.chain(servos).chain(free().filter(stated)), at);
}

/// Keeps an error for each unknown name in the settings that building the hand would report. It is for files of which no hand can be
/// built.
fn check_further_names(settings: &Settings, tree: &Urdf, at: &Report) {
    let free =
        |name: &str| tree.robot.joints.iter().any(|j| j.name == *name && j.joint_type != JointType::Fixed);
    let tendons = settings.tendons.iter().flat_map(|(tendon, own)| {
        let paths =
            own.paths().map(move |(kind, joint)| (format!("[tendons.{tendon}.{kind}.{joint}]"), joint));
        own.joints.keys().map(move |joint| (format!("[tendons.{tendon}]"), joint)).chain(paths)
    });
    let springs = settings
        .springs
        .iter()
        .flat_map(|(spring, own)| own.joints.keys().map(move |joint| (format!("[springs.{spring}]"), joint)));
    let start = settings.start.joints.keys().map(|joint| ("[start]".to_owned(), joint));
    for (element, joint) in tendons.chain(springs).chain(start).filter(|(_, joint)| !free(joint)) {
        at.keep::<()>(Err(unknown_joint(joint, &element, at)));
    }
    for (tendon, own) in &settings.tendons {
        for name in own.motors.iter().flat_map(BTreeMap::keys) {
            let known = settings.motors.contains_key(name)
                || tree.transmissions.iter().any(|transmission| transmission.actuator == *name)
                || tree.servos.iter().any(|servo| servo.actuator == *name);
            if !known {
                at.keep::<()>(Err(unknown_motor(name, &format!("[tendons.{tendon}]"), at)));
            }
        }
    }
    let pins = settings.linkages.iter();
    let pins =
        pins.flat_map(|(pin, own)| own.links.iter().map(move |link| (format!("[linkages.{pin}]"), link)));
    let no_collision_names =
        settings.no_collision.iter().flatten().map(|link| ("no_collision".to_owned(), link));
    let touch = settings.tactile.iter().map(|group| (format!("tactile '{}'", group.name), &group.link));
    let known = |name: &String| tree.robot.links.iter().any(|link| link.name == *name);
    for (element, link) in pins.chain(no_collision_names).chain(touch).filter(|(_, link)| !known(link)) {
        at.keep::<()>(Err(unknown_link(link, &element, at)));
    }
}

fn read_text(bytes: Vec<u8>, file: &Path) -> Result<String, ModelError> {
    String::from_utf8(bytes).map_err(|e| Report::new(file).syntax("UTF-8", e))
}
