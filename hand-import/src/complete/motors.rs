//! Motors and tendons as a hand has them: a motor at σ from 0 to 1 winds its tendons to s = scaling · (σ − offset).

use std::collections::BTreeSet;

use palmares_models::measure::HandLimits;

use crate::decision::{At, Log};
use crate::draft::{Actuator, Draft, Drive, Joint, JointKind, Tendon, TendonPath};

/// A motor of the written hand.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Motor {
    pub(crate) name: String,
    /// Length per σ.
    pub(crate) scaling: f64,
    /// σ at which the length is 0.
    pub(crate) offset: f64,
    /// 1/s
    pub(crate) speed_limit: f64,
}

/// A tendon of the written hand.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Wound {
    pub(crate) name: String,
    /// With their weights; none: a passive tendon.
    pub(crate) motors: Vec<(String, f64)>,
    /// Constant entries of R by joint.
    pub(crate) arms: Vec<(String, f64)>,
    /// Lengths that are not linear, by joint.
    pub(crate) paths: Vec<(String, TendonPath)>,
    /// Wound length without the motors' part.
    pub(crate) rest: f64,
    pub(crate) stiffness: f64,
    pub(crate) damping: f64,
    pub(crate) force_limit: f64,
    pub(crate) both_ways: bool,
    pub(crate) hold_limit: Option<f64>,
    pub(crate) breakaway: bool,
}

impl Wound {
    /// The motor of a tendon that a transmission of the URDF can state: one motor, constant moment arms.
    pub(crate) fn motor_in_urdf(&self) -> Option<&str> {
        match self.motors.as_slice() {
            [(motor, weight)] if *weight == 1.0 && self.paths.is_empty() && self.rest == 0.0 => Some(motor),
            _ => None,
        }
    }
}

/// Speed of a servo that states none.
const SPEED: (f64, f64) = (3.0, 0.1);
/// Largest force of a servo that states none.
const FORCE: (f64, f64) = (1.0, 20.0);
/// Error of position at which a servo has its largest force.
const ERROR: (f64, f64) = (0.05, 5e-4);
/// Damping over stiffness of a servo, s.
const LAG: f64 = 0.02;
/// Largest damping over stiffness of a servo that a description can mean, s.
const SLOWEST: f64 = 1.0;
/// Part of its travel by which a tendon stretches at its largest tension.
const STRETCH: f64 = 0.002;
/// Largest speed of a tendon's motor, 1/s: it closes in half a second.
const CLOSING: f64 = 2.0;
/// Largest tension of a tendon without springs and efforts to compare with, in its own unit.
const TENSION: f64 = 10.0;
/// Damping over stiffness of a joint with a spring, s.
const SPRING_LAG: f64 = 0.05;
/// Damping of a joint that nothing else damps, N·m·s/rad and N·s/m.
const DAMPING: (f64, f64) = (0.01, 5.0);

