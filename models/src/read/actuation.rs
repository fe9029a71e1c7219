//! Motors and tendons, from the URDF's transmissions and `hand.toml`.

use std::collections::BTreeMap;

use super::report::Report;
use super::settings::{MotorSettings, Settings, TendonSettings};
use super::urdf::reduce::Reduced;
use super::urdf::transmission::Transmission;
use super::urdf::tree::Urdf;
use crate::error::ModelError;
use crate::hand::da_vinci::DaVinci;
use crate::hand::path::{Eyelets, Table, TendonPath};
use crate::hand::tendon::TendonElement;
use crate::hand::{Motor, Tendon};

/// Motor for an actuator without entry in `hand.toml`: the 2016 manipulation challenge drove its SoftHand by
/// σ times 7; the speed is that of this project's SoftHand.
const DEFAULT_MOTOR: MotorSettings = MotorSettings { scaling: 7.0, offset: 0.0, speed_limit: 2.0 };
/// Tendon for a transmission without entry in `hand.toml`: stiff compared with any joint spring, 20 N on a 45
/// mm cylinder.
static DEFAULT_TENDON: TendonSettings = TendonSettings {
    stiffness: 300.0,
    damping: 0.0,
    force_limit: 2.0,
    both_ways: false,
    hold_limit: None,
    breakaway: false,
    motors: None,
    rest: 0.0,
    joints: BTreeMap::new(),
    da_vinci: BTreeMap::new(),
    polynomial: BTreeMap::new(),
    table: BTreeMap::new(),
    eyelets: BTreeMap::new(),
};

/// Motors and tendons: those of the URDF's transmissions in their order, then those that `hand.toml` alone names, by name.
pub(crate) fn actuation(
    tree: &Urdf,
    reduced: &Reduced,
    settings: &Settings,
    report: &mut Report,
    at: &Report,
) -> Result<(Vec<Motor>, Vec<Tendon>), ModelError> {
    let mut motors: Vec<Motor> = Vec::new();
    let mut tendons = Vec::new();
    for transmission in &tree.transmissions {
        tendons.push(from_transmission(transmission, (tree, reduced, settings), &mut motors, report, at)?);
    }
    for (name, own) in &settings.tendons {
        if tree.transmissions.iter().any(|transmission| transmission.name == *name) {
            continue;
        }
        let element = format!("[tendons.{name}]");
        let moment_arms = arms(tree, reduced, &own.joints, &element, at)?;
        let elements = elements(tree, reduced, own, &element, at)?;
        let wound_by = weights(own, settings, &mut motors, &element, at)?.unwrap_or_default();
        tendons.push(tendon(name, wound_by, moment_arms, elements, own));
    }
    Ok((motors, tendons))
}

fn from_transmission(
    transmission: &Transmission,
    (tree, reduced, settings): (&Urdf, &Reduced, &Settings),
    motors: &mut Vec<Motor>,
    report: &mut Report,
    at: &Report,
) -> Result<Tendon, ModelError> {
    let element = format!("transmission '{}'", transmission.name);
    let mut moment_arms = Vec::new();
    for entry in &transmission.joints {
        let coordinate = coordinate(tree, reduced, &entry.joint, || element.clone(), report)?;
        if entry.moment_arm != 0.0 {
            moment_arms.push((coordinate, entry.moment_arm));
        }
    }
    moment_arms.sort_by_key(|&(coordinate, _)| coordinate);
    let own = settings.tendons.get(&transmission.name);
    if moment_arms.is_empty() && own.is_none_or(|own| !own.has_arms()) {
        let valid =
            "at least one <mechanicalReduction> other than 0: without a moment arm it pulls on nothing";
        return Err(report.bad(element, "every <mechanicalReduction> is 0", valid));
    }
    if own.is_some_and(|own| !own.joints.is_empty()) {
        let problem = "has `joints`, and the URDF has a transmission of this name";
        return Err(at.bad(
            format!("[tendons.{}]", transmission.name),
            problem,
            "one source of its row of R",
        ));
    }
    let toml = format!("[tendons.{}]", transmission.name);
    let weighted = own.map(|own| weights(own, settings, motors, &toml, at)).transpose()?.flatten();
    let wound_by = match weighted {
        Some(weighted) => weighted,
        None => vec![(motor_of(transmission, settings, motors, report), 1.0)],
    };
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
    let elements = elements(tree, reduced, own, &element, report)?;
    Ok(tendon(&transmission.name, wound_by, moment_arms, elements, own))
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
        rest: own.rest,
        elements,
        both_ways: own.both_ways,
        moment_arms,
        stiffness: own.stiffness,
        damping: own.damping,
        force_limit: own.force_limit,
        hold_limit: own.hold_limit,
        breakaway: own.breakaway,
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
        add_motor(&transmission.actuator, own, motors)
    })
}

