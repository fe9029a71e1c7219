//! Motors and tendons, from the URDF's transmissions and `hand.toml`.

use std::collections::BTreeMap;

use super::report::Report;
use super::settings::{MotorSettings, Settings, TendonSettings};
use super::urdf::reduce::Reduced;
use super::urdf::tree::Urdf;
use crate::error::ModelError;
use crate::hand::tendon::{DaVinci, DaVinciGeometry, TendonElement, TendonPath};
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
    da_vinci: BTreeMap::new(),
};

/// Motors and tendons: R from the transmissions' tags, the rest from the settings.
pub(crate) fn actuation(
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
            let coordinate = coordinate(tree, reduced, &entry.joint, || element.clone(), report)?;
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
        let coordinate = coordinate(tree, reduced, joint, element, report)?;
        let mechanism = DaVinci::new(*geometry)
            .map_err(|problem| report.bad(element(), problem, "pulleys that never overlap"))?;
        Ok(TendonElement { coordinate, path: TendonPath::DaVinci(mechanism) })
    };
    mechanisms.iter().map(one).collect()
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