/// The motors and tendons of a draft.
pub(crate) fn complete(draft: &mut Draft, log: &mut Log) -> (Vec<Motor>, Vec<Wound>) {
    let kept = draft.settings.is_some();
    if draft.actuators.is_empty() && !kept {
        servos_everywhere(draft, log);
    }
    if !kept {
        stand_ins(draft, log);
    }
    let (mut motors, mut wound) = (Vec::new(), Vec::new());
    let mut driven = BTreeSet::new();
    for tendon in draft.tendons.clone() {
        if let Some((winding, cable)) = cable(&tendon, draft, log) {
            driven.extend(cable.arms.iter().map(|(joint, _)| joint.clone()));
            driven.extend(cable.paths.iter().map(|(joint, _)| joint.clone()));
            for motor in winding {
                if !motors.iter().any(|other: &Motor| other.name == motor.name) {
                    motors.push(motor);
                }
            }
            wound.push(cable);
        }
    }
    for actuator in draft.actuators.clone() {
        let Drive::Joint(name) = &actuator.drive else { continue };
        let (at, element) = (At::Motor(actuator.name.clone()), format!("actuator '{}'", actuator.name));
        let Some(joint) = draft.joints.iter().find(|joint| joint.name == *name) else {
            log.problem(
                At::Hand,
                element,
                format!("drives joint '{name}', which is not there; it is left out"),
            );
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
        if kept {
            continue;
        }
        let (motor, servo) = servo(&actuator, joint, &at, &element, log);
        driven.insert(name.clone());
        motors.push(motor);
        wound.push(servo);
    }
    driven.extend(draft.springs.iter().flat_map(|spring| &spring.joints).map(|(joint, _)| joint.clone()));
    if !kept {
        dampers(draft, &driven, log);
        without_place(draft, log);
    }
    (motors, wound)
}

/// Takes out gains and dampings that no hand may have: descriptions for pictures copy them from one kind of joint to another.
fn stand_ins(draft: &mut Draft, log: &mut Log) {
    let limits = HandLimits::default();
    let mut check = |value: &mut Option<f64>, what: &str, most: f64, at: At, element: String| {
        if let Some(x) = value.take_if(|x| *x > most) {
            log.guessed(
                at,
                element,
                format!("states {what} {x}, more than the {most} that a hand may have: a stand-in"),
            );
        }
    };
    for joint in &mut draft.joints {
        let most = of_kind(joint, (limits.joint_damping_nms_rad, limits.slide_damping_ns_m));
        let (at, element) = (At::Joint(joint.name.clone()), format!("joint '{}'", joint.name));
        check(&mut joint.damping, "the damping", most, at, element);
    }
    for actuator in &mut draft.actuators {
        let (at, element) = (At::Motor(actuator.name.clone()), format!("actuator '{}'", actuator.name));
        check(&mut actuator.gain, "the gain", limits.tendon_stiffness, at.clone(), element.clone());
        check(&mut actuator.damping, "the damping", limits.tendon_damping, at.clone(), element.clone());
        if let Some(gain) = actuator.gain.filter(|gain| *gain > 0.0)
            && let Some(damping) = actuator.damping.take_if(|damping| *damping > SLOWEST * gain)
        {
            let text = format!(
                "states the damping {damping}, more than {SLOWEST} s times its gain {gain}: it would creep; a stand-in"
            );
            log.guessed(at, element, text);
        }
    }
}

/// One motor for each joint that moves by itself.
fn servos_everywhere(draft: &mut Draft, log: &mut Log) {
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

/// Value for a joint that turns, or for one that slides.
fn of_kind(joint: &Joint, (turns, slides): (f64, f64)) -> f64 {
    if joint.kind == JointKind::Prismatic { slides } else { turns }
}

/// A motor that turns one joint from its lower limit at σ = 0 to its upper one at σ = 1.
fn servo(actuator: &Actuator, joint: &Joint, at: &At, element: &str, log: &mut Log) -> (Motor, Wound) {
    let mut guesses = Vec::new();
    let mut or = |value: Option<f64>, name: &str, guess: f64| {
        value.filter(|x| x.is_finite() && *x > 0.0).unwrap_or_else(|| {
            guesses.push(format!("{name} {guess:.4}"));
            guess
        })
    };
    let limits = HandLimits::default();
    let [low, high] = joint.limits.unwrap_or([-std::f64::consts::PI, std::f64::consts::PI]);
    let range = high - low;
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
    let fastest = (limits.motor_speed_per_s * range).min(limits.motor_power_w / force);
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
        None if joint.damping.is_some_and(|d| d > 0.0) => 0.0,
        None => or(None, "damping", LAG * stiffness),
    };
    if !guesses.is_empty() {
        log.guessed(
            at.clone(),
            element,
            format!("its servo on joint '{}' has {}", joint.name, guesses.join(", ")),
        );
    }
    // A range beside 0 has its beginning in the tendon, because a motor's offset is within its travel.
    let offset = -low / range;
    let (offset, rest) = if offset.abs() > limits.motor_offset { (0.0, low) } else { (offset, 0.0) };
    let motor = Motor { name: actuator.name.clone(), scaling: range, offset, speed_limit: speed / range };
    let servo = Wound {
        name: joint.name.clone(),
        motors: vec![(actuator.name.clone(), 1.0)],
        arms: vec![(joint.name.clone(), 1.0)],
        paths: Vec::new(),
        rest,
        stiffness,
        damping,
        force_limit: force,
        both_ways: true,
        hold_limit: None,
        breakaway: false,
    };
    (motor, servo)
}

/// A tendon with its motors.
fn cable(tendon: &Tendon, draft: &Draft, log: &mut Log) -> Option<(Vec<Motor>, Wound)> {
    let (at, element) = (At::Tendon(tendon.name.clone()), format!("tendon '{}'", tendon.name));
    let mut passed: Vec<(&Joint, &TendonPath)> = Vec::new();
    for (name, path) in &tendon.joints {
        let joint = draft.joints.iter().find(|joint| joint.name == *name);
        match joint.filter(|joint| joint.kind != JointKind::Fixed) {
            // An arm of 0 stays: its transmission has the joint's spring.
            Some(joint) if matches!(path, TendonPath::Arm(_)) || !is_flat(path) => passed.push((joint, path)),
            Some(_) => {}
            None => log.problem(at.clone(), &element, format!("passes joint '{name}', which does not move")),
        }
    }
    if passed.iter().all(|(_, path)| is_flat(path)) && draft.settings.is_none() {
        log.problem(at, element, "has no moment arm on any joint; it is left out");
        return None;
    }
    let limits_of = |joint: &Joint| joint.limits.unwrap_or([0.0, 1.0]);
    let at_rest: f64 = passed.iter().map(|(joint, path)| length(path, joint.rest.unwrap_or_default())).sum();
    let closed: f64 = passed
        .iter()
        .map(|(joint, path)| limits_of(joint).map(|q| length(path, q)).into_iter().fold(f64::MIN, f64::max))
        .sum();
    let travel = if closed > at_rest { closed - at_rest } else { 1.0 };
    let mut guesses = Vec::new();
    let mut or = |value: Option<f64>, name: &str, guess: f64| {
        value.filter(|x| x.is_finite() && *x > 0.0).unwrap_or_else(|| {
            guesses.push(format!("{name} {guess:.4}"));
            guess
        })
    };
    // Twice the tension at which the springs let half of the joints close, or what the joints' efforts allow.
    let middle = |mut list: Vec<f64>| {
        list.retain(|x| x.is_finite() && *x > 0.0);
        list.sort_by(f64::total_cmp);
        list.get(list.len() / 2).copied()
    };
    let arms = || {
        passed.iter().map(|(joint, path)| {
            let [low, high] = limits_of(joint);
            (*joint, (length(path, high) - length(path, low)) / (high - low))
        })
    };
    let springs = arms().map(|(joint, r)| {
        let [low, high] = limits_of(joint);
        let most = if r > 0.0 { high } else { low };
        2.0 * joint.stiffness.unwrap_or_default() * (most - joint.rest.unwrap_or_default()).abs() / r.abs()
    });
    let efforts = arms().filter_map(|(joint, r)| Some(joint.effort? / r.abs()));
    let limits = HandLimits::default();
    let largest = arms().map(|(_, r)| r.abs()).fold(0.0, f64::max);
    let most = limits.tendon_force.min(limits.joint_torque_nm / largest);
    let tension =
        middle(springs.collect()).or_else(|| middle(efforts.collect())).unwrap_or(TENSION).min(most);
    let actuator_of = |motor: &str| draft.actuators.iter().find(|actuator| actuator.name == motor);
    let first = tendon.motors.first().and_then(|(motor, _)| actuator_of(motor));
    let force = or(tendon.force_limit.or(first.and_then(|a| a.force_limit)), "largest tension", tension);
    let stiffness =
        or(tendon.stiffness, "stiffness", (force / (STRETCH * travel)).min(limits.tendon_stiffness));
    let weights: f64 = tendon.motors.iter().map(|(_, weight)| weight.abs()).sum();
    let scaling = travel / if weights > 0.0 { weights } else { 1.0 };
    let fastest = limits.motor_speed_per_s.min(limits.motor_power_w / (force * travel));
    let mut motors = Vec::new();
    for (name, _) in &tendon.motors {
        let actuator = actuator_of(name);
        let (scaling, offset) = match actuator.and_then(|a| a.range).filter(|[low, high]| low < high) {
            Some([low, high]) => (high - low, -low / (high - low)),
            None => (scaling, -at_rest / travel),
        };
        let speed = actuator.and_then(|a| a.speed_limit).map(|speed| speed / scaling);
        let speed = or(speed.filter(|speed| *speed <= fastest), "speed limit", CLOSING.min(fastest));
        motors.push(Motor { name: name.clone(), scaling, offset, speed_limit: speed });
    }
    if !guesses.is_empty() && draft.settings.is_none() {
        let winds = match motors.len() {
            0 => "it is passive",
            1 => "its motor winds from the springs' rest at σ = 0 to the joints' limits at σ = 1",
            _ => "its motors together wind from the springs' rest to the joints' limits",
        };
        log.guessed(at, element, format!("{}; {winds}", guesses.join(", ")));
    }
    let (mut arms, mut paths, mut constant) = (Vec::new(), Vec::new(), 0.0);
    for (joint, path) in passed {
        match path {
            TendonPath::Arm(r) => arms.push((joint.name.clone(), *r)),
            TendonPath::Polynomial(coefficients) => {
                // A hand's polynomial has no constant: it belongs to the rest length.
                constant += coefficients[0];
                paths.push((joint.name.clone(), TendonPath::Polynomial(coefficients[1..].to_vec())));
            }
            TendonPath::Table(points) => paths.push((joint.name.clone(), TendonPath::Table(points.clone()))),
        }
    }
    let wound = Wound {
        name: tendon.name.clone(),
        motors: tendon.motors.clone(),
        arms,
        paths,
        rest: tendon.rest.unwrap_or_default() - constant,
        stiffness,
        damping: tendon.damping.unwrap_or_default(),
        force_limit: force,
        both_ways: tendon.both_ways,
        hold_limit: tendon.hold_limit.map(|hold| hold.max(force)),
        breakaway: tendon.breakaway,
    };
    Some((motors, wound))
}

/// Whether a path never changes the tendon's length.
fn is_flat(path: &TendonPath) -> bool {
    match path {
        TendonPath::Arm(r) => *r == 0.0,
        TendonPath::Polynomial(coefficients) => coefficients.iter().skip(1).all(|c| *c == 0.0),
        TendonPath::Table(points) => points.windows(2).all(|pair| pair[0][1] == pair[1][1]),
    }
}

/// Length that a joint at q takes up.
fn length(path: &TendonPath, q: f64) -> f64 {
    match path {
        TendonPath::Arm(r) => r * q,
        TendonPath::Polynomial(coefficients) => coefficients.iter().rev().fold(0.0, |sum, c| sum * q + c),
        TendonPath::Table(points) => {
            let after = points.partition_point(|[x, _]| *x <= q).clamp(1, points.len().max(2) - 1);
            match (points.get(after - 1), points.get(after)) {
                (Some([a, s]), Some([b, t])) if b > a => s + (t - s) * (q - a) / (b - a),
                _ => 0.0,
            }
        }
    }
}

/// Says what a hand has no place for.
fn without_place(draft: &mut Draft, log: &mut Log) {
    let armatures = draft.joints.iter().filter(|joint| joint.armature.is_some_and(|x| x > 0.0)).count();
    if armatures > 0 {
        let text = format!("the rotor inertia (armature) of {armatures} joints has no place in a hand");
        log.dropped(At::Hand, "joints", text);
    }
    for pin in draft.loops.iter().filter(|pin| pin.welded) {
        let text = "joins orientations as well; taken is the common point only";
        log.guessed(At::Hand, format!("loop '{}'", pin.name), text);
    }
    let names: BTreeSet<&str> = draft.links.iter().map(|link| link.name.as_str()).collect();
    draft.loops.retain(|pin| {
        let there = pin.links.iter().all(|link| names.contains(link.as_str()));
        if !there {
            let text = format!("joins {} and {}, which are not both there", pin.links[0], pin.links[1]);
            log.problem(At::Hand, format!("loop '{}'", pin.name), text);
        }
        there
    });
}

/// Damping of joints that state none.
fn dampers(draft: &mut Draft, driven: &BTreeSet<String>, log: &mut Log) {
    let leaders: BTreeSet<String> = draft.couplings.iter().map(|coupling| coupling.joint.clone()).collect();
    for joint in &mut draft.joints {
        let moves = joint.kind != JointKind::Fixed && !leaders.contains(&joint.name);
        if !moves {
            continue;
        }
        let (at, element) = (At::Joint(joint.name.clone()), format!("joint '{}'", joint.name));
        let spring = joint.stiffness.filter(|k| *k > 0.0);
        if draft.loops.is_empty() && !driven.contains(&joint.name) && spring.is_none() {
            log.problem(
                at.clone(),
                &element,
                "has no motor, no tendon, no spring and follows no joint: it moves freely",
            );
        }
        if joint.damping.is_some_and(|d| d > 0.0) {
            continue;
        }
        let servo = draft.actuators.iter().any(|a| a.drive == Drive::Joint(joint.name.clone()));
        if servo && spring.is_none() {
            continue;
        }
        let damping = spring.map_or(of_kind(joint, DAMPING), |k| SPRING_LAG * k);
        joint.damping = Some(damping);
        log.guessed(at, element, format!("states no damping; taken is {damping:.6}"));
    }
}
