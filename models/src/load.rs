//! Hands from files: a URDF, and a `hand.toml` beside it for what a URDF has no place for.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use urdf_rs::JointType;

use crate::error::{LoadWarning, ModelError};
use crate::files::{Files, has_extension, read_limited};
use crate::geometry::Builder;
use crate::hand::tendon::{DaVinci, DaVinciGeometry, TendonElement, TendonPath};
use crate::hand::{Coordinate, Hand, Motor, Tendon};
use crate::limits::Limits;
use crate::measure::{Sources, oddities};
use crate::rolling::{self, Reduced};
use crate::settings::{CoordinateSettings, MotorSettings, Settings, TendonSettings};
use crate::tactile;
use crate::urdf::{self, Urdf};

/// Stands in for a motor no `hand.toml` describes: the 2016 manipulation challenge drove its SoftHand by σ times 7;
/// the speed is this project's SoftHand's.
const DEFAULT_MOTOR: MotorSettings = MotorSettings { scaling: 7.0, offset: 0.0, speed_limit: 2.0 };
/// Stands in for a tendon no `hand.toml` describes: stiff against any joint spring, 20 N on a 45 mm cylinder.
static DEFAULT_TENDON: TendonSettings = TendonSettings {
    stiffness: 300.0,
    damping: 0.0,
    force_limit: 2.0,
    both_ways: false,
    da_vinci: BTreeMap::new(),
};

/// Pairs of links closer than this at rest never collide with each other, m.
const TOUCHING_AT_REST: f64 = 1e-3;

/// Where a link's inertia comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum InertiaPolicy {
    /// What the file states; what cannot be true is reported.
    #[default]
    FromFile,
    /// From the collision shapes and the stated mass.
    FromGeometry,
}

/// How to read a hand.
#[derive(Clone, Debug)]
pub struct LoadOptions {
    /// The `hand.toml`; `None` for the one beside the URDF, if there is one.
    pub settings: Option<PathBuf>,
    /// Used unless `hand.toml` says otherwise.
    pub inertia: InertiaPolicy,
    /// Coulomb friction of surfaces, unless `hand.toml` says otherwise.
    pub friction: f64,
    /// Support points kept of a mesh.
    pub hull_directions: usize,
    /// Edge radius of a mesh's hull, m.
    pub hull_rounding: f64,
    /// Bounds on what a file may ask for.
    pub limits: Limits,
}

impl Default for LoadOptions {
    fn default() -> LoadOptions {
        LoadOptions {
            settings: None,
            inertia: InertiaPolicy::FromFile,
            friction: 1.0,
            hull_directions: 64,
            hull_rounding: 2e-3,
            limits: Limits::default(),
        }
    }
}

/// A hand and what its author should know.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The hand.
    pub hand: Hand,
    /// Its URDF, as messages call it, and what its `hand.toml` states instead.
    pub sources: Sources,
    /// What was odd: about the files in the order it was found, then about the hand.
    pub warnings: Vec<LoadWarning>,
}

/// Reads a hand: a URDF file, a folder or a ZIP archive with one. The `hand.toml` beside the URDF is used, if there
/// is one and the options name no other.
///
/// # Errors
/// The first thing found wrong, with file, element and what would be valid.
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
    let beside = Path::new("hand.toml");
    let settings = match &options.settings {
        Some(file) => Some((file.clone(), read_limited(file, "settings", limit)?)),
        None if files.contains(beside) => {
            Some((files.display(beside), files.read(beside, "settings", limit)?))
        }
        None => None,
    };
    let settings = match settings {
        Some((file, bytes)) => Some((read_text(bytes, &file)?, file)),
        None => None,
    };
    let settings = settings.as_ref().map(|(text, file)| (file.as_path(), text.as_str()));
    from_text((&urdf_file, &text), settings, Some(&files), options)
}

/// Reads a hand from texts already in memory, each with the name to report it by. Without files, a mesh is an error.
///
/// # Errors
/// As [`hand`].
pub fn from_text(
    urdf: (&Path, &str),
    settings: Option<(&Path, &str)>,
    files: Option<&Files>,
    options: &LoadOptions,
) -> Result<Loaded, ModelError> {
    let mut report = Report { file: urdf.0.to_owned(), warnings: Vec::new() };
    let tree = urdf::parse(urdf.1, &options.limits, &mut report)?;
    let at = Report { file: settings.map_or(urdf.0, |(file, _)| file).to_owned(), warnings: Vec::new() };
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
    let builder = Builder::new(&settings, options, files);
    let reduced = rolling::reduce(&tree, &builder, &mut report)?;
    let coordinates = coordinates(&tree, &reduced, &settings, &mut report)?;
    let (motors, tendons) = actuation(&tree, &reduced, &settings, &mut report)?;
    let patches: usize = settings.tactile.iter().map(|group| group.centers.len()).sum();
    at.limit("tactile", "patches", patches, options.limits.tactile_patches)?;
    let tactile = tactile::patches(&settings.tactile, &tree, &reduced, &at)?;
    let mut hand = Hand {
        name,
        description: settings.description.clone().unwrap_or_default(),
        links: reduced.links,
        coordinates,
        tendons,
        motors,
        gravity_compensation: settings.gravity_compensation.unwrap_or(true),
        no_collision: Vec::new(),
        tactile,
    };
    hand.validate().map_err(|error| match error {
        // What hand.toml states was looked at where it was read.
        ModelError::Inconsistent { element, problem, .. } => {
            ModelError::Inconsistent { name: report.file.display().to_string(), element, problem }
        }
        error => error,
    })?;
    let rest: Vec<f64> = hand.coordinates.iter().map(|c| c.rest).collect();
    hand.no_collision = hand.pairs_closer_than(TOUCHING_AT_REST, &rest);
    let mut warnings = report.warnings;
    warnings.extend(oddities(&hand, &report.file));
    let sources = Sources { urdf: report.file, settings: at.file, stated: settings.stated() };
    Ok(Loaded { hand, sources, warnings })
}

