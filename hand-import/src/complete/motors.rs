//! Motors and tendons as a hand has them: a motor at σ from 0 to 1 winds its tendons to s = scaling · (σ − offset).

use std::collections::BTreeSet;

use palmares_models::hand::{Motor, MotorSettings, StatedTendon, TendonNumbers};
use palmares_models::measure::HandLimits;

use super::followers::length;
use super::servos::{self, Servo, of_kind};
use crate::decision::{At, Log};
use crate::draft::{Draft, Drive, Joint, JointKind, Tendon, TendonPath};

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
    /// Its other numbers.
    pub(crate) numbers: TendonNumbers,
}

impl Wound {
    /// The motor of a tendon that a transmission of the URDF can state: one motor, constant moment arms.
    pub(crate) fn motor_in_urdf(&self) -> Option<&str> {
        match self.motors.as_slice() {
            [(motor, weight)] if *weight == 1.0 && self.paths.is_empty() => Some(motor),
            _ => None,
        }
    }
}

/// Largest damping over stiffness of a servo that a description can mean, s.
const SLOWEST: f64 = 1.0;
/// Part of its travel by which a tendon stretches at its largest tension.
pub(crate) const STRETCH: f64 = 0.002;
/// Largest speed of a tendon's motor, 1/s: it closes in half a second.
const CLOSING: f64 = 2.0;
/// Largest tension of a tendon without springs and efforts to compare with, in its own unit.
const TENSION: f64 = 10.0;
/// Damping over stiffness of a joint with a spring, s.
pub(crate) const SPRING_LAG: f64 = 0.05;
/// Damping of a joint that nothing else damps, N·m·s/rad and N·s/m.
const DAMPING: (f64, f64) = (0.01, 5.0);

/// The motors and tendons of a draft.
pub(crate) fn complete(draft: &mut Draft, log: &mut Log) -> (Vec<Motor>, Vec<Wound>, Vec<Servo>) {
    let kept = draft.settings.is_some();
    if draft.actuators.is_empty() && !kept {
        servos::everywhere(draft, log);
    }
    if !kept {
        stand_ins(draft, log);
    }
    let servos = servos::complete(draft, log);
    let mut driven: BTreeSet<String> = servos.iter().map(|servo| servo.joint.clone()).collect();
    let (mut motors, mut wound) = (Vec::new(), Vec::new());
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
    driven.extend(draft.springs.iter().flat_map(|spring| &spring.joints).map(|(joint, _)| joint.clone()));
    if !kept {
        dampers(draft, &driven, log);
        without_place(draft, log);
    }
    (motors, wound, servos)
}