fn add_motor(name: &str, own: &MotorSettings, motors: &mut Vec<Motor>) -> usize {
    motors.push(Motor {
        name: name.to_owned(),
        scaling: own.scaling,
        offset: own.offset,
        speed_limit: own.speed_limit,
    });
    motors.len() - 1
}

/// The motors that the settings name for a tendon, with their weights; None if they name none.
fn weights(
    own: &TendonSettings,
    settings: &Settings,
    motors: &mut Vec<Motor>,
    element: &str,
    at: &Report,
) -> Result<Option<Vec<(usize, f64)>>, ModelError> {
    let Some(named) = &own.motors else { return Ok(None) };
    let mut out = Vec::new();
    for (name, &weight) in named {
        let known = motors.iter().position(|motor| motor.name == *name);
        let motor = match (known, settings.motors.get(name)) {
            (Some(known), _) => known,
            (None, Some(settings)) => add_motor(name, settings, motors),
            (None, None) => {
                let problem = format!("names motor '{name}', which has no entry");
                return Err(at.bad(element, problem, format!("a table [motors.{name}]")));
            }
        };
        out.push((motor, weight));
    }
    out.sort_by_key(|entry| entry.0);
    Ok(Some(out))
}

/// A row of R by names of joints.
pub(super) fn arms(
    tree: &Urdf,
    reduced: &Reduced,
    joints: &BTreeMap<String, f64>,
    element: &str,
    at: &Report,
) -> Result<Vec<(usize, f64)>, ModelError> {
    let one = |(joint, arm): (&String, &f64)| {
        Ok((coordinate(tree, reduced, joint, || element.to_owned(), at)?, *arm))
    };
    let mut arms: Vec<(usize, f64)> = joints.iter().map(one).collect::<Result<_, ModelError>>()?;
    arms.sort_by_key(|&(coordinate, _)| coordinate);
    Ok(arms)
}

/// The paths of one tendon that are not linear, by coordinate of each kind.
fn elements(
    tree: &Urdf,
    reduced: &Reduced,
    own: &TendonSettings,
    element: &str,
    report: &Report,
) -> Result<Vec<TendonElement>, ModelError> {
    let mut out = Vec::new();
    let mut add = |kind: &str, joint: &str, path: Result<TendonPath, String>, valid: &str| {
        let element = || format!("{element}, {kind}.{joint}");
        let coordinate = coordinate(tree, reduced, joint, element, report)?;
        let path = path.map_err(|problem| report.bad(element(), problem, valid))?;
        out.push(TendonElement { coordinate, path });
        Ok(())
    };
    for (joint, geometry) in &own.da_vinci {
        let path = DaVinci::new(*geometry).map(TendonPath::DaVinci);
        add("da_vinci", joint, path, "pulleys that never overlap")?;
    }
    for (joint, polynomial) in &own.polynomial {
        let path = polynomial.clone().check().map(TendonPath::Polynomial);
        add("polynomial", joint, path, "coefficients = [c1, c2, …] of q, q², …")?;
    }
    for (joint, points) in &own.table {
        let path = Table::new(points.clone()).map(TendonPath::Table);
        add("table", joint, path, "at = [q, …] ascending, and a length for each")?;
    }
    for (joint, positions) in &own.eyelets {
        let path = Eyelets::new(*positions).map(TendonPath::Eyelets);
        add("eyelets", joint, path, "eyelets at different distances from the joint")?;
    }
    Ok(out)
}

/// Index of the coordinate that a URDF joint carries.
fn coordinate(
    tree: &Urdf,
    reduced: &Reduced,
    joint: &str,
    element: impl FnOnce() -> String,
    report: &Report,
) -> Result<usize, ModelError> {
    let found = reduced.coordinates.iter().position(|&c| tree.robot.joints[c].name == joint);
    found.ok_or_else(|| {
        report.bad(element(), format!("names joint '{joint}'"), "joints that move and mimic no other")
    })
}
