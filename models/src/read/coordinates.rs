//! The independent coordinates of a hand: limits and dampers from the URDF's joints, springs from its transmissions.

use urdf_rs::JointType;

use super::report::Report;
use super::settings::{CoordinateSettings, Settings};
use super::urdf::reduce::Reduced;
use super::urdf::tree::Urdf;
use crate::error::ModelError;
use crate::hand::Coordinate;

/// Each coordinate; spring and damper of `hand.toml` replace those of the URDF.
pub(crate) fn coordinates(
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
                // The limits of a follower apply to its leader.
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