/// A hand's name stands in addresses, on pages and in file names.
fn check_name(name: &str, at: &Report) -> Result<(), ModelError> {
    const LONGEST: usize = 64;
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
    if (1..=LONGEST).contains(&name.len()) && name.chars().all(plain) && !name.starts_with('.') {
        return Ok(());
    }
    let shown: String = name.chars().take(LONGEST).collect();
    Err(at.bad(
        "name of the hand".to_owned(),
        format!("is '{}'", shown.escape_debug()),
        "1 to 64 letters, digits, '_', '-' and '.', the first no '.'",
    ))
}

/// Every name in the settings stands for something in the URDF.
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
    check("tendons", &settings.tendons, tree.transmissions.iter().map(|t| t.name.as_str()), at)?;
    check("motors", &settings.motors, tree.transmissions.iter().map(|t| t.actuator.as_str()), at)
}

fn coordinates(
    tree: &Urdf,
    reduced: &Reduced,
    settings: &Settings,
    report: &mut Report,
) -> Result<Vec<Coordinate>, ModelError> {
    let none = CoordinateSettings::default();
    let mut out = Vec::new();
    for &leader in &reduced.coordinates {
        let name = tree.robot.joints[leader].name.clone();
        let (mut lower, mut upper) = (f64::NEG_INFINITY, f64::INFINITY);
        let mut damping = 0.0;
        for (joint, motion) in tree.robot.joints.iter().zip(&reduced.motions) {
            let Some(motion) = motion.filter(|m| m.leader == leader) else { continue };
            if let Some(dynamics) = &joint.dynamics {
                // A damper on x = ratio q + offset dissipates d ẋ² = d ratio² q̇².
                damping += motion.ratio * motion.ratio * dynamics.damping;
                if dynamics.friction != 0.0 {
                    report.warn(
                        format!("joint '{}'", joint.name),
                        format!("dry friction of {} is not modelled; ignored", dynamics.friction),
                    );
                }
            }
            if joint.joint_type != JointType::Continuous {
                check_limits(&joint.name, joint.limit.lower, joint.limit.upper, report)?;
                // The limits of a follower bind its leader.
                let a = (joint.limit.lower - motion.offset) / motion.ratio;
                let b = (joint.limit.upper - motion.offset) / motion.ratio;
                lower = f64::max(lower, a.min(b));
                upper = f64::min(upper, a.max(b));
            }
        }
        check_limits(&name, lower, upper, report)?;
        let tag = tree.transmissions.iter().flat_map(|t| &t.joints).find(|j| j.joint == name);
        let own = settings.coordinates.get(&name).unwrap_or(&none);
        let every = &settings.every_coordinate;
        out.push(Coordinate {
            stiffness: own.stiffness.or(every.stiffness).unwrap_or(tag.map_or(0.0, |t| t.stiffness)),
            damping: own.damping.or(every.damping).unwrap_or(damping),
            rest: own.rest.or(every.rest).unwrap_or(tag.map_or(0.0, |t| t.rest)),
            name,
            lower,
            upper,
        });
    }
    Ok(out)
}

fn check_limits(joint: &str, lower: f64, upper: f64, report: &Report) -> Result<(), ModelError> {
    if lower < upper {
        return Ok(());
    }
    Err(report.bad(
        format!("joint '{joint}'"),
        format!("has limits {lower} to {upper}"),
        "<limit lower=… upper=…> with lower < upper, for the joint and all that mimic it together",
    ))
}