/// Takes out gains and dampings that no hand may have: descriptions for pictures copy them from one kind of joint to another.
fn stand_ins(draft: &mut Draft, log: &mut Log) {
    let limits = HandLimits::default();
    let check = |log: &mut Log, value: &mut Option<f64>, what: &str, most: f64, at: &At, element: &str| {
        if let Some(x) = value.take_if(|x| *x > most) {
            let text = format!("states {what} {x}, more than the {most} that a hand may have: a stand-in");
            log.guessed(at.clone(), element, text);
        }
    };
    for joint in &mut draft.joints {
        let most = of_kind(joint, (limits.joint_damping_nms_rad, limits.slide_damping_ns_m));
        let (at, element) = (At::Joint(joint.name.clone()), format!("joint '{}'", joint.name));
        check(log, &mut joint.stated.damping, "the damping", most, &at, &element);
    }
    for actuator in &mut draft.actuators {
        let (at, element) = (At::Motor(actuator.name.clone()), format!("actuator '{}'", actuator.name));
        check(log, &mut actuator.gain, "the gain", limits.tendon_stiffness, &at, &element);
        check(log, &mut actuator.damping, "the damping", limits.tendon_damping, &at, &element);
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
    let at_rest: f64 =
        passed.iter().map(|(joint, path)| length(path, joint.stated.rest.unwrap_or_default())).sum();
    let closed: f64 = passed
        .iter()
        .map(|(joint, path)| limits_of(joint).map(|q| length(path, q)).into_iter().fold(f64::MIN, f64::max))
        .sum();
    let actuator_of = |motor: &str| draft.actuators.iter().find(|actuator| actuator.name == motor);
    let first = tendon.motors.first().and_then(|(motor, _)| actuator_of(motor));
    let commands = first.filter(|_| tendon.motors.len() == 1).and_then(|actuator| actuator.range);
    let commands = commands.filter(|[from, to]| from != to && tendon.stated.rest.is_none());
    // A motor's commands are lengths of its own; its weight makes them the tendon's.
    let weight = tendon.motors.first().map_or(1.0, |(_, weight)| *weight);
    let [from, to] = match commands {
        Some(commands) => commands.map(|length| weight * length),
        None => [at_rest, if closed > at_rest { closed } else { at_rest + 1.0 }],
    };
    let travel = (to - from).abs();
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
        2.0 * joint.stated.stiffness.unwrap_or_default()
            * (most - joint.stated.rest.unwrap_or_default()).abs()
            / r.abs()
    });
    let efforts = arms().filter_map(|(joint, r)| Some(joint.effort? / r.abs()));
    let limits = HandLimits::default();
    let largest = arms().map(|(_, r)| r.abs()).fold(0.0, f64::max);
    let most = limits.tendon_force.min(limits.joint_torque_nm / largest);
    let tension =
        middle(springs.collect()).or_else(|| middle(efforts.collect())).unwrap_or(TENSION).min(most);
    let force =
        or(tendon.stated.force_limit.or(first.and_then(|a| a.force_limit)), "largest tension", tension);
    let stiffness =
        or(tendon.stated.stiffness, "stiffness", (force / (STRETCH * travel)).min(limits.tendon_stiffness));
    let weights: f64 = tendon.motors.iter().map(|(_, weight)| weight.abs()).sum();
    let scaling = match commands {
        Some([from, to]) => to - from,
        None => (to - from) / if weights > 0.0 { weights } else { 1.0 },
    };
    let (offset, wound_at_0) = counted([from, to]);
    let fastest = limits.motor_speed_per_s.min(limits.motor_power_w / (force * travel));
    let mut motors = Vec::new();
    for (name, _) in &tendon.motors {
        let actuator = actuator_of(name);
        // Several motors each have a range of their own.
        let own = actuator.and_then(|a| a.range).filter(|[low, high]| tendon.motors.len() > 1 && low < high);
        let (scaling, offset) =
            own.map_or((scaling, offset), |[low, high]| (high - low, -low / (high - low)));
        let speed = actuator.and_then(|a| a.speed_limit).map(|speed| speed / scaling.abs());
        let speed = or(speed.filter(|speed| *speed <= fastest), "speed limit", CLOSING.min(fastest));
        motors.push(MotorSettings::plain(scaling, offset, speed).motor(name));
    }
    if !guesses.is_empty() && draft.settings.is_none() {
        let winds = match motors.len() {
            0 => "it is passive",
            1 if commands.is_some() => "its motor winds over the range of its command",
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
    let wound_at_0 = if motors.is_empty() { 0.0 } else { wound_at_0 };
    let stated = StatedTendon {
        rest: Some(tendon.stated.rest.unwrap_or_default() + wound_at_0 - constant),
        stiffness: Some(stiffness),
        force_limit: Some(force),
        hold_limit: tendon.stated.hold_limit.map(|hold| hold.max(force)),
        ..tendon.stated
    };
    let wound = Wound {
        name: tendon.name.clone(),
        motors: tendon.motors.clone(),
        arms,
        paths,
        numbers: stated.numbers(),
    };
    Some((motors, wound))
}

/// The offset of a motor that winds from one length to another, and the length wound without it: a range far from 0 counts from
/// its first end, as the offset would be many ranges.
pub(crate) fn counted([from, to]: [f64; 2]) -> (f64, f64) {
    if from.abs() > (to - from).abs() { (0.0, from) } else { (-from / (to - from), 0.0) }
}

/// Whether a path never changes the tendon's length.
fn is_flat(path: &TendonPath) -> bool {
    match path {
        TendonPath::Arm(r) => *r == 0.0,
        TendonPath::Polynomial(coefficients) => coefficients.iter().skip(1).all(|c| *c == 0.0),
        TendonPath::Table(points) => points.windows(2).all(|pair| pair[0][1] == pair[1][1]),
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
        let spring = joint.stated.stiffness.filter(|k| *k > 0.0);
        if draft.loops.is_empty() && !driven.contains(&joint.name) && spring.is_none() {
            log.problem(
                at.clone(),
                &element,
                "has no motor, no tendon, no spring and follows no joint: it moves freely",
            );
        }
        if joint.stated.damping.is_some_and(|d| d > 0.0) {
            continue;
        }
        let servo = draft.actuators.iter().any(|a| a.drive == Drive::Joint(joint.name.clone()));
        if servo && spring.is_none() {
            continue;
        }
        let damping = spring.map_or(of_kind(joint, DAMPING), |k| SPRING_LAG * k);
        joint.stated.damping = Some(damping);
        log.guessed(at, element, format!("states no damping; taken is {damping:.6}"));
    }
}
