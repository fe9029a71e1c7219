//! Numbers of a URDF: finite, and within the limits.

use urdf_rs::{Geometry, Robot};

use crate::error::ModelError;
use crate::read::limits::Limits;
use crate::read::report::Report;

/// Keeps an error for each link and joint with an invalid number. Returns whether all numbers are finite and within the limits; a
/// wrong sign does no harm.
pub(crate) fn check_numbers(robot: &Robot, limits: &Limits, report: &Report) -> bool {
    let mut sound = true;
    for link in &robot.links {
        sound &= report.keep(check_link(link, limits, report)).is_some();
        let mass = link.inertial.mass.value;
        if mass < 0.0 {
            let problem = format!("has the negative mass {mass} kg");
            let element = format!("link '{}'", link.name);
            report.keep::<()>(Err(report.bad(element, problem, "a mass of at least 0 kg")));
        }
    }
    for joint in &robot.joints {
        sound &= report.keep(check_joint(joint, limits, report)).is_some();
        let dynamics = joint.dynamics.as_ref().map_or([0.0; 2], |d| [d.damping, d.friction]);
        for (what, value) in ["damping", "friction"].into_iter().zip(dynamics).filter(|(_, x)| *x < 0.0) {
            let problem = format!("has {what} {value}");
            let element = format!("joint '{}'", joint.name);
            report.keep::<()>(Err(report.bad(element, problem, format!("finite {what} of at least 0"))));
        }
    }
    sound
}

fn check_origin(
    element: &dyn Fn() -> String,
    p: &urdf_rs::Pose,
    limits: &Limits,
    report: &Report,
) -> Result<(), ModelError> {
    p.xyz.iter().try_for_each(|&x| report.number(element, "an origin at (m)", x, limits.length_m))?;
    p.rpy.iter().try_for_each(|&x| report.number(element, "an origin turned by (rad)", x, limits.number))
}

fn check_link(link: &urdf_rs::Link, limits: &Limits, report: &Report) -> Result<(), ModelError> {
    let element = || format!("link '{}'", link.name);
    report.number(element, "a mass (kg) of", link.inertial.mass.value, limits.mass_kg)?;
    let i = &link.inertial.inertia;
    for moment in [i.ixx, i.ixy, i.ixz, i.iyy, i.iyz, i.izz] {
        report.number(element, "a moment of inertia (kg·m²) of", moment, limits.number)?;
    }
    check_origin(&element, &link.inertial.origin, limits, report)?;
    for collision in &link.collision {
        check_origin(&element, &collision.origin, limits, report)?;
        check_geometry(&collision.geometry, &element, limits, report)?;
    }
    Ok(())
}

fn check_joint(joint: &urdf_rs::Joint, limits: &Limits, report: &Report) -> Result<(), ModelError> {
    let element = || format!("joint '{}'", joint.name);
    check_origin(&element, &joint.origin, limits, report)?;
    joint.axis.xyz.iter().try_for_each(|&x| report.number(element, "an axis with", x, limits.number))?;
    report.number(element, "a lower limit of", joint.limit.lower, f64::MAX)?;
    report.number(element, "an upper limit of", joint.limit.upper, f64::MAX)?;
    let damping = joint.dynamics.as_ref().map_or(0.0, |d| d.damping);
    report.number(element, "damping", damping, limits.number)?;
    let friction = joint.dynamics.as_ref().map_or(0.0, |d| d.friction);
    report.number(element, "friction", friction, limits.number)?;
    if let Some(m) = &joint.mimic {
        let (multiplier, offset) = (m.multiplier.unwrap_or(1.0), m.offset.unwrap_or(0.0));
        let usable = 1.0 / limits.number..=limits.number;
        if !usable.contains(&multiplier.abs()) || !(0.0..=limits.number).contains(&offset.abs()) {
            let problem = format!("mimics with multiplier {multiplier} and offset {offset}");
            let valid = "a finite multiplier other than 0 and a finite offset";
            return Err(report.bad(element(), problem, valid));
        }
    }
    Ok(())
}

/// Sizes are bounded before anything is computed from them; the shape itself checks that they are positive.
fn check_geometry(
    geometry: &Geometry,
    element: &dyn Fn() -> String,
    limits: &Limits,
    report: &Report,
) -> Result<(), ModelError> {
    let sizes: &[f64] = match geometry {
        Geometry::Box { size } => &**size,
        Geometry::Cylinder { radius, length } | Geometry::Capsule { radius, length } => &[*radius, *length],
        Geometry::Sphere { radius } => &[*radius],
        // The corners of a mesh are checked when it has been read and scaled.
        Geometry::Mesh { .. } => &[],
    };
    sizes
        .iter()
        .try_for_each(|&x| report.number(element, "a collision shape of size (m)", x, limits.length_m))
}
