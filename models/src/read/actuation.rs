//! Motors and tendons, from the URDF's transmissions and `hand.toml`.

use std::collections::BTreeMap;

use super::report::Report;
use super::routing::guides;
use super::settings::Settings;
use super::urdf::reduce::Reduced;
use super::urdf::transmission::Transmission;
use super::urdf::tree::Urdf;
use crate::error::ModelError;
use crate::hand::da_vinci::DaVinci;
use crate::hand::load::{NO_OWN_TENDON, slowed_without_own_tendon};
use crate::hand::path::{Eyelets, MAX_DEGREE, MAX_POINTS, Table, TendonPath};
use crate::hand::tendon::{TendonElement, TendonSettings};
use crate::hand::{Motor, MotorNumbers, MotorSettings, Tendon, TendonNumbers};

/// Motor for an actuator without an entry in `hand.toml`. Its scaling of 7 is that of the 2016 manipulation
/// challenge's SoftHand; its speed is that of this project's SoftHand.
fn default_motor() -> MotorSettings {
    MotorSettings::plain(7.0, 0.0, 2.0)
}

/// Tendon for a transmission without entry in `hand.toml`: stiff compared with any joint spring, 20 N on a 45
/// mm cylinder.
fn default_tendon() -> TendonSettings {
    TendonSettings { stiffness: Some(300.0), force_limit: Some(2.0), ..TendonSettings::default() }
}

/// Motors and tendons. Those of the URDF's transmissions come first, in their order; those that only `hand.toml` names follow, by name.
/// Errors are kept, and a tendon with an error is left out.
pub(crate) fn actuation(
    tree: &Urdf,
    reduced: &Reduced,
    settings: &Settings,
    report: &mut Report,
    at: &Report,
) -> (Vec<Motor>, Vec<Tendon>) {
    let mut motors: Vec<Motor> = Vec::new();
    let mut tendons = Vec::new();
    for transmission in &tree.transmissions {
        tendons.extend(from_transmission(transmission, (tree, reduced, settings), &mut motors, report, at));
    }
    for (name, own) in &settings.tendons {
        if tree.transmissions.iter().any(|transmission| transmission.name == *name) {
            continue;
        }
        // The check of the names reports a tendon without a path.
        if !own.has_arms() {
            continue;
        }
        let element = format!("[tendons.{name}]");
        let moment_arms = arms(tree, reduced, &own.joints, &element, at);
        let elements = elements(tree, reduced, own, name, at);
        let wound_by = weights(own, settings, &mut motors, &element, at).map(Option::unwrap_or_default);
        let (Some(moment_arms), Some(elements), Some(wound_by)) = (moment_arms, elements, wound_by) else {
            continue;
        };
        let mut made = tendon(name, wound_by, moment_arms, elements, own);
        made.guides = guides(&made, own, tree, reduced, at);
        check(&made, &|c| format!("`joints.{}`", tree.robot.joints[reduced.coordinates[c]].name), at);
        tendons.push(made);
    }
    for tendon in &tendons {
        check_stall(tendon, &motors, at);
    }
    if let Some(motor) = slowed_without_own_tendon(&motors, &tendons) {
        at.keep::<()>(Err(at.bad(format!("[motors.{}]", motor.name), NO_OWN_TENDON.0, NO_OWN_TENDON.1)));
    }
    (motors, tendons)
}

