//! Servo drives: each joint has one motor, which holds its position.
//!
//! σ from 0 to 1 is the range of the joint. The drive is a tendon with R = 1 that pushes as well as it pulls. A servo
//! comes from a `SimpleTransmission` of the URDF, or from `servo_joints` or `[servos.JOINT]` in `hand.toml`.

use std::f64::consts::PI;

use super::report::Report;
use super::servo_settings::{ServoJoints, ServoSettings};
use super::settings::Settings;
use super::urdf::reduce::Reduced;
use super::urdf::tree::Urdf;
use crate::error::ModelError;
use crate::hand::{Coordinate, Motor, MotorSettings, StatedTendon, Tendon};

/// Deviation at which a servo without a stated stiffness has its largest torque, rad and m. A position servo of a robot
/// hand is stiffer than any joint spring: the Allegro's has 0.7 N·m, so 7 N·m/rad here.
const FULL_EFFORT_AT: [f64; 2] = [0.1, 0.005];
/// Damping over stiffness of a servo without a stated damping, s: at 5 rad/s it takes half of the largest torque.
const DAMPING_S: f64 = 0.01;

/// Adds the motors and drives of all servos, in the order of the coordinates. Problems are kept.
pub(crate) fn add(
    (tree, reduced, settings): (&Urdf, &Reduced, &Settings),
    coordinates: &[Coordinate],
    motors: &mut Vec<Motor>,
    tendons: &mut Vec<Tendon>,
    (report, at): (&mut Report, &Report),
) {
    let independent = |name: &str| coordinates.iter().any(|c| c.name == name);
    for servo in tree.servos.iter().filter(|servo| !independent(&servo.joint)) {
        let message = format!("joint '{}' has no motion of its own; ignored", servo.joint);
        report.warn(format!("transmission '{}'", servo.name), message);
    }
    let all = matches!(settings.servo_joints, Some(ServoJoints::Word(_)));
    let listed = settings.servo_joints.as_ref().map_or(&[][..], ServoJoints::names);
    let pulled = tendons.len();
    for (c, coordinate) in coordinates.iter().enumerate() {
        let name = &coordinate.name;
        let driven = tendons[..pulled].iter().any(|tendon| tendon.coordinates().contains(&c));
        let in_urdf = tree.servos.iter().find(|servo| servo.joint == *name);
        let stated = settings.servos.contains_key(name) || listed.contains(name);
        if let (Some(servo), true, false) = (in_urdf, driven, stated) {
            let message = format!("joint '{name}' has a tendon already; ignored");
            report.warn(format!("transmission '{}'", servo.name), message);
        }
        if !(stated || !driven && (all || in_urdf.is_some())) {
            continue;
        }
        let numbers = numbers(&tree.robot.joints[reduced.coordinates[c]], coordinate, settings, report);
        let Numbers { range: [from, to], effort, velocity, stiffness, damping } = match numbers {
            Ok(numbers) => numbers,
            // A transmission for ROS alone needs no limits.
            Err(error) if !stated && !all => {
                let element = in_urdf.map_or_else(String::new, |s| format!("transmission '{}'", s.name));
                report.warn(element, format!("{error}; ignored"));
                continue;
            }
            Err(error) => {
                at.keep::<()>(Err(error));
                continue;
            }
        };
        let actuator = in_urdf.map_or(name, |servo| &servo.actuator);
        let taken = motors.iter().any(|motor| motor.name == *actuator);
        let motor = if taken { name } else { actuator };
        let scaling = to - from;
        let stated = settings.motors.get(motor);
        // A range far from 0 counts from its first end: otherwise the offset would be many times the range.
        let far = stated.is_none() && from.abs() > scaling.abs();
        let offset = if far { 0.0 } else { -from / scaling };
        let of_joint = MotorSettings::plain(scaling, offset, velocity / scaling.abs());
        motors.push(stated.unwrap_or(&of_joint).motor(motor));
        let drive = StatedTendon {
            rest: far.then_some(from),
            both_ways: Some(true),
            stiffness: Some(stiffness),
            damping: Some(damping),
            force_limit: Some(effort),
            ..StatedTendon::default()
        };
        tendons.push(Tendon {
            name: in_urdf.map_or(name, |servo| &servo.name).clone(),
            motors: vec![(motors.len() - 1, 1.0)],
            moment_arms: vec![(c, 1.0)],
            elements: Vec::new(),
            guides: Vec::new(),
            numbers: drive.numbers(),
        });
    }
}

/// The numbers of a servo.
struct Numbers {
    range: [f64; 2],
    effort: f64,
    velocity: f64,
    stiffness: f64,
    damping: f64,
}

fn numbers(
    joint: &urdf_rs::Joint,
    coordinate: &Coordinate,
    settings: &Settings,
    report: &Report,
) -> Result<Numbers, ModelError> {
    let own = settings.servos.get(&coordinate.name).copied().unwrap_or_default();
    let every = &settings.every_servo;
    let stated = |field: fn(&ServoSettings) -> Option<f64>| field(&own).or(field(every));
    let of_limit = |what: &str, value: Option<f64>, in_urdf: f64| {
        value.or(Some(in_urdf).filter(|x| *x > 0.0 && *x <= MAX_LIMIT)).ok_or_else(|| {
            report.bad(
                format!("joint '{}'", coordinate.name),
                format!("has no <limit {what}> for its servo"),
                format!(
                    "a {what} of more than 0, there or as [servos.{}] {what} in hand.toml",
                    coordinate.name
                ),
            )
        })
    };
    let effort = of_limit("effort", stated(|s| s.effort), joint.limit.effort)?;
    let velocity = of_limit("velocity", stated(|s| s.velocity), joint.limit.velocity)?;
    let slides = joint.joint_type == urdf_rs::JointType::Prismatic;
    let stiffness = stated(|s| s.stiffness).unwrap_or(effort / FULL_EFFORT_AT[usize::from(slides)]);
    let damping = stated(|s| s.damping).unwrap_or(DAMPING_S * stiffness);
    // A continuous joint makes one turn.
    let end = |limit: f64, without: f64| if limit.is_finite() { limit } else { without };
    let range = own.range.map_or([end(coordinate.lower, -PI), end(coordinate.upper, PI)], |range| range.0);
    Ok(Numbers { range, effort, velocity, stiffness, damping })
}

/// Largest effort and speed that a URDF can mean.
const MAX_LIMIT: f64 = 1e9;
