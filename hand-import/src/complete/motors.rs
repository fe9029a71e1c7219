//! Motors and tendons as a hand has them: a motor at σ from 0 to 1 winds its tendons to s = scaling · (σ − offset).

use std::collections::BTreeSet;

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
    pub(crate) motor: String,
    /// Entries of R by joint.
    pub(crate) arms: Vec<(String, f64)>,
    pub(crate) stiffness: f64,
    pub(crate) damping: f64,
    pub(crate) force_limit: f64,
    pub(crate) both_ways: bool,
}

/// Speed of a servo that states none.
const SPEED: (f64, f64) = (3.0, 0.1);
/// Largest force of a servo that states none.
const FORCE: (f64, f64) = (1.0, 20.0);
/// Error of position at which a servo has its largest force.
const ERROR: (f64, f64) = (0.05, 5e-4);
/// Damping over stiffness of a servo, s.
const LAG: f64 = 0.02;
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
    let (mut motors, mut wound) = (Vec::new(), Vec::new());
    let mut driven = BTreeSet::new();
    for tendon in draft.tendons.clone() {
        if let Some((motor, cable)) = cable(&tendon, draft, log) {
            driven.extend(cable.arms.iter().map(|(joint, _)| joint.clone()));
            if !motors.iter().any(|other: &Motor| other.name == motor.name) {
                motors.push(motor);
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
    if !kept {
        dampers(draft, &driven, log);
    }
    (motors, wound)
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
    draft.actuators.extend(names.into_iter().map(|name| Actuator {
        name: name.clone(),
        drive: Drive::Joint(name),
        gear: 1.0,
        control: None,
        gain: None,
        damping: None,
        force_limit: None,
        speed_limit: None,
        range: None,
    }));
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
    let [low, high] = joint.limits.unwrap_or([-std::f64::consts::PI, std::f64::consts::PI]);
    let range = high - low;
    let force = or(actuator.force_limit.or(joint.effort), "largest force", of_kind(joint, FORCE));
    let speed = or(actuator.speed_limit.or(joint.velocity), "largest speed", of_kind(joint, SPEED));
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
    let motor = Motor {
        name: actuator.name.clone(),
        scaling: range,
        offset: -low / range,
        speed_limit: speed / range,
    };
    let servo = Wound {
        name: joint.name.clone(),
        motor: actuator.name.clone(),
        arms: vec![(joint.name.clone(), 1.0)],
        stiffness,
        damping,
        force_limit: force,
        both_ways: true,
    };
    (motor, servo)
}

/// A tendon with its motor.
fn cable(tendon: &Tendon, draft: &Draft, log: &mut Log) -> Option<(Motor, Wound)> {
    let (at, element) = (At::Tendon(tendon.name.clone()), format!("tendon '{}'", tendon.name));
    let mut arms = Vec::new();
    for (name, path) in &tendon.joints {
        let joint = draft.joints.iter().find(|joint| joint.name == *name);
        let Some(joint) = joint.filter(|joint| joint.kind != JointKind::Fixed) else {
            log.problem(at.clone(), &element, format!("passes joint '{name}', which does not move"));
            continue;
        };
        arms.push((joint, arm(path, joint, &at, &element, log)));
    }
    let [(motor, _), others @ ..] = tendon.motors.as_slice() else {
        log.problem(at, element, "has no motor; it is left out");
        return None;
    };
    if !others.is_empty() {
        let names: Vec<&str> = others.iter().map(|(name, _)| name.as_str()).collect();
        log.problem(
            at.clone(),
            &element,
            format!("has further motors, {}; only '{motor}' winds it", names.join(", ")),
        );
    }
    if arms.iter().all(|(_, r)| *r == 0.0) {
        log.problem(at, element, "has no moment arm on any joint; it is left out");
        return None;
    }
    let rest: f64 = arms.iter().map(|(joint, r)| r * joint.rest.unwrap_or_default()).sum();
    let closed: f64 = arms
        .iter()
        .map(|(joint, r)| {
            let [low, high] = joint.limits.unwrap_or([0.0, 1.0]);
            f64::max(r * low, r * high)
        })
        .sum();
    let travel = if closed > rest { closed - rest } else { 1.0 };
    let mut guesses = Vec::new();
    let mut or = |value: Option<f64>, name: &str, guess: f64| {
        value.filter(|x| x.is_finite() && *x > 0.0).unwrap_or_else(|| {
            guesses.push(format!("{name} {guess:.4}"));
            guess
        })
    };
    // Twice the tension that the springs of the closed hand need, or what the joints' efforts allow.
    let springs = arms.iter().filter(|(_, r)| *r != 0.0).map(|(joint, r)| {
        let [low, high] = joint.limits.unwrap_or([0.0, 1.0]);
        let most = if *r > 0.0 { high } else { low };
        2.0 * joint.stiffness.unwrap_or_default() * (most - joint.rest.unwrap_or_default()).abs() / r.abs()
    });
    let springs = springs.fold(0.0, f64::max);
    let efforts =
        arms.iter().filter(|(_, r)| *r != 0.0).filter_map(|(joint, r)| Some(joint.effort? / r.abs()));
    let efforts = efforts.fold(0.0, f64::max);
    let tension = [springs, efforts, TENSION].into_iter().find(|x| *x > 0.0).unwrap_or(TENSION);
    let actuator = draft.actuators.iter().find(|actuator| actuator.name == *motor);
    let force =
        or(tendon.force_limit.or_else(|| actuator.and_then(|a| a.force_limit)), "largest tension", tension);
    let stiffness = or(tendon.stiffness, "stiffness", force / (STRETCH * travel));
    let speed = actuator.and_then(|a| a.speed_limit).map(|speed| speed / travel);
    let speed = or(speed, "speed limit", CLOSING);
    if !guesses.is_empty() && draft.settings.is_none() {
        let text = format!(
            "{}; its motor winds from the springs' rest at σ = 0 to the joints' limits at σ = 1",
            guesses.join(", ")
        );
        log.guessed(at, element, text);
    }
    let motor = Motor { name: motor.clone(), scaling: travel, offset: -rest / travel, speed_limit: speed };
    let wound = Wound {
        name: tendon.name.clone(),
        motor: motor.name.clone(),
        arms: arms.into_iter().map(|(joint, r)| (joint.name.clone(), r)).collect(),
        stiffness,
        damping: tendon.damping.unwrap_or_default(),
        force_limit: force,
        both_ways: tendon.both_ways,
    };
    Some((motor, wound))
}

/// The moment arm of a path, its mean over the joint's range if it is not constant.
fn arm(path: &TendonPath, joint: &Joint, at: &At, element: &str, log: &mut Log) -> f64 {
    let [low, high] = joint.limits.unwrap_or([-1.0, 1.0]);
    let length = |q: f64| match path {
        TendonPath::Arm(r) => r * q,
        TendonPath::Polynomial(c) => c.iter().rev().fold(0.0, |sum, c| sum * q + c),
        TendonPath::Table(points) => {
            let after = points.partition_point(|[x, _]| *x <= q).clamp(1, points.len().max(2) - 1);
            match (points.get(after - 1), points.get(after)) {
                (Some([a, s]), Some([b, t])) if b > a => s + (t - s) * (q - a) / (b - a),
                _ => 0.0,
            }
        }
    };
    match path {
        TendonPath::Arm(r) => *r,
        TendonPath::Polynomial(_) | TendonPath::Table(_) => {
            let mean = (length(high) - length(low)) / (high - low);
            let text = format!(
                "its moment arm on joint '{}' changes with the angle; taken is the mean, {mean:.6}",
                joint.name
            );
            log.guessed(at.clone(), element, text);
            mean
        }
    }
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
        if !driven.contains(&joint.name) && spring.is_none() {
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