fn from_transmission(
    transmission: &Transmission,
    (tree, reduced, settings): (&Urdf, &Reduced, &Settings),
    motors: &mut Vec<Motor>,
    report: &mut Report,
    at: &Report,
) -> Option<Tendon> {
    let element = format!("transmission '{}'", transmission.name);
    let mut moment_arms = Vec::new();
    let mut known = true;
    for entry in &transmission.joints {
        let found = coordinate(tree, reduced, &entry.joint, &element, report);
        known &= found.is_some();
        moment_arms.extend(found.filter(|_| entry.moment_arm != 0.0).map(|c| (c, entry.moment_arm)));
    }
    moment_arms.sort_by_key(|&(coordinate, _)| coordinate);
    let own = settings.tendons.get(&transmission.name);
    let toml = format!("[tendons.{}]", transmission.name);
    if known && moment_arms.is_empty() && own.is_none_or(|own| !own.has_arms()) {
        let valid =
            "at least one <mechanicalReduction> other than 0: without a moment arm it pulls on nothing";
        report.keep::<()>(Err(report.bad(&element, "every <mechanicalReduction> is 0", valid)));
        known = false;
    }
    if own.is_some_and(|own| !own.joints.is_empty()) {
        let problem = "has `joints`, and the URDF has a transmission of this name";
        at.keep::<()>(Err(at.bad(&toml, problem, "one source of its row of R")));
        known = false;
    }
    let weighted = own.map_or(Some(None), |own| weights(own, settings, motors, &toml, at));
    let wound_by = weighted.map(|weighted| {
        weighted.unwrap_or_else(|| vec![(motor_of(transmission, settings, motors, report), 1.0)])
    });
    let own = own.cloned().unwrap_or_else(|| {
        let own = default_tendon();
        let TendonNumbers { stiffness, force_limit, .. } = own.numbers();
        let taken =
            format!("no [tendons] entry: taken are stiffness {stiffness}, tension limit {force_limit}");
        report.warn(element.clone(), taken);
        own
    });
    let elements = elements(tree, reduced, &own, &transmission.name, at);
    let (Some(elements), Some(wound_by), true) = (elements, wound_by, known) else { return None };
    let mut made = tendon(&transmission.name, wound_by, moment_arms, elements, &own);
    made.guides = guides(&made, &own, tree, reduced, at);
    let joint = |c: usize| &tree.robot.joints[reduced.coordinates[c]].name;
    check(&made, &|c| format!("<mechanicalReduction> of joint '{}' in the URDF", joint(c)), at);
    Some(made)
}

/// Keeps an error for numbers of a tendon that contradict each other. `arm` says where a coordinate's entry of R is.
fn check(tendon: &Tendon, arm: &dyn Fn(usize) -> String, at: &Report) {
    let element = || format!("[tendons.{}]", tendon.name);
    let bad = |problem: String, valid: &str| at.keep::<()>(Err(at.bad(element(), problem, valid)));
    for (c, _) in
        tendon.moment_arms.iter().filter(|(c, _)| tendon.elements.iter().any(|e| e.coordinate == *c))
    {
        bad(
            format!("has {}, and a path of its own over the same joint", arm(*c)),
            "one of them: a path has all of the length, also its linear part",
        );
    }
    if let Some((problem, valid)) = tendon.contradiction() {
        bad(problem, &valid);
    }
}

/// Keeps an error for a tendon whose largest force exceeds the stall force of one of its motors.
fn check_stall(tendon: &Tendon, motors: &[Motor], at: &Report) {
    for &(motor, weight) in &tendon.motors {
        let motor = &motors[motor];
        let Some(stall) = motor.stall_force else { continue };
        let (name, limit, most) = (&motor.name, tendon.force_limit, stall / weight.abs());
        if limit > most {
            let problem = format!("has force_limit {limit}; its motor '{name}' stands still at {most}");
            let valid = format!("a force_limit of at most {most}, from the motor's stall_force");
            at.keep::<()>(Err(at.bad(format!("[tendons.{}]", tendon.name), problem, valid)));
        }
    }
}

fn tendon(
    name: &str,
    motors: Vec<(usize, f64)>,
    moment_arms: Vec<(usize, f64)>,
    elements: Vec<TendonElement>,
    own: &TendonSettings,
) -> Tendon {
    Tendon {
        name: name.to_owned(),
        motors,
        elements,
        moment_arms,
        guides: Vec::new(),
        numbers: own.numbers(),
    }
}

/// Index of the motor of a transmission's actuator; a new one is added.
fn motor_of(
    transmission: &Transmission,
    settings: &Settings,
    motors: &mut Vec<Motor>,
    report: &mut Report,
) -> usize {
    motors.iter().position(|m| m.name == transmission.actuator).unwrap_or_else(|| {
        let own = settings.motors.get(&transmission.actuator).copied().unwrap_or_else(|| {
            let own = default_motor();
            let MotorNumbers { scaling, speed_limit, .. } = own.numbers();
            let taken =
                format!("no [motors] entry: taken are scaling {scaling}, speed limit {speed_limit}/s");
            report.warn(format!("actuator '{}'", transmission.actuator), taken);
            own
        });
        add_motor(&transmission.actuator, &own, motors)
    })
}

fn add_motor(name: &str, own: &MotorSettings, motors: &mut Vec<Motor>) -> usize {
    motors.push(own.motor(name));
    motors.len() - 1
}