/// Motors and tendons: R from the transmissions' tags, the rest from the settings.
fn actuation(
    tree: &Urdf,
    reduced: &Reduced,
    settings: &Settings,
    report: &mut Report,
) -> Result<(Vec<Motor>, Vec<Tendon>), ModelError> {
    let mut motors: Vec<Motor> = Vec::new();
    let mut tendons = Vec::new();
    for transmission in &tree.transmissions {
        let element = format!("transmission '{}'", transmission.name);
        let mut moment_arms = Vec::new();
        for entry in &transmission.joints {
            let coordinate = reduced
                .coordinates
                .iter()
                .position(|&c| tree.robot.joints[c].name == entry.joint)
                .ok_or_else(|| {
                    report.bad(
                        element.clone(),
                        format!("names joint '{}'", entry.joint),
                        "joints that move and mimic no other",
                    )
                })?;
            if entry.moment_arm != 0.0 {
                moment_arms.push((coordinate, entry.moment_arm));
            }
        }
        moment_arms.sort_by_key(|&(coordinate, _)| coordinate);
        let own = settings.tendons.get(&transmission.name);
        if moment_arms.is_empty() && own.is_none_or(|own| own.da_vinci.is_empty()) {
            let valid =
                "at least one <mechanicalReduction> other than 0: without a moment arm it pulls on nothing";
            return Err(report.bad(element, "every <mechanicalReduction> is 0", valid));
        }

        let motor = motors.iter().position(|m| m.name == transmission.actuator).unwrap_or_else(|| {
            let own = settings.motors.get(&transmission.actuator).unwrap_or_else(|| {
                report.warn(
                    format!("actuator '{}'", transmission.actuator),
                    format!(
                        "no [motors] entry: taken are scaling {}, speed limit {}/s",
                        DEFAULT_MOTOR.scaling, DEFAULT_MOTOR.speed_limit
                    ),
                );
                &DEFAULT_MOTOR
            });
            motors.push(Motor {
                name: transmission.actuator.clone(),
                scaling: own.scaling,
                offset: own.offset,
                speed_limit: own.speed_limit,
            });
            motors.len() - 1
        });
        let own = own.unwrap_or_else(|| {
            report.warn(
                element.clone(),
                format!(
                    "no [tendons] entry: taken are stiffness {}, tension limit {}",
                    DEFAULT_TENDON.stiffness, DEFAULT_TENDON.force_limit
                ),
            );
            &DEFAULT_TENDON
        });
        tendons.push(Tendon {
            name: transmission.name.clone(),
            motor,
            elements: elements(tree, reduced, &own.da_vinci, &element, report)?,
            both_ways: own.both_ways,
            moment_arms,
            stiffness: own.stiffness,
            damping: own.damping,
            force_limit: own.force_limit,
        });
    }
    Ok((motors, tendons))
}

/// The Da Vinci mechanisms of one tendon.
fn elements(
    tree: &Urdf,
    reduced: &Reduced,
    mechanisms: &BTreeMap<String, DaVinciGeometry>,
    element: &str,
    report: &Report,
) -> Result<Vec<TendonElement>, ModelError> {
    let one = |(joint, geometry): (&String, &DaVinciGeometry)| {
        let element = || format!("{element}, da_vinci.{joint}");
        let coordinate = reduced
            .coordinates
            .iter()
            .position(|&c| tree.robot.joints[c].name == *joint)
            .ok_or_else(|| {
                report.bad(element(), format!("names joint '{joint}'"), "joints that move and mimic no other")
            })?;
        let mechanism = DaVinci::new(*geometry)
            .map_err(|problem| report.bad(element(), problem, "pulleys that never overlap"))?;
        Ok(TendonElement { coordinate, path: TendonPath::DaVinci(mechanism) })
    };
    mechanisms.iter().map(one).collect()
}

/// Collects warnings about one file and words its errors.
pub(crate) struct Report {
    pub(crate) file: PathBuf,
    pub(crate) warnings: Vec<LoadWarning>,
}

impl Report {
    pub(crate) fn warn(&mut self, element: impl Into<String>, message: impl Into<String>) {
        let (element, message) = (element.into(), message.into());
        self.warnings.push(LoadWarning { file: self.file.clone(), element, message });
    }

    pub(crate) fn bad(
        &self,
        element: String,
        problem: impl Into<String>,
        valid: impl Into<String>,
    ) -> ModelError {
        ModelError::Element { file: self.file.clone(), element, problem: problem.into(), valid: valid.into() }
    }

    pub(crate) fn syntax(&self, format: &'static str, error: impl ToString) -> ModelError {
        ModelError::Syntax { file: self.file.clone(), format, message: error.to_string() }
    }

    /// Refuses more than `limit` of something.
    pub(crate) fn limit(
        &self,
        element: impl Into<String>,
        what: &'static str,
        found: usize,
        limit: usize,
    ) -> Result<(), ModelError> {
        if found <= limit {
            return Ok(());
        }
        let (file, element) = (self.file.clone(), element.into());
        Err(ModelError::TooLarge { file, element, what, found: found as u64, limit: limit as u64 })
    }

    /// Refuses a number that is not finite or larger than `limit`.
    pub(crate) fn number(
        &self,
        element: impl FnOnce() -> String,
        what: &str,
        value: f64,
        limit: f64,
    ) -> Result<(), ModelError> {
        if value.abs() <= limit {
            return Ok(());
        }
        Err(self.bad(
            element(),
            format!("has {what} {value:e}"),
            format!("finite numbers of at most {limit:e}"),
        ))
    }
}

fn read_text(bytes: Vec<u8>, file: &Path) -> Result<String, ModelError> {
    String::from_utf8(bytes).map_err(|e| ModelError::Syntax {
        file: file.to_owned(),
        format: "UTF-8",
        message: e.to_string(),
    })
}
