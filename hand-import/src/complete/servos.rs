//! Servos: motors that hold the position of one joint.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;

use palmares_models::measure::HandLimits;

use crate::decision::{At, Log};
use crate::draft::{Actuator, Control, Draft, Drive, Joint, JointKind, Tendon, TendonPath};

/// A servo of the written hand. Its joint's `<limit>` has its effort and velocity.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Servo {
    /// The name of its transmission.
    pub(crate) name: String,
    pub(crate) joint: String,
    pub(crate) motor: String,
    /// Numbers of `hand.toml`; `None` if the one in the source counts.
    pub(crate) numbers: Option<ServoNumbers>,
}

/// The numbers of a servo in `hand.toml`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ServoNumbers {
    /// Positions at σ = 0 and 1, where they are not the joint's limits.
    pub(crate) range: Option<[f64; 2]>,
    /// Force and speed of a joint whose limits have no place for them.
    pub(crate) limits: Option<[f64; 2]>,
    pub(crate) stiffness: f64,
    pub(crate) damping: f64,
}

/// Speed of a servo that states none.
const SPEED: (f64, f64) = (3.0, 0.1);
/// Largest force of a servo that states none.
const FORCE: (f64, f64) = (1.0, 20.0);
/// Error of position at which a servo has its largest force.
const ERROR: (f64, f64) = (0.05, 5e-4);
/// Damping over stiffness of a servo, s.
const LAG: f64 = 0.02;
/// Commands beyond the limits of a joint by more than this part of its range have no use.
const BEYOND: f64 = 0.5;

/// Value for a joint that turns, or for one that slides.
pub(super) fn of_kind(joint: &Joint, (turns, slides): (f64, f64)) -> f64 {
    if joint.kind == JointKind::Prismatic { slides } else { turns }
}

/// One motor for each joint that moves by itself.
pub(super) fn everywhere(draft: &mut Draft, log: &mut Log) {
    let follows: BTreeSet<&str> = draft.couplings.iter().map(|coupling| coupling.joint.as_str()).collect();
    let own = |joint: &&Joint| joint.kind != JointKind::Fixed && !follows.contains(joint.name.as_str());
    let names: Vec<String> = draft.joints.iter().filter(own).map(|joint| joint.name.clone()).collect();
    if names.is_empty() {
        log.problem(At::Hand, "robot", "has no joint that moves");
        return;
    }
    let text = format!("names no motor; each of its {} independent joints gets one of its own", names.len());
    log.guessed(At::Hand, "robot", text);
    draft.actuators.extend(names.iter().map(|name| Actuator::of(name, Drive::Joint(name.clone()))));
}

/// The servos of all motors that drive a joint; the joints get their effort and velocity.
pub(super) fn complete(draft: &mut Draft, log: &mut Log) -> Vec<Servo> {
    let mut servos: Vec<Servo> = Vec::new();
    let names = of_tendons(draft, log);
    for actuator in draft.actuators.clone() {
        let Drive::Joint(name) = &actuator.drive else { continue };
        let (at, element) = (At::Motor(actuator.name.clone()), format!("actuator '{}'", actuator.name));
        let Some(joint) = draft.joints.iter().find(|joint| joint.name == *name) else {
            let text = format!("drives joint '{name}', which is not there; it is left out");
            log.problem(At::Hand, element, text);
            continue;
        };
        if joint.kind == JointKind::Fixed {
            log.dropped(At::Hand, element, format!("drives joint '{name}', which is fixed"));
            continue;
        }
        if let Some(coupling) = draft.couplings.iter().find(|coupling| coupling.joint == *name) {
            let text = format!("drives joint '{name}', which follows '{}'", coupling.leader);
            log.dropped(At::Hand, element, text);
            continue;
        }
        if let Some(first) = servos.iter().find(|servo| servo.joint == *name) {
            let text = format!("drives joint '{name}', as '{}' does; a joint has one servo", first.motor);
            log.dropped(At::Hand, element, text);
            continue;
        }
        let kept = draft.settings.is_some();
        let mut numbers = None;
        if !kept {
            let moved = draft.range_with_followers(name).unwrap_or([-PI, PI]);
            let (force, speed, own) = servo(&actuator, (joint, moved), &at, &element, log);
            if let Some(joint) = draft.joints.iter_mut().find(|joint| joint.name == *name) {
                (joint.effort, joint.velocity) = (Some(force), Some(speed));
                stuck(joint, force, log);
            }
            numbers = Some(own);
        }
        let joint = name.clone();
        let name = names.get(&actuator.name).unwrap_or(name).clone();
        servos.push(Servo { name, joint, motor: actuator.name.clone(), numbers });
    }
    servos
}