/// The motors that the settings name for a tendon, with their weights, `Some(None)` if they name none; `None` if one is unknown.
fn weights(
    own: &TendonSettings,
    settings: &Settings,
    motors: &mut Vec<Motor>,
    element: &str,
    at: &Report,
) -> Option<Option<Vec<(usize, f64)>>> {
    let Some(named) = &own.motors else { return Some(None) };
    let (mut out, mut known_all) = (Vec::new(), true);
    for (name, &weight) in named {
        let known = motors.iter().position(|motor| motor.name == *name);
        let motor = match (known, settings.motors.get(name)) {
            (Some(known), _) => known,
            (None, Some(settings)) => add_motor(name, settings, motors),
            (None, None) => {
                at.keep::<()>(Err(unknown_motor(name, element, at)));
                known_all = false;
                continue;
            }
        };
        out.push((motor, weight));
    }
    out.sort_by_key(|entry| entry.0);
    known_all.then_some(Some(out))
}

/// A row of R by names of joints; `None` if one is unknown.
pub(super) fn arms(
    tree: &Urdf,
    reduced: &Reduced,
    joints: &BTreeMap<String, f64>,
    element: &str,
    at: &Report,
) -> Option<Vec<(usize, f64)>> {
    let one = |(joint, arm): (&String, &f64)| Some((coordinate(tree, reduced, joint, element, at)?, *arm));
    // All unknown names are reported.
    let found: Vec<Option<(usize, f64)>> = joints.iter().map(one).collect();
    let mut arms = found.into_iter().collect::<Option<Vec<(usize, f64)>>>()?;
    arms.sort_by_key(|&(coordinate, _)| coordinate);
    Some(arms)
}

/// The paths of one tendon that are not linear, by coordinate of each kind; `None` if one is wrong.
fn elements(
    tree: &Urdf,
    reduced: &Reduced,
    own: &TendonSettings,
    tendon: &str,
    at: &Report,
) -> Option<Vec<TendonElement>> {
    let mut out: Vec<(String, TendonElement)> = Vec::new();
    let mut sound = true;
    let mut add = |kind: &str, joint: &str, path: Result<TendonPath, String>, valid: &str| {
        let element = format!("[tendons.{tendon}.{kind}.{joint}]");
        let coordinate = coordinate(tree, reduced, joint, &element, at);
        let path = at.keep(path.map_err(|problem| at.bad(&element, problem, valid)));
        let (Some(coordinate), Some(path)) = (coordinate, path) else {
            sound = false;
            return;
        };
        if let Some((other, _)) = out.iter().find(|(_, other)| other.coordinate == coordinate) {
            let problem = format!("is a second path over its joint, beside {other}");
            at.keep::<()>(Err(at.bad(&element, problem, "one path of a tendon over each joint")));
            sound = false;
        }
        out.push((element, TendonElement { coordinate, path }));
    };
    for (joint, geometry) in &own.da_vinci {
        let path = DaVinci::new(*geometry).map(TendonPath::DaVinci);
        add("da_vinci", joint, path, "pulleys that never overlap");
    }
    for (joint, polynomial) in &own.polynomial {
        let path = polynomial.clone().check().map(TendonPath::Polynomial);
        let valid = format!("coefficients = [c1, c2, …] of q, q², …: 1 to {MAX_DEGREE}, not all 0");
        add("polynomial", joint, path, &valid);
    }
    for (joint, points) in &own.table {
        let path = Table::new(points.clone()).map(TendonPath::Table);
        let valid = format!("at = [q, …] ascending, and as many in length = [s, …], 2 to {MAX_POINTS}");
        add("table", joint, path, &valid);
    }
    for (joint, positions) in &own.eyelets {
        let path = Eyelets::new(*positions).map(TendonPath::Eyelets);
        add("eyelets", joint, path, "eyelets at different distances from the joint");
    }
    sound.then(|| out.into_iter().map(|(_, element)| element).collect())
}

/// Index of the coordinate that a URDF joint carries; an unknown joint is kept as an error.
fn coordinate(tree: &Urdf, reduced: &Reduced, joint: &str, element: &str, report: &Report) -> Option<usize> {
    let found = reduced.coordinates.iter().position(|&c| tree.robot.joints[c].name == joint);
    if found.is_none() {
        report.keep::<()>(Err(unknown_joint(joint, element, report)));
    }
    found
}

/// The error about a joint that does not exist, or has no motion of its own.
pub(super) fn unknown_joint(joint: &str, element: &str, report: &Report) -> ModelError {
    report.bad(element, format!("names joint '{joint}'"), "joints that move and mimic no other")
}

/// A tendon names a motor that does not exist.
pub(super) fn unknown_motor(name: &str, element: &str, at: &Report) -> ModelError {
    at.bad(element, format!("names motor '{name}', which has no entry"), format!("a table [motors.{name}]"))
}
