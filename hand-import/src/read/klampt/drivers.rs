//! Drivers of a `.rob`: motors of one joint, and affine ones of several.

use super::super::reading::Reading;
use super::lines::{self, Line};
use super::robot::Robot;
use crate::decision::At;
use crate::draft::{Actuator, Control, Coupling, Draft, Drive, JointKind};

/// Reads `driver`, and the gains and frictions of drivers.
pub(super) fn drivers(robot: &Robot<'_>, all: &[Line], draft: &mut Draft, reading: &mut Reading<'_>) {
    let stated: Vec<Line> = all.iter().filter(|line| line.keyword == "driver").cloned().collect();
    let drivers = if stated.is_empty() { each_joint(robot) } else { stated };
    let n = drivers.len();
    let names = all.iter().find(|line| line.keyword == "drivers").map(|line| line.words.clone());
    let names = names.filter(|names| {
        if names.len() != n {
            let text = format!("has {} names for {n} drivers", names.len());
            reading.log.problem(At::Hand, "`drivers`", text);
        }
        names.len() == n
    });
    let gain = robot.list("servop", 1, n, reading);
    let rate = robot.list("servod", 1, n, reading);
    let dry = robot.list("dryfriction", 1, n, reading);
    let viscous = robot.list("viscousfriction", 1, n, reading);
    let efforts = robot.list("torquemax", 1, robot.names.len(), reading);
    if robot.list("servoi", 1, n, reading).is_some_and(|list| list.iter().any(|x| *x != 0.0)) {
        reading.log.dropped(At::Hand, "`servoI`", "a motor has no integral part");
    }
    for (k, line) in drivers.into_iter().enumerate() {
        let kind = line.words.first().map(|word| word.to_lowercase()).unwrap_or_default();
        let element = format!("driver {k}");
        let links = match kind.as_str() {
            "normal" => line.words.get(1).and_then(|word| robot.index(word)).map(|i| vec![(i, 1.0, 0.0)]),
            "affine" => affine(robot, &line),
            "translation" | "rotation" => {
                let text =
                    format!("`driver {kind}` moves the robot's base, which the controller's arm moves");
                reading.log.dropped(At::Hand, element, text);
                continue;
            }
            _ => None,
        };
        let Some(links) = links.filter(|links| !links.is_empty()) else {
            let valid =
                "normal LINK; affine N LINKS SCALES OFFSETS LIMITS; translation and rotation of a base";
            let text = format!("`driver {}` is not read; valid: {valid}", line.words.join(" "));
            reading.log.problem(At::Hand, element, text);
            continue;
        };
        let (leader, leading, _) = links[0];
        let joint = robot.joint_name(leader);
        let found = draft.joints.iter_mut().find(|other| other.name == joint);
        let Some(found) = found.filter(|found| found.kind != JointKind::Fixed) else {
            reading.log.dropped(
                At::Hand,
                element,
                format!("drives link '{}', which is fixed", robot.names[leader]),
            );
            continue;
        };
        let value =
            |list: &Option<Vec<f64>>| list.as_ref().map(|list| list[k]).filter(|x| x.is_finite() && *x > 0.0);
        // Klamp't applies a driver's torque times its scale to each of its joints.
        let squares: f64 = links.iter().map(|(_, scale, _)| scale * scale).sum();
        let (per_force, per_rate) = (squares / leading.abs(), squares / (leading * leading));
        found.stated.damping = value(&viscous).map(|damping| damping * per_rate);
        found.stated.friction = value(&dry).map(|friction| friction * per_force);
        let limit = |part: usize| {
            let word = line.words.get(2 + 3 * links.len() + part).and_then(|word| lines::number(word))?;
            Some(word.abs()).filter(|x| kind == "affine" && x.is_finite() && *x > 0.0)
        };
        // No joint of it has more than its own torque.
        let own = links.iter().filter_map(|&(i, scale, _)| Some(efforts.as_ref()?[i] / scale.abs()));
        let torque = own.chain(limit(5)).filter(|x| x.is_finite() && *x > 0.0).reduce(f64::min);
        let torque = torque.filter(|_| kind == "affine");
        let speed = limit(3);
        let motor = names.as_ref().map_or(&robot.names[leader], |names| &names[k]).clone();
        if links.len() > 1 {
            let others: Vec<&str> = links[1..].iter().map(|(i, ..)| robot.names[*i].as_str()).collect();
            let text = format!("one motor moves '{motor}' and, in proportion, {}", others.join(", "));
            reading.log.taken(At::Motor(motor.clone()), &element, text);
        }
        for &(i, scale, offset) in &links[1..] {
            // With a driver value x, joint i is at scale · x + offset.
            let multiplier = scale / leading;
            let constant = offset - multiplier * links[0].2;
            draft.couplings.push(Coupling {
                joint: robot.joint_name(i),
                leader: joint.clone(),
                coefficients: vec![constant, multiplier],
            });
        }
        draft.actuators.push(Actuator {
            control: Some(Control::Position),
            gain: value(&gain).map(|gain| gain * per_rate),
            damping: value(&rate).map(|damping| damping * per_rate),
            force_limit: torque.map(|torque| torque * per_force),
            speed_limit: speed.map(|speed| speed * leading.abs()),
            ..Actuator::of(&motor, Drive::Joint(joint))
        });
    }
}

/// Without `driver` lines each joint that moves by itself has one.
fn each_joint(robot: &Robot<'_>) -> Vec<Line> {
    let moves = (0..robot.names.len()).filter(|&i| robot.kinds[i] != "weld");
    let line =
        |i: usize| Line { keyword: "driver".to_owned(), words: vec!["normal".to_owned(), i.to_string()] };
    moves.map(line).collect()
}

/// `affine N links… scales… offsets…`, then lowest and highest value, speed and torque.
fn affine(robot: &Robot<'_>, line: &Line) -> Option<Vec<(usize, f64, f64)>> {
    let count: usize = line.words.get(1)?.parse().ok().filter(|n| *n > 0 && *n <= robot.names.len())?;
    let words = |part: usize| line.words.get(2 + part * count..2 + (part + 1) * count);
    let links: Vec<usize> = words(0)?.iter().map_while(|word| robot.index(word)).collect();
    let numbers = |part: usize| -> Option<Vec<f64>> {
        Some(words(part)?.iter().map_while(|word| lines::number(word)).filter(|x| x.is_finite()).collect())
    };
    let (scales, offsets) = (numbers(1)?, numbers(2)?);
    let complete =
        links.len() == count && scales.len() == count && offsets.len() == count && scales[0] != 0.0;
    complete.then(|| (0..count).map(|k| (links[k], scales[k], offsets[k])).collect())
}