/// A drive that pushes and pulls one joint is its servo. Returns the names of such tendons by motor.
fn of_tendons(draft: &mut Draft, log: &mut Log) -> BTreeMap<String, String> {
    let settings: toml::Table =
        draft.settings.as_deref().and_then(|text| text.parse().ok()).unwrap_or_default();
    let stated = |name: &str| settings.get("tendons").is_some_and(|tendons| tendons.get(name).is_some());
    let tendons = draft.tendons.clone();
    let wound_by = |motor: &String| {
        tendons.iter().filter(|tendon| tendon.motors.iter().any(|(name, _)| name == motor)).count()
    };
    let drive = |tendon: &Tendon| match (tendon.joints.as_slice(), tendon.motors.as_slice()) {
        ([(joint, TendonPath::Arm(arm))], [(motor, weight)])
            if tendon.stated.both_ways == Some(true)
                && tendon.stated.rest.is_none()
                && tendon.stated.hold_limit.is_none()
                && *arm != 0.0
                && *weight == 1.0
                && wound_by(motor) == 1 =>
        {
            (!stated(&tendon.name)).then(|| (joint.clone(), *arm, motor.clone()))
        }
        _ => None,
    };
    let mut names = BTreeMap::new();
    for tendon in tendons.clone() {
        let Some((joint, arm, motor)) = drive(&tendon) else { continue };
        // A joint has one servo.
        if draft.actuators.iter().any(|actuator| actuator.drive == Drive::Joint(joint.clone())) {
            continue;
        }
        let of_motor = |actuator: &&mut Actuator| actuator.name == motor;
        let Some(actuator) = draft.actuators.iter_mut().find(of_motor) else { continue };
        actuator.drive = Drive::Joint(joint.clone());
        actuator.gain = tendon.stated.stiffness.map(|k| k * arm * arm);
        actuator.damping = tendon.stated.damping.map(|b| b * arm * arm);
        actuator.force_limit = tendon.stated.force_limit.map(|f| f * arm.abs());
        actuator.speed_limit = actuator.speed_limit.map(|v| v / arm.abs());
        actuator.range = actuator.range.map(|range| range.map(|s| s / arm));
        let text = format!("pushes and pulls joint '{joint}' alone: it is its servo");
        log.taken(At::Motor(motor.clone()), format!("tendon '{}'", tendon.name), text);
        draft.tendons.retain(|other| other.name != tendon.name);
        names.insert(motor, tendon.name);
    }
    names
}

/// Largest force and speed of a servo, and the other numbers of it. `own`: where its joint can move.
fn servo(
    actuator: &Actuator,
    (joint, own): (&Joint, [f64; 2]),
    at: &At,
    element: &str,
    log: &mut Log,
) -> (f64, f64, ServoNumbers) {
    let mut guesses = Vec::new();
    let mut or = |value: Option<f64>, name: &str, guess: f64| {
        value.filter(|x| x.is_finite() && *x > 0.0).unwrap_or_else(|| {
            guesses.push(format!("{name} {guess:.4}"));
            guess
        })
    };
    let limits = HandLimits::default();
    let range = range(actuator, own, at, element, log);
    let width = range.map_or(own[1] - own[0], |[from, to]| (to - from).abs());
    // Descriptions for pictures state 100 or 1000 as a stand-in.
    let most = of_kind(joint, (limits.joint_torque_nm, limits.slide_force_n)).min(limits.tendon_force);
    let stated = actuator.force_limit.or(joint.effort);
    if let Some(force) = stated.filter(|force| *force > most && force.is_finite()) {
        let text = format!(
            "states the largest force {force}, more than the {most} that a hand may have: a stand-in"
        );
        log.guessed(at.clone(), element, text);
    }
    let stated = stated.filter(|force| *force <= most);
    let force = or(stated, "largest force", of_kind(joint, FORCE));
    // Rounding must not take it beyond the limit.
    let fastest = (limits.motor_speed_per_s * width * (1.0 - 1e-9)).min(limits.motor_power_w / force);
    let stated = actuator.speed_limit.or(joint.velocity);
    if let Some(speed) = stated.filter(|speed| *speed > fastest && speed.is_finite()) {
        let text =
            format!("states the largest speed {speed}, more than the {fastest:.4} that a hand may have");
        log.guessed(at.clone(), element, text);
    }
    let stated = stated.filter(|speed| *speed <= fastest);
    let speed = or(stated, "largest speed", of_kind(joint, SPEED).min(fastest));
    let stiffness = or(actuator.gain, "stiffness", force / of_kind(joint, ERROR));
    let damping = match actuator.damping.filter(|b| *b > 0.0) {
        Some(damping) => damping,
        None if joint.stated.damping.is_some_and(|d| d > 0.0) => 0.0,
        None => or(None, "damping", LAG * stiffness),
    };
    if !guesses.is_empty() {
        let text = format!("its servo on joint '{}' has {}", joint.name, guesses.join(", "));
        log.guessed(at.clone(), element, text);
    }
    let limits = joint.limits.is_none().then_some([force, speed]);
    (force, speed, ServoNumbers { range, limits, stiffness, damping })
}

/// A joint whose dry friction is above all that moves it would never move.
fn stuck(joint: &mut Joint, force: f64, log: &mut Log) {
    let unit = if joint.kind == JointKind::Prismatic { "N" } else { "N·m" };
    if let Some(friction) = joint.stated.friction.take_if(|friction| *friction >= force) {
        let text = format!(
            "states a dry friction of {friction} {unit}, and its motor has {force} {unit}: it would never move; a stand-in, taken is none"
        );
        log.guessed(At::Joint(joint.name.clone()), format!("joint '{}'", joint.name), text);
    }
}

/// Positions at the ends of the command, where they are not the joint's limits.
fn range(
    actuator: &Actuator,
    [low, high]: [f64; 2],
    at: &At,
    element: &str,
    log: &mut Log,
) -> Option<[f64; 2]> {
    let position = actuator.control.is_none_or(|control| control == Control::Position);
    let stated = actuator.range.filter(|r| position && r.iter().all(|x| x.is_finite()) && r[0] != r[1])?;
    let room = BEYOND * (high - low);
    let [from, to] = stated.map(|x| x.clamp(low - room, high + room));
    if from == to {
        let text = format!(
            "its commands, {} to {}, are outside the joint's limits {low} to {high}, which are taken",
            stated[0], stated[1]
        );
        log.problem(at.clone(), element, text);
        return None;
    }
    if [from, to] != stated {
        let text = format!(
            "its commands, {} to {}, reach far beyond the joint's limits {low} to {high}; taken are {from:.6} to {to:.6}",
            stated[0], stated[1]
        );
        log.guessed(at.clone(), element, text);
    }
    ([from, to] != [low, high]).then_some([from, to])
}
